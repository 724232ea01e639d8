"""Fuzzy law: a surface of error and load pressure, with an optional integrating term."""

import math
from dataclasses import dataclass, replace

from .fuzzy_config import FuzzyConfig
from .fuzzy_surface import surface
from .pid import SLOW
from .signals import ControlInput


@dataclass(frozen=True, slots=True)
class FuzzyMemory:
    """Integral part for the next sample (V) and the last error (unit of the error variable; None before the first)."""

    integral_v: float = 0.0
    error: float | None = None


class FuzzyLaw:
    """u_n = output_gain F(error_gain (x_n + lead dx/dt), load_gain p_n) + integral."""

    __slots__ = ("_band", "_config", "_holds", "_i_step", "_lead", "_pull", "_surface")

    def __init__(self, config: FuzzyConfig, sample_time_s: float, transfer_time_s: float) -> None:
        self._config = config
        self._surface = surface(config)
        self._lead = config.error_lead_s / sample_time_s
        self._i_step = config.integral_gain * sample_time_s
        self._band = math.inf if config.integral_band is None else config.integral_band
        self._pull = min(1.0, sample_time_s / config.tracking_time_s) if self._i_step else 0.0
        # The slope at no error stands where a PID has P.
        width = (config.error.range[1] - config.error.range[0]) / (config.grid[0] - 1) / config.error_gain
        rise = self._static(width, 0.0) - self._static(-width, 0.0)
        self._holds = config.integral_gain > 0.0 and rise / (2 * width) <= config.integral_gain * SLOW * transfer_time_s

    def initial(self) -> FuzzyMemory:
        """At rest."""
        return FuzzyMemory()

    def step(self, memory: FuzzyMemory, given: ControlInput) -> tuple[FuzzyMemory, float]:
        """One sample."""
        config = self._config
        error = (given.setpoint - given.measurement) * config.error_scale
        load = given.load_pressure_pa * config.load_scale
        if not (math.isfinite(error) and math.isfinite(load)):
            return memory, math.nan
        led = error if memory.error is None else error + self._lead * (error - memory.error)
        voltage = self._static(led, load) + memory.integral_v
        integral = memory.integral_v
        if -self._band <= error <= self._band:
            integral += self._i_step * error
        return FuzzyMemory(integral, error), voltage

    def cut(self, memory: FuzzyMemory, excess_v: float) -> FuzzyMemory:
        """Back-calculation of the integrating term."""
        return replace(memory, integral_v=memory.integral_v + self._pull * excess_v)

    def take_over(self, voltage_v: float, last: ControlInput, kept: object) -> tuple[FuzzyMemory, float]:
        """A working integrating term takes on what the surface lacks of the voltage; else the rest is left over."""
        error = (last.setpoint - last.measurement) * self._config.error_scale
        lacking = voltage_v - self._static(error, last.load_pressure_pa * self._config.load_scale)
        if self._holds:
            return FuzzyMemory(lacking, error), 0.0
        integral = kept.integral_v if isinstance(kept, FuzzyMemory) and self._i_step else 0.0
        return FuzzyMemory(integral, error), lacking - integral

    def _static(self, error: float, load: float) -> float:
        config = self._config
        return config.output_gain * self._surface.at(config.error_gain * error, config.load_gain * load)
