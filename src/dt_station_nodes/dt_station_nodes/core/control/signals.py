"""What a controller sees and says at one sample."""

from typing import NamedTuple

from ..samples import ControlMode


class ControlInput(NamedTuple):
    """Set-point and measurement of the controlled quantity (Pa or m) and the load pressure (Pa)."""

    setpoint: float
    measurement: float
    load_pressure_pa: float = 0.0


class ControlOutput(NamedTuple):
    """The voltage to apply (V), whether a limit cut it, and who computed it."""

    voltage_v: float
    limited: bool
    mode: ControlMode
