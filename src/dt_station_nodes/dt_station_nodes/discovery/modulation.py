"""How the frequency and the amplitude of an oscillation swing, read off a residual turned back by its frequency.

The phase swings by whole turns where a machine's speed does so slowly: no fit finds the way there from a steady tone.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .spectrum import Array

Complex = NDArray[np.complex128]

_CYCLES = 2.0  # of the oscillation, over which its phase is a mean
_SLOWEST_TURNS, _QUICKEST_TURNS, _STEP_TURNS = 0.5, 12.0, 0.125  # of a swing, in a run
_TELLING = 0.7  # of what a steady frequency leaves of the phase, or a steady amplitude of that: what a swing explains
_LEAST_RAD = 0.15
_LEAST_SWELL = 0.08


@dataclass(frozen=True, slots=True)
class Swing:
    """A sine in time: its size, frequency (Hz) and phase at the start of the run (rad)."""

    size: float
    frequency_hz: float
    phase_rad: float


@dataclass(frozen=True, slots=True)
class Modulation:
    """A carrier's frequency (Hz), how its phase swings (rad) and, as a share, its amplitude if it does."""

    frequency_hz: float
    phase: Swing
    amplitude: Swing | None


def modulation(residual: Array, sample_time_s: float, frequency_hz: float) -> Modulation | None:
    """The swing of an oscillation's phase near a frequency in a residual (n,); None where a steady one explains it."""
    time_s, envelope = _envelope(residual, sample_time_s, frequency_hz)
    if len(envelope) == 0:
        return None
    length_s = sample_time_s * len(residual)
    size: Array = np.asarray(np.abs(envelope), dtype=np.float64)
    swing, slope = _swing(np.unwrap(np.angle(envelope)), time_s, length_s, size, steady=2)
    if swing is None or swing.size < _LEAST_RAD:
        return None
    level = float(size.mean())
    swell, _ = _swing(size / level, time_s, length_s, np.ones(len(size)), steady=1)
    found = swell if swell is not None and swell.size >= _LEAST_SWELL else None
    return Modulation(frequency_hz + slope / (2.0 * np.pi), swing, found)


def swing_phases_rad(
    residual: Array, sample_time_s: float, frequency_hz: float, modulation_hz: float, swell_hz: float
) -> tuple[float, float]:
    """Phases at the start of a run of the known swings of an oscillation's phase and amplitude, in a residual (n,)."""
    time_s, envelope = _envelope(residual, sample_time_s, frequency_hz)
    if len(envelope) == 0:
        return 0.0, 0.0
    size: Array = np.asarray(np.abs(envelope), dtype=np.float64)
    turns = np.unwrap(np.angle(envelope))
    return _phase_rad(turns, size, modulation_hz * time_s), _phase_rad(size, np.ones(len(size)), swell_hz * time_s)


def _phase_rad(values: Array, weights: Array, turns: Array) -> float:
    """Phase of a sine of known `turns` (n,) in values (n,), beside a constant."""
    angle = 2.0 * np.pi * turns
    columns = np.stack([np.sin(angle), np.cos(angle), np.ones_like(angle)], axis=1) * weights[:, None]
    sine, cosine, _ = np.linalg.lstsq(columns, values * weights, rcond=None)[0]
    return float(np.arctan2(cosine, sine))


def _envelope(residual: Array, sample_time_s: float, frequency_hz: float) -> tuple[Array, Complex]:
    """Times (k,) and complex amplitudes of what lies near a frequency; nothing where the run is too short for any.

    What is not compared yet, at the start of a run, is nothing; towards the ends the mean is of what there is.
    """
    first = int(np.argmax(residual != 0.0))
    time_s: Array = sample_time_s * np.arange(first, len(residual), dtype=np.float64)
    width = round(_CYCLES / (frequency_hz * sample_time_s))
    if width < 2 or 4 * width > len(time_s):
        return np.zeros(0), np.zeros(0, dtype=np.complex128)
    window = np.hanning(width + 2)[1:-1]
    turned = residual[first:] * np.exp(-2j * np.pi * frequency_hz * time_s)
    weight = np.convolve(np.ones(len(time_s)), window, mode="same")
    return time_s, np.asarray(np.convolve(turned, window, mode="same") / weight, dtype=np.complex128)


def _swing(values: Array, time_s: Array, length_s: float, weights: Array, steady: int) -> tuple[Swing | None, float]:
    """The sine that explains most of what a polynomial of `steady` terms leaves of values (n,), and its slope beside.

    None where no sine explains most of it.
    """
    base = np.stack([np.ones_like(time_s), time_s / length_s][:steady], axis=1) * weights[:, None]
    wanted = values * weights
    plain = wanted - base @ np.linalg.lstsq(base, wanted, rcond=None)[0]
    power = float(plain @ plain)
    best, found, slope = (1.0 - _TELLING) * power, None, 0.0
    for turns in np.arange(_SLOWEST_TURNS, _QUICKEST_TURNS, _STEP_TURNS):
        angle = 2.0 * np.pi * float(turns) * time_s / length_s
        columns = np.column_stack([base, np.sin(angle) * weights, np.cos(angle) * weights])
        numbers = np.linalg.lstsq(columns, wanted, rcond=None)[0]
        left = float(np.sum(np.square(wanted - columns @ numbers)))
        if left < best:
            sine, cosine = float(numbers[-2]), float(numbers[-1])
            found = Swing(float(np.hypot(sine, cosine)), float(turns) / length_s, float(np.arctan2(cosine, sine)))
            best, slope = left, float(numbers[1]) / length_s if steady > 1 else 0.0
    return found, slope
