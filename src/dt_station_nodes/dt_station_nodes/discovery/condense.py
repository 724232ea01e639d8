"""Long or fast runs, made short enough to search in: fewer samples a second where the path allows, else a stretch."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..core.channels import Channel
from ..core.models import PathSpec
from ..core.run import Run

Array = NDArray[np.float64]

# Samples that a search goes through at most; the parameters found are refitted on all of them.
MOST_SAMPLES = 4000
# A sample may last this part of the path's fastest time constant; a crude model may be off by a few times.
FINE = 0.1
_VOLTAGES = tuple(channel.voltage_signal for channel in Channel)


@dataclass(frozen=True, slots=True)
class Condensed:
    """The run to search in, the rows of the given run that its samples are, and a sentence on what was done."""

    run: Run
    rows: NDArray[np.int64]
    note: str = ""


def fastest_s(path: PathSpec) -> float:
    """Time constant (s) of the path's fastest pole, infinite where it only integrates."""
    poles = np.abs(np.roots(path.denominator))
    highest = float(poles.max(initial=0.0)) / path.time_scale
    return 1.0 / highest if highest > 0.0 else np.inf


def slowest_s(path: PathSpec) -> float:
    """Time constant (s) in which what the path remembers dies out, integrators apart; 0 where nothing is left."""
    damping = np.abs(np.real(np.roots(path.denominator)))
    dying = damping[damping > 1e-9 * max(float(damping.max(initial=0.0)), 1e-300)]
    return path.time_scale / float(dying.min()) if len(dying) else 0.0


def _thinned(run: Run, factor: int) -> Condensed:
    """Every `factor`-th sample; a voltage is the mean of those held until the next, which drives a slow path alike."""
    count = len(run) // factor
    rows = np.arange(count) * factor
    signals = {}
    for name, values in run.signals.items():
        blocks = values[: count * factor].reshape(count, factor)
        signals[name] = np.ascontiguousarray(blocks.mean(axis=1) if name in _VOLTAGES else blocks[:, 0])
    return Condensed(Run(run.sample_time_s * factor, signals, run.start_s, run.source, run.units), rows)


def _liveliest(values: Array, length: int) -> int:
    """Where the stretch of `length` samples begins in which a signal moves most, in steps of a quarter of it."""
    starts = range(0, len(values) - length + 1, max(length // 4, 1))
    return max(starts, key=lambda start: (float(np.std(values[start : start + length])), -start))


def condensed(run: Run, channel: Channel, path: PathSpec, most: int = MOST_SAMPLES) -> Condensed:
    """The run itself where it has at most `most` samples; else thinned as far as the path allows, then cut."""
    if len(run) <= most:
        return Condensed(run, np.arange(len(run)))
    allowed = FINE * fastest_s(path) / run.sample_time_s
    factor = max(1, min(-(-len(run) // most), int(min(allowed, len(run)))))
    thin = _thinned(run, factor) if factor > 1 else Condensed(run, np.arange(len(run)))
    said = [f"in steps of {1e3 * thin.run.sample_time_s:.3g} ms"] if factor > 1 else []
    length = max(most, 1)
    if len(thin.run) > length * 5 // 4:
        start = _liveliest(thin.run.signals[channel.voltage_signal], length)
        part = thin.run.window(start, start + length)
        thin = Condensed(part, thin.rows[start : start + length])
        begin = part.start_s - run.start_s
        said.append(f"from {begin:.3g} to {begin + length * part.sample_time_s:.3g} s, where the voltage moves most")
    if not said:
        return thin
    note = (
        f"{channel.value}: the run is long, so candidates were searched for {' and '.join(said)}; "
        "parameters and figures are of the whole run"
    )
    return Condensed(thin.run, thin.rows, note)
