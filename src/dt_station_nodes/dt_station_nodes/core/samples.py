"""What crosses a border once a sample: the messages' pure counterparts, SI throughout."""

from dataclasses import dataclass
from enum import Enum, IntFlag


class SampleFlag(IntFlag):
    """Flags of a plant sample, bit for bit those of `PlantState.msg`."""

    OK = 0
    LOAD_COMMAND_MISSED = 1
    POSITION_COMMAND_MISSED = 2
    LOAD_VOLTAGE_LIMITED = 4
    SERVO_VOLTAGE_LIMITED = 8
    SENSOR_FAULT = 16
    OVERRUN = 32
    END = 64


class ControlMode(int, Enum):
    """Who computes a valve command, number for number as in `ValveCommand.msg`."""

    MANUAL = 0
    PI = 1
    PID = 2
    FUZZY = 3


@dataclass(frozen=True, slots=True)
class PlantSample:
    """One sample of the object; the voltages are those applied from the sample before until this one."""

    sequence: int
    stamp_ns: int
    position_m: float
    pressure_pa: float
    load_voltage_v: float
    servo_voltage_v: float
    flags: SampleFlag = SampleFlag.OK


@dataclass(frozen=True, slots=True)
class Setpoint:
    """A set-point of one channel (Pa or m); streaming ones belong to the sample they number."""

    sequence: int
    stamp_ns: int
    value: float
    streaming: bool


@dataclass(frozen=True, slots=True)
class ValveCommand:
    """A controller's answer (V) to the sample it numbers."""

    sequence: int
    stamp_ns: int
    voltage_v: float
    setpoint: float
    mode: ControlMode
    limited: bool
