"""Samples read wrongly: single ones far off a smooth course, which least squares would bend everything towards."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..core.channels import Channel
from ..core.run import Run
from .noise import difference_noise

Array = NDArray[np.float64]

_NOISES = 12.0  # times the noise,
_SHARE = 0.05  # of the signal's standard deviation
_TIMES = 4.0  # and times what nearly all samples are off: movement that is quick everywhere is no fault
_NEARLY_ALL = 0.97
_SMOOTH = 0.5  # of how far off a sample is, by which its neighbours themselves may bend: a jump bends them more
_PEAK = 0.7  # of the same, by which it stands out from either: where quick movement ends it does from one


def spikes(measured: Array) -> NDArray[np.intp]:
    """Indices of single samples of a signal (n,) far off the cubic through the two before and the two behind."""
    if len(measured) < 5:
        return np.zeros(0, dtype=np.intp)
    at = np.arange(2, len(measured) - 2)
    off = np.abs(measured[at] - _course(measured, at))
    bend = np.abs(measured[at - 2] - 2.0 * measured[at - 1] + 2.0 * measured[at + 1] - measured[at + 2])
    least = max(
        _NOISES * difference_noise(measured),
        _SHARE * float(np.std(measured)),
        _TIMES * float(np.quantile(off, _NEARLY_ALL)),
    )
    before, behind = measured[at] - measured[at - 1], measured[at] - measured[at + 1]
    # What lies between its neighbours is where a quick movement begins or ends.
    peak = np.where(before * behind > 0.0, np.minimum(np.abs(before), np.abs(behind)), 0.0)
    return at[(off > least) & (bend < _SMOOTH * off) & (peak > _PEAK * off)]


def _course(measured: Array, at: NDArray[np.intp]) -> Array:
    """What the two samples before and the two behind say of those `at` some places."""
    near, far = measured[at - 1] + measured[at + 1], measured[at - 2] + measured[at + 2]
    return np.asarray((4.0 * near - far) / 6.0)


def without_spikes(run: Run) -> tuple[Run, list[str]]:
    """The run with such samples put on their neighbours' course, and a note for each channel that had any."""
    signals, notes = dict(run.signals), list[str]()
    for channel in Channel:
        measured = signals.get(channel.signal)
        if measured is None or not np.isfinite(measured).all() or not len(wrong := spikes(measured)):
            continue
        mended = measured.copy()
        mended[wrong] = _course(measured, wrong)
        signals[channel.signal] = mended
        notes.append(
            f"{channel.value}: {len(wrong)} single sample{'s' * (len(wrong) > 1)} far off all others, the first at "
            f"{wrong[0] * run.sample_time_s:.4g} s, taken as read wrongly and put on the course of the neighbours"
        )
    return (replace(run, signals=signals) if notes else run), notes
