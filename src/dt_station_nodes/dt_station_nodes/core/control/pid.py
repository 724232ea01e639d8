"""PID in the paper's form (7), with derivative filter, set-point weights and anti-windup."""

from typing import NamedTuple

from .config import AntiWindup, PidConfig
from .signals import ControlInput

# An integral slower than this many transfer times would keep a bump practically for ever.
SLOW = 10.0


class PidMemory(NamedTuple):
    """Integral part for the next sample (V), its last increment (V), derivative part (V) and its last input."""

    integral_v: float = 0.0
    increment_v: float = 0.0
    derivative_v: float = 0.0
    slope_error: float = 0.0


class PidLaw:
    """u_n = P x_n + sum of I Ts x_k over k < n + D (x_n - x_(n-1))/Ts."""

    __slots__ = ("_clamps", "_config", "_decay", "_holds", "_i_step", "_p", "_pull", "_scale", "_slope")

    def __init__(self, config: PidConfig, sample_time_s: float, transfer_time_s: float) -> None:
        self._config = config
        self._p = config.p
        self._scale = config.error_scale
        self._i_step = config.i * sample_time_s
        # Backward difference through a lag; with no lag exactly D/Ts times the difference.
        self._decay = config.derivative_filter_s / (config.derivative_filter_s + sample_time_s)
        self._slope = config.d / (config.derivative_filter_s + sample_time_s)
        self._clamps = config.anti_windup is AntiWindup.CLAMPING
        pulls = config.anti_windup is AntiWindup.BACK_CALCULATION and config.i != 0.0
        self._pull = min(1.0, sample_time_s / config.tracking_time_s) if pulls else 0.0
        self._holds = config.i > 0.0 and abs(config.p) <= config.i * SLOW * transfer_time_s

    def initial(self) -> PidMemory:
        """At rest."""
        return PidMemory()

    def step(self, memory: PidMemory, given: ControlInput) -> tuple[PidMemory, float]:
        """One sample."""
        config, setpoint, measurement = self._config, given.setpoint, given.measurement
        weighted = (config.setpoint_weight * setpoint - measurement) * self._scale
        slope_error = (config.derivative_setpoint_weight * setpoint - measurement) * self._scale
        derivative = self._decay * memory.derivative_v + self._slope * (slope_error - memory.slope_error)
        voltage = self._p * weighted + memory.integral_v + derivative
        increment = self._i_step * ((setpoint - measurement) * self._scale)
        return PidMemory(memory.integral_v + increment, increment, derivative, slope_error), voltage

    def cut(self, memory: PidMemory, excess_v: float) -> PidMemory:
        """Draw the integral back by a share of the excess, or take away its last increment."""
        if self._clamps:
            if memory.increment_v * excess_v >= 0.0:
                return memory
            return memory._replace(integral_v=memory.integral_v - memory.increment_v, increment_v=0.0)
        return memory._replace(integral_v=memory.integral_v + self._pull * excess_v)

    def take_over(self, voltage_v: float, last: ControlInput, kept: object) -> tuple[PidMemory, float]:
        """A working integral takes on what the other parts lack of the voltage; else the rest is left over."""
        config = self._config
        weighted = (config.setpoint_weight * last.setpoint - last.measurement) * self._scale
        slope_error = (config.derivative_setpoint_weight * last.setpoint - last.measurement) * self._scale
        lacking = voltage_v - self._p * weighted
        if self._holds:
            return PidMemory(integral_v=lacking, slope_error=slope_error), 0.0
        integral = kept.integral_v if isinstance(kept, PidMemory) else 0.0
        return PidMemory(integral_v=integral, slope_error=slope_error), lacking - integral
