"""Fuzzy law: a surface of error and load pressure, with an optional integrating term."""

from math import inf, isfinite, nan
from typing import NamedTuple

from .fuzzy_config import FuzzyConfig
from .fuzzy_surface import surface
from .pid import SLOW
from .signals import ControlInput


class FuzzyMemory(NamedTuple):
    """Integral part for the next sample (V) and the last error (unit of the error variable; None before the first)."""

    integral_v: float = 0.0
    error: float | None = None


class FuzzyLaw:
    """u_n = output_gain F(error_gain (x_n + lead dx/dt), load_gain p_n) + integral."""

    __slots__ = (
        "_at",
        "_band",
        "_error_gain",
        "_error_scale",
        "_holds",
        "_i_step",
        "_lead",
        "_load_gain",
        "_load_scale",
        "_output_gain",
        "_pull",
    )

    def __init__(self, config: FuzzyConfig, sample_time_s: float, transfer_time_s: float) -> None:
        self._at = surface(config).at
        self._error_scale, self._load_scale = config.error_scale, config.load_scale
        self._error_gain, self._load_gain, self._output_gain = config.error_gain, config.load_gain, config.output_gain
        self._lead = config.error_lead_s / sample_time_s
        self._i_step = config.integral_gain * sample_time_s
        self._band = inf if config.integral_band is None else config.integral_band
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
        setpoint, measurement, load_pressure_pa = given
        error = (setpoint - measurement) * self._error_scale
        load = load_pressure_pa * self._load_scale
        if not (isfinite(error) and isfinite(load)):
            return memory, nan
        integral, before = memory
        led = error if before is None else error + self._lead * (error - before)
        voltage = self._static(led, load) + integral
        if -self._band <= error <= self._band:
            integral += self._i_step * error
        return FuzzyMemory(integral, error), voltage

    def cut(self, memory: FuzzyMemory, excess_v: float) -> FuzzyMemory:
        """Back-calculation of the integrating term."""
        return memory._replace(integral_v=memory.integral_v + self._pull * excess_v)

    def take_over(self, voltage_v: float, last: ControlInput, kept: object) -> tuple[FuzzyMemory, float]:
        """A working integrating term takes on what the surface lacks of the voltage; else the rest is left over."""
        error = (last.setpoint - last.measurement) * self._error_scale
        lacking = voltage_v - self._static(error, last.load_pressure_pa * self._load_scale)
        if self._holds:
            return FuzzyMemory(lacking, error), 0.0
        integral = kept.integral_v if isinstance(kept, FuzzyMemory) and self._i_step else 0.0
        return FuzzyMemory(integral, error), lacking - integral

    def _static(self, error: float, load: float) -> float:
        return self._output_gain * self._at(self._error_gain * error, self._load_gain * load)
