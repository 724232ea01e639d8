"""Relay auto-tuning: a relay in the controller's place makes a small limit cycle, read off for the ultimate point.

K. J. Astrom and T. Hagglund, Automatic tuning of simple regulators, Automatica 20 (1984) 645-651. Pure: the same
machine runs on a model, on the virtual rig or on the live station.
"""

import math
from dataclasses import dataclass, replace
from enum import Enum
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, model_validator

from .errors import TuningError
from .ziegler_nichols import UltimatePoint

Number = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]


class RelayConfig(BaseModel):
    """The relay: bias and amplitude of its voltage (V), hysteresis and limits of the measured quantity (SI)."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    setpoint: Number
    bias_v: Number
    amplitude_v: Positive
    hysteresis: Annotated[float, Field(ge=0.0, allow_inf_nan=False)] = 0.0
    lowest: Number
    highest: Number
    approach_s: Annotated[float, Field(ge=0.0, allow_inf_nan=False)] = 0.0
    cycles: Annotated[int, Field(ge=1, le=100)] = 6
    skip: Annotated[int, Field(ge=0, le=100)] = 3
    tolerance: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.1
    timeout_s: Positive = 60.0

    @model_validator(mode="after")
    def _fits(self) -> "RelayConfig":
        if not self.lowest < self.setpoint - self.hysteresis <= self.setpoint + self.hysteresis < self.highest:
            raise ValueError("the set-point and its hysteresis must lie between lowest and highest")
        return self


class RelayOutcome(str, Enum):
    """How a relay experiment stands."""

    RUNNING = "running"
    DONE = "done"
    OUT_OF_LIMITS = "out_of_limits"
    TIMED_OUT = "timed_out"


@dataclass(frozen=True, slots=True)
class Cycle:
    """One full swing: its duration (s) and half of peak to peak (SI)."""

    period_s: float
    amplitude: float


@dataclass(frozen=True, slots=True)
class RelayState:
    """`began` is the sample of the last upward switch (None before the first), low and high the swing since."""

    sample: int = 0
    high_on: bool = True
    began: int | None = None
    low: float = math.inf
    high: float = -math.inf
    cycles: tuple[Cycle, ...] = ()
    outcome: RelayOutcome = RelayOutcome.RUNNING


class RelayTuner:
    """Switches the voltage to bias plus amplitude below the set-point, to bias minus amplitude above it.

    Ends when `cycles` swings in a row agree within `tolerance`; whatever the end, the voltage returns to the bias.
    The first `approach_s` are spent at the bias, so that the object is near the set-point when the relay starts.
    """

    __slots__ = ("_config", "_sample_time_s")

    def __init__(self, config: RelayConfig, sample_time_s: float) -> None:
        self._config = config
        self._sample_time_s = sample_time_s

    def initial_state(self) -> RelayState:
        """Before the first sample."""
        return RelayState()

    def step(self, state: RelayState, measurement: float) -> tuple[RelayState, float]:
        """One sample: the voltage (V) to apply."""
        config = self._config
        if state.outcome is not RelayOutcome.RUNNING:
            return state, config.bias_v
        time_s = state.sample * self._sample_time_s
        if not config.lowest <= measurement <= config.highest:  # true for a value that is no number, too
            return replace(state, outcome=RelayOutcome.OUT_OF_LIMITS), config.bias_v
        if time_s >= config.timeout_s:
            return replace(state, outcome=RelayOutcome.TIMED_OUT), config.bias_v
        if time_s < config.approach_s:
            return replace(state, sample=state.sample + 1), config.bias_v
        state = self._switched(
            replace(state, low=min(state.low, measurement), high=max(state.high, measurement)), measurement
        )
        if self._settled(state):
            return replace(state, outcome=RelayOutcome.DONE), config.bias_v
        voltage = config.bias_v + (config.amplitude_v if state.high_on else -config.amplitude_v)
        return replace(state, sample=state.sample + 1), voltage

    def result(self, state: RelayState, error_scale: float) -> UltimatePoint:
        """Ultimate gain (V per error unit) and period (s) of the swings that agreed; TuningError if not done."""
        config = self._config
        if state.outcome is not RelayOutcome.DONE:
            raise TuningError(_SENTENCES[state.outcome])
        chosen = state.cycles[-config.cycles :]
        amplitude = sum(c.amplitude for c in chosen) / len(chosen)
        period = sum(c.period_s for c in chosen) / len(chosen)
        if amplitude <= config.hysteresis:
            raise TuningError("the relay's limit cycle is no larger than its hysteresis; enlarge its amplitude")
        # Describing function of a relay with hysteresis: 4 d / (pi a), its phase taken care of by the root.
        gain = 4.0 * config.amplitude_v / (math.pi * math.sqrt(amplitude**2 - config.hysteresis**2) * error_scale)
        return UltimatePoint(gain, period)

    def _switched(self, state: RelayState, measurement: float) -> RelayState:
        config = self._config
        if state.high_on and measurement > config.setpoint + config.hysteresis:
            return replace(state, high_on=False)
        if state.high_on or measurement >= config.setpoint - config.hysteresis:
            return state
        cycles = state.cycles
        if state.began is not None:
            period = (state.sample - state.began) * self._sample_time_s
            cycles = (*cycles, Cycle(period, (state.high - state.low) / 2.0))
        return replace(state, high_on=True, began=state.sample, cycles=cycles, low=measurement, high=measurement)

    def _settled(self, state: RelayState) -> bool:
        config = self._config
        if len(state.cycles) < config.cycles + config.skip:
            return False
        chosen = state.cycles[-config.cycles :]
        periods, amplitudes = [c.period_s for c in chosen], [c.amplitude for c in chosen]
        # A switch is only known to a sample either way.
        grain = 2.0 * self._sample_time_s
        return max(periods) - min(periods) <= config.tolerance * max(periods) + grain and max(amplitudes) - min(
            amplitudes
        ) <= config.tolerance * max(amplitudes)


_SENTENCES = {
    RelayOutcome.RUNNING: "the relay experiment has not come to its end; let it run on",
    RelayOutcome.OUT_OF_LIMITS: "the measured quantity left the limits during the relay experiment; "
    "lower the relay's amplitude or widen the limits",
    RelayOutcome.TIMED_OUT: "the relay made no steady limit cycle in time; change its bias, enlarge its amplitude "
    "or its time-out",
}
