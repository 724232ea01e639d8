"""The two channels of the station and their units."""

from enum import Enum


class Channel(str, Enum):
    """A controlled quantity of the object: one valve, one sensor, one set-point."""

    PRESSURE = "pressure"
    POSITION = "position"

    @property
    def unit(self) -> str:
        """SI unit of the measured quantity."""
        return "Pa" if self is Channel.PRESSURE else "m"

    @property
    def signal(self) -> str:
        """Column of the measured quantity in a run table."""
        return "pressure_pa" if self is Channel.PRESSURE else "position_m"

    @property
    def voltage_signal(self) -> str:
        """Column of the applied valve voltage in a run table."""
        return "load_voltage_v" if self is Channel.PRESSURE else "servo_voltage_v"

    @property
    def setpoint_signal(self) -> str:
        """Column of the set-point in a run table."""
        return "pressure_setpoint_pa" if self is Channel.PRESSURE else "position_setpoint_m"
