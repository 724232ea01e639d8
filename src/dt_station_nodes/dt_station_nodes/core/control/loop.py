"""A control loop: one law at a time, limits, anti-windup and bumpless change between laws."""

import math
from typing import Any, NamedTuple

from ..samples import ControlMode
from .config import LoopConfig, check_sample_time
from .fuzzy import FuzzyLaw
from .fuzzy_surface import surface
from .law import Law
from .manual import ManualLaw
from .pi import PiLaw
from .pid import PidLaw
from .signals import ControlInput, ControlOutput

# Below this share of a volt a dying offset is dropped, so that a quiet loop is exactly its law again.
NEGLIGIBLE_V = 1e-9


class LoopState(NamedTuple):
    """The law's memory, the voltage of the last sample and the offset left of a bumpless change (V)."""

    memory: Any
    voltage_v: float = 0.0
    offset_v: float = 0.0


class LoopController:
    """A `LoopConfig` at one sample time; with all extras off its output is the law's, bit for bit."""

    __slots__ = ("_decay", "_law", "_lower", "_mode", "_rate", "_upper", "config", "sample_time_s")

    def __init__(self, config: LoopConfig, sample_time_s: float) -> None:
        check_sample_time(sample_time_s)
        self.config = config
        self.sample_time_s = sample_time_s
        limits = config.limits
        self._lower = -math.inf if limits.lower_v is None else limits.lower_v
        self._upper = math.inf if limits.upper_v is None else limits.upper_v
        self._rate = math.inf if limits.rate_v_per_s is None else limits.rate_v_per_s * sample_time_s
        self._mode = config.mode
        self._decay = math.exp(-sample_time_s / config.transfer_time_s)
        if config.fuzzy is not None:
            # Now, so that a live switch to fuzzy finds its surface ready.
            surface(config.fuzzy)
        self._law = _law(config, sample_time_s)

    def initial_state(self) -> LoopState:
        """At rest; also the reset."""
        return LoopState(self._law.initial())

    def step(self, state: LoopState, given: ControlInput) -> tuple[LoopState, ControlOutput]:
        """One sample: the voltage to apply. A value that is no number holds the last voltage."""
        memory, wanted = self._law.step(state.memory, given)
        if not math.isfinite(wanted):
            return state, ControlOutput(state.voltage_v, True, self._mode)
        offset = state.offset_v
        if offset != 0.0:
            wanted += offset
            offset *= self._decay
            if -NEGLIGIBLE_V < offset < NEGLIGIBLE_V:
                offset = 0.0
        applied = wanted
        last, rate = state.voltage_v, self._rate
        if applied > last + rate:
            applied = last + rate
        elif applied < last - rate:
            applied = last - rate
        if applied > self._upper:
            applied = self._upper
        elif applied < self._lower:
            applied = self._lower
        limited = applied != wanted
        if limited:
            memory = self._law.cut(memory, applied - wanted)
        return LoopState(memory, applied, offset), ControlOutput(applied, limited, self._mode)

    def reconfigured(
        self, config: LoopConfig, state: LoopState, last: ControlInput
    ) -> tuple["LoopController", LoopState]:
        """Another configuration, going on at the running voltage.

        Were the input to stay as it was last, the voltage would stay too but for the integral's own step;
        what no integral can take over dies out with the new `transfer_time_s`. A change of the voltage
        within manual mode is a command and acts at once.
        """
        changed = LoopController(config, self.sample_time_s)
        if config == self.config:
            return changed, state
        if config.mode is ControlMode.MANUAL and self.config.mode is ControlMode.MANUAL:
            return changed, LoopState(state.memory, state.voltage_v)
        seen = last if config.mode is ControlMode.FUZZY else last[:2]
        if all(map(math.isfinite, seen)):
            memory, offset = changed._law.take_over(state.voltage_v, last, state.memory)
        else:
            memory, offset = changed._law.initial(), 0.0
        return changed, LoopState(memory, state.voltage_v, offset)


def _law(config: LoopConfig, sample_time_s: float) -> Law[Any]:
    if config.mode is ControlMode.PI and config.pi is not None:
        return PiLaw(config.pi, sample_time_s)
    if config.mode is ControlMode.PID and config.pid is not None:
        return PidLaw(config.pid, sample_time_s, config.transfer_time_s)
    if config.mode is ControlMode.FUZZY and config.fuzzy is not None:
        return FuzzyLaw(config.fuzzy, sample_time_s, config.transfer_time_s)
    return ManualLaw(config.manual_voltage_v)
