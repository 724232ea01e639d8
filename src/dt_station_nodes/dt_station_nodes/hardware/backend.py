"""The one door to an object: real card, virtual rig, recorded data."""

from dataclasses import dataclass
from typing import Protocol

from ..core.samples import SampleFlag


@dataclass(frozen=True, slots=True)
class Reading:
    """What the sensors say now (SI). `ended` marks the last one a finite source has."""

    position_m: float
    pressure_pa: float
    flags: SampleFlag = SampleFlag.OK
    ended: bool = False


@dataclass(frozen=True, slots=True)
class Applied:
    """The voltages the object really gets from now on, after range and quantisation (V)."""

    load_voltage_v: float
    servo_voltage_v: float
    flags: SampleFlag = SampleFlag.OK


class Backend(Protocol):
    """An object that is read and written once a sample, in this order: read(k), write for k, read(k+1)...

    `write` holds the voltages for one sample time; the next `read` returns the object that much later.
    A source of recorded data ignores the voltages asked for and returns those that were applied.
    """

    @property
    def sample_time_s(self) -> float:
        """Time between two reads, s."""
        ...

    def open(self) -> None:
        """Take hold of the object; raises OSError with a sentence that says what to do."""
        ...

    def read(self) -> Reading:
        """The sensors' values at this sample."""
        ...

    def write(self, load_voltage_v: float, servo_voltage_v: float) -> Applied:
        """Apply voltages (V) from this sample until the next."""
        ...

    def close(self) -> None:
        """Bring the object to rest and let go of it; safe to call twice."""
        ...
