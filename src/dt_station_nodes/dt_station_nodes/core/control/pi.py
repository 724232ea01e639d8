"""PI in difference form, the paper's equation (2), with set-point weight and anti-windup."""

from typing import NamedTuple

from .config import AntiWindup, PiConfig
from .signals import ControlInput


class PiMemory(NamedTuple):
    """x_(n-1) plain and with the set-point weighted (error units), and y_(n-1) (V)."""

    error: float = 0.0
    weighted: float = 0.0
    voltage_v: float = 0.0


class PiLaw:
    """y_n = a x_n - b x_(n-1) + y_(n-1)."""

    __slots__ = ("_a", "_b", "_clamps", "_increment", "_pull", "_scale", "_weight")

    def __init__(self, config: PiConfig, sample_time_s: float) -> None:
        self._a, self._b = config.coefficients(sample_time_s)
        self._increment = self._a - self._b
        self._scale = config.error_scale
        self._weight = config.setpoint_weight
        self._clamps = config.anti_windup is AntiWindup.CLAMPING
        tracking = config.tracking_time_s or config.integral_time_s
        pulls = config.anti_windup is AntiWindup.BACK_CALCULATION
        self._pull = min(1.0, sample_time_s / tracking) if pulls else 0.0

    def initial(self) -> PiMemory:
        """At rest: no error, no voltage."""
        return PiMemory()

    def step(self, memory: PiMemory, given: ControlInput) -> tuple[PiMemory, float]:
        """One sample. The last term is 0 unless the set-point is weighted, which only the proportional part sees."""
        error = (given.setpoint - given.measurement) * self._scale
        weighted = (self._weight * given.setpoint - given.measurement) * self._scale
        voltage = (
            self._a * weighted
            - self._b * memory.weighted
            + memory.voltage_v
            + self._increment * (memory.error - memory.weighted)
        )
        return PiMemory(error, weighted, voltage), voltage

    def cut(self, memory: PiMemory, excess_v: float) -> PiMemory:
        """Draw y_(n-1) back by a share of the excess, or take away the integral's coming increment."""
        if self._clamps:
            coming = self._increment * memory.error
            return memory._replace(voltage_v=memory.voltage_v - coming) if coming * excess_v < 0.0 else memory
        return memory._replace(voltage_v=memory.voltage_v + self._pull * excess_v)

    def take_over(self, voltage_v: float, last: ControlInput, kept: object) -> tuple[PiMemory, float]:
        """The running voltage becomes y_(n-1): the integral holds it, nothing is left over."""
        error = (last.setpoint - last.measurement) * self._scale
        weighted = (self._weight * last.setpoint - last.measurement) * self._scale
        return PiMemory(error, weighted, voltage_v), 0.0
