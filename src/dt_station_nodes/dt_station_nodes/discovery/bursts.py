"""When a disturbance that comes and goes is on, read off a residual.

No fit finds them from afar: an interval that is half a period off has no slope that leads to the right one.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Of the residual's power: what intervals of silence must explain of it.
TELLING = 0.1
# A gap shorter than so many cycles is no pause; bursts come at least and at most so often in a run: once is chance,
# and very often a beat of two frequencies.
FEWEST_CYCLES = 3.0
FEWEST_BURSTS = 2.0
MOST_BURSTS = 20.0
_STARTS = 48
_SHARES = np.linspace(0.15, 0.85, 15)
# A period is tried where it ends this part of itself later in the run than the last one did.
_FINE = 0.1


@dataclass(frozen=True, slots=True)
class Bursts:
    """A disturbance on for `share` of every `period_s`, from `start_s` of the run on."""

    period_s: float
    share: float
    start_s: float


def _carried(residual: Array, sample_time_s: float, frequency_hz: float) -> NDArray[np.complex128]:
    """Running sum (n + 1,) of a residual (n,) turned back by a frequency."""
    turns = np.exp(-2j * np.pi * frequency_hz * sample_time_s * np.arange(len(residual)))
    return np.concatenate([[0.0], np.cumsum(residual * turns)])


def _power(summed: NDArray[np.complex128], step_s: float, period_s: float, starts_s: Array, shares: Array) -> Array:
    """Power explained by a sinusoid that is on in these intervals, shape (starts, shares)."""
    n = len(summed) - 1
    cycles = np.arange(-1, math.ceil(n * step_s / period_s) + 1)
    begins = (starts_s[:, None, None] + cycles * period_s) / step_s
    edges = [
        np.clip(np.rint(at), 0, n).astype(np.int64) for at in (begins, begins + shares[:, None] * period_s / step_s)
    ]
    lengths = np.sum(edges[1] - edges[0], axis=-1)
    inside = np.sum(summed[edges[1]] - summed[edges[0]], axis=-1)
    return np.asarray(2.0 * np.abs(inside) ** 2 / np.maximum(lengths, 1))


def bursts(residual: Array, sample_time_s: float, frequency_hz: float) -> Bursts | None:
    """On and off times that explain most of a residual (n,) at a frequency; None where silence explains nothing."""
    total = float(residual @ residual)
    length_s = len(residual) * sample_time_s
    shortest = max(FEWEST_CYCLES / max(frequency_hz, 1e-9), length_s / MOST_BURSTS)
    longest = length_s / FEWEST_BURSTS
    if not total > 0.0 or shortest >= longest:
        return None
    summed = _carried(residual, sample_time_s, frequency_hz)
    steady = 2.0 * float(np.abs(summed[-1])) ** 2 / len(residual)
    best, found = 0.0, None
    period = shortest
    while period <= longest:
        starts = np.arange(_STARTS) * period / _STARTS
        power = _power(summed, sample_time_s, period, starts, _SHARES)
        place = int(np.argmax(power))
        if power.flat[place] > best:
            start, share = np.unravel_index(place, power.shape)
            best, found = float(power.flat[place]), Bursts(period, float(_SHARES[share]), float(starts[start]))
        period *= 1.0 + _FINE * min(period / length_s, 1.0)
    return found if best - steady >= TELLING * total else None


def burst_start_s(residual: Array, sample_time_s: float, frequency_hz: float, period_s: float, share: float) -> float:
    """When bursts of known frequency, period and share begin in a residual (n,)."""
    summed = _carried(residual, sample_time_s, frequency_hz)
    starts = np.arange(4 * _STARTS) * period_s / (4 * _STARTS)
    return float(starts[int(np.argmax(_power(summed, sample_time_s, period_s, starts, np.array([share]))))])
