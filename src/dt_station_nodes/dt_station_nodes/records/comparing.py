"""How far apart two runs are, or object and twin of one: per channel, over a window, with the delay taken out."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..core.channels import Channel
from ..core.comparison import Score, score
from ..core.run import Array, Run
from .bag import Bag
from .bagrun import STATE, TWIN, Samples, common_samples, plant_samples, window
from .errors import RecordError

_SIGNALS = tuple(channel.signal for channel in Channel)
_STRIDE = 1 << 16


@dataclass(frozen=True, slots=True)
class Gap:
    """One channel: figures of first minus second, and the same with the second shifted by `delay_s`.

    ISE in unit^2 s, RMS in the channel's unit, fit in percent; residual arrays of shape (n,).
    """

    samples: int
    ise: float
    rms: float
    fit_percent: float
    delay_s: float
    aligned_ise: float
    aligned_rms: float
    aligned_fit_percent: float
    time_s: Array
    first: Array
    second: Array


@dataclass(frozen=True, slots=True)
class Comparison:
    """What was compared with what, and the gap per channel. `missed` samples had no partner."""

    first: str
    second: str
    sample_time_s: float
    missed: int
    channels: Mapping[Channel, Gap]


def compare_bag(
    path: Path, from_s: float | None, to_s: float | None, longest_delay_s: float, number: int | None = None
) -> Comparison:
    """Object against twin in one bag, on the samples both have; raises RecordError."""
    with Bag(path) as bag:
        both, twin, missed = _paired(bag, number, from_s, to_s)
        step = both.sample_time_s()
        time = both.sequence.astype(np.float64) * step
        # a long bag's numbers and stamps make room for its signals
        both, twin = both.bare(), twin.bare()
        mine, other = (
            {name: values[each.rows] for name, values in each.columns(bag, _SIGNALS).items()} for each in (both, twin)
        )
    pairs = {c: (mine[c.signal], other[c.signal]) for c in Channel}
    return _compared(f"{path}: {STATE}", f"{path}: {TWIN}", step, missed, time, pairs, longest_delay_s)


def _paired(bag: Bag, number: int | None, from_s: float | None, to_s: float | None) -> tuple[Samples, Samples, int]:
    """Samples that both object and twin have in a window, and how many have no partner in the whole run."""
    measured, simulated = plant_samples(bag, STATE, number), plant_samples(bag, TWIN, number)
    both, twin = common_samples(measured, simulated)
    missed = len(measured.sequence) + len(simulated.sequence) - 2 * len(both.sequence)
    chosen = window(both, from_s, to_s)
    return both.pick(chosen), twin.pick(chosen), missed


def compare_runs(
    first: Run, second: Run, from_s: float | None, to_s: float | None, longest_delay_s: float
) -> Comparison:
    """Two runs, row for row from their starts; raises RecordError where their sample times differ."""
    step = first.sample_time_s
    if abs(second.sample_time_s - step) > 1e-9 * step:
        raise RecordError(
            f"{second.source} is sampled every {second.sample_time_s:g} s and {first.source} every {step:g} s; "
            "record or resample them alike"
        )
    n = min(len(first), len(second))
    time = step * np.arange(n, dtype=np.float64)
    low, high = -np.inf if from_s is None else from_s - 1e-9, np.inf if to_s is None else to_s - 1e-9
    rows = np.flatnonzero((time >= low) & (time < high))
    pairs = {}
    for channel in Channel:
        mine, other = first.get(channel.signal), second.get(channel.signal)
        if mine is not None and other is not None:
            pairs[channel] = (mine[:n][rows], other[:n][rows])
    missed = len(first) + len(second) - 2 * n
    return _compared(first.source, second.source, step, missed, time[rows], pairs, longest_delay_s)


def _compared(
    first: str,
    second: str,
    step: float,
    missed: int,
    time: Array,
    pairs: Mapping[Channel, tuple[Array, Array]],
    longest_delay_s: float,
) -> Comparison:
    if len(time) < 2:
        raise RecordError(
            f"{first} and {second} have {len(time)} samples in common in this window; at least 2 are needed"
        )
    channels = {}
    for channel, (mine, other) in pairs.items():
        if np.isfinite(mine).any() and np.isfinite(other).any():
            channels[channel] = _gap(mine, other, time, step, longest_delay_s)
    if not channels:
        raise RecordError(f"{first} and {second} have no channel in common")
    return Comparison(first, second, step, missed, channels)


def _gap(first: Array, second: Array, time: Array, step: float, longest_delay_s: float) -> Gap:
    plain = score(first, second, step)
    delay = best_delay(first, second, min(round(longest_delay_s / step), len(first) // 2))
    aligned: Score = score(first, _shifted(second, delay), step) if delay else plain
    return Gap(
        plain.samples, plain.ise, plain.rms, plain.fit_percent, delay * step, aligned.ise, aligned.rms,
        aligned.fit_percent, time, first, second,
    )  # fmt: skip


def _shifted(values: Array, delay: float) -> Array:
    """Values `delay` samples later, interpolated; NaN where there are none. A stretch at a time, to save memory."""
    found = np.full(len(values), np.nan)
    for at in range(0, len(values), _STRIDE):
        wanted = np.arange(at, min(at + _STRIDE, len(values))) - delay
        low, high = max(0, math.floor(wanted[0])), min(len(values), math.ceil(wanted[-1]) + 1)
        if high > low:
            known = np.arange(low, high)
            found[at : at + _STRIDE] = np.interp(wanted, known, values[low:high], np.nan, np.nan)
    return found


def best_delay(first: Array, second: Array, longest: int) -> float:
    """Delay of `first` behind `second` (samples, fractions too) that leaves the least mean square residual.

    Searched over whole samples up to `longest` either way, then refined by a parabola through the best three.
    """
    if longest < 1 or not (np.isfinite(first).all() and np.isfinite(second).all()):
        return 0.0
    shifts = np.arange(-longest, longest + 1)
    squares = np.array([_mean_square(first, second, int(shift)) for shift in shifts])
    best = int(np.argmin(squares))
    if squares[best] >= squares[longest]:
        return 0.0
    if best in (0, len(shifts) - 1):
        # the least residual at the edge of the search is no delay
        return 0.0
    left, middle, right = squares[best - 1 : best + 2]
    bend = left - 2.0 * middle + right
    return float(shifts[best] + (0.5 * (left - right) / bend if bend > 0.0 else 0.0))


def _mean_square(first: Array, second: Array, shift: int) -> float:
    a, b = (first[shift:], second[: len(second) - shift]) if shift >= 0 else (first[:shift], second[-shift:])
    total = 0.0
    for at in range(0, len(a), _STRIDE):
        difference: NDArray[np.float64] = a[at : at + _STRIDE] - b[at : at + _STRIDE]
        total += float(np.dot(difference, difference))
    return total / len(a)
