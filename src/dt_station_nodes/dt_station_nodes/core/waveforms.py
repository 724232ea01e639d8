"""Set-point waveforms: definitions, and a generator whose phase is counted, never summed in floating point."""

import math
from dataclasses import dataclass
from enum import Enum
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from .errors import StationError

TURN_RAD = 2.0 * math.pi


class WaveformError(StationError):
    """A waveform that cannot be played."""


class Shape(int, Enum):
    """Form of a waveform, number for number as in `Waveform.msg`."""

    CONSTANT = 0
    SINE = 1
    SQUARE = 2
    TRIANGLE = 3
    SAWTOOTH = 4

    @property
    def usual_duty(self) -> float:
        """The duty a user means who names none: half the period, for a sawtooth all of it."""
        return 1.0 if self is Shape.SAWTOOTH else 0.5


@dataclass(frozen=True, slots=True)
class Waveform:
    """What a generator plays; amplitude and offset in the channel's unit (Pa or m).

    `amplitude` is half of peak to peak, `offset` the middle. `frequency_hz` rests unused by CONSTANT.
    `duty` (1, in 0..1) is the share of the period spent high (square) or rising (triangle, sawtooth).
    """

    shape: Shape = Shape.CONSTANT
    amplitude: float = 0.0
    offset: float = 0.0
    frequency_hz: float = 1.0
    phase_rad: float = 0.0
    duty: float = 0.5

    def __post_init__(self) -> None:
        if not isinstance(self.shape, Shape):
            try:
                object.__setattr__(self, "shape", Shape(self.shape))
            except ValueError:
                known = ", ".join(f"{s.value} {s.name.lower()}" for s in Shape)
                raise WaveformError(f"waveform shape {self.shape!r} is unknown; give one of {known}") from None
        for name in ("amplitude", "offset", "frequency_hz", "phase_rad", "duty"):
            if not math.isfinite(getattr(self, name)):
                raise WaveformError(f"waveform {name} must be a finite number, got {getattr(self, name)}")
        if self.amplitude < 0.0:
            raise WaveformError(f"waveform amplitude must not be negative, got {self.amplitude}; shift the phase by pi")
        if self.shape is not Shape.CONSTANT and self.frequency_hz <= 0.0:
            raise WaveformError(f"waveform frequency must be above 0 Hz, got {self.frequency_hz}")
        if not 0.0 <= self.duty <= 1.0:
            raise WaveformError(f"waveform duty must lie in 0 to 1, got {self.duty}")

    def at(self, cycles: float) -> float:
        """Value at a running phase given in cycles; `phase_rad` is added to it.

        Sine starts at the offset, rising. Square is high (offset + amplitude) for the first `duty` of the
        period, then low. Triangle and sawtooth rise from low to high over the first `duty`; a triangle
        then falls over the rest, a sawtooth drops at once and rests low.
        """
        turn = (cycles + self.phase_rad / TURN_RAD) % 1.0
        shape = self.shape
        if shape is Shape.SINE:
            return self.offset + self.amplitude * math.sin(TURN_RAD * turn)
        if shape is Shape.SQUARE:
            return self.offset + (self.amplitude if turn < self.duty else -self.amplitude)
        if shape is Shape.CONSTANT:
            return self.offset
        if turn < self.duty:
            return self.offset + self.amplitude * (2.0 * turn / self.duty - 1.0)
        if shape is Shape.SAWTOOTH:
            return self.offset - self.amplitude
        return self.offset + self.amplitude * (1.0 - 2.0 * (turn - self.duty) / (1.0 - self.duty))


@dataclass(frozen=True, slots=True)
class WaveformState:
    """Running phase `position / modulus` cycles at the coming sample, exact in whole numbers, and its step."""

    waveform: Waveform
    position: int
    increment: int
    modulus: int


class WaveformGenerator:
    """Plays a waveform sample by sample.

    The phase step is the exact product of the sample time and the frequency as written in decimals, so
    a period of 200 samples stays one of 200 samples for ever. A live change keeps the running phase.
    """

    __slots__ = ("_sample_time", "sample_time_s")

    def __init__(self, sample_time_s: float) -> None:
        if not (math.isfinite(sample_time_s) and sample_time_s > 0.0):
            raise WaveformError(f"sample time must be above 0 s, got {sample_time_s}")
        self.sample_time_s = sample_time_s
        self._sample_time = Fraction(repr(float(sample_time_s)))

    def initial_state(self, waveform: Waveform) -> WaveformState:
        """The state before sample 0, at running phase 0."""
        return self._with_waveform(waveform, Fraction(0))

    def step(self, state: WaveformState, waveform: Waveform | None = None) -> tuple[WaveformState, float]:
        """Value at this sample; a waveform given replaces the one playing from this sample on."""
        if waveform is not None and waveform != state.waveform:
            state = self._with_waveform(waveform, Fraction(state.position, state.modulus))
        value = state.waveform.at(state.position / state.modulus)
        position = (state.position + state.increment) % state.modulus
        return WaveformState(state.waveform, position, state.increment, state.modulus), value

    def _with_waveform(self, waveform: Waveform, cycles: Fraction) -> WaveformState:
        # A constant has no period: the phase waits for the next waveform.
        moving = waveform.shape is not Shape.CONSTANT
        step = self._sample_time * Fraction(repr(float(waveform.frequency_hz))) if moving else Fraction(0)
        modulus = math.lcm(step.denominator, cycles.denominator)
        return WaveformState(
            waveform,
            cycles.numerator * (modulus // cycles.denominator) % modulus,
            step.numerator * (modulus // step.denominator) % modulus,
            modulus,
        )


def waveform_samples(waveform: Waveform, sample_time_s: float, count: int) -> NDArray[np.float64]:
    """The first `count` samples of a waveform, shape (count,), in its unit."""
    generator = WaveformGenerator(sample_time_s)
    state = generator.initial_state(waveform)
    values = np.empty(count)
    for k in range(count):
        state, values[k] = generator.step(state)
    return values
