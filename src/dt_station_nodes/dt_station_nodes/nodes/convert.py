"""Messages as bytes to and from their pure counterparts, without message objects on the way.

The fields after the header have a fixed layout, so one `struct` each does (CDR, OMG DDSI-RTPS 10.2):
4 bytes of encapsulation, stamp (s, ns), frame_id (length, text with a closing zero), then the fields,
the first of them aligned to 8 bytes from the end of the encapsulation.
"""

import struct
from dataclasses import dataclass
from typing import Generic, TypeVar

from ..core.errors import StationError
from ..core.samples import ControlMode, PlantSample, SampleFlag, Setpoint, ValveCommand

NANO = 1_000_000_000
_ENCAPSULATION = 4
_FRAME_AT = 16
T = TypeVar("T")


class WireError(StationError):
    """Bytes that are not the message they were said to be."""


@dataclass(frozen=True, slots=True)
class ResidualSample:
    """Residual.msg in SI: measured minus simulated, and the running figures."""

    sequence: int
    stamp_ns: int
    position: tuple[float, float, float, float]
    pressure: tuple[float, float, float, float]


class Wire(Generic[T]):
    """Writes and reads one message type. `frame_id` is left empty in what we write and skipped in what we read."""

    __slots__ = ("_big", "_little", "_name", "_write")

    def __init__(self, name: str, fields: str) -> None:
        self._name = name
        self._little = struct.Struct("<" + fields)
        self._big = struct.Struct(">" + fields)
        self._write = struct.Struct("<4siIIB3x" + fields)

    def pack(self, stamp_ns: int, *fields: float) -> bytes:
        """The message with these fields, as bytes."""
        seconds, nanoseconds = divmod(stamp_ns, NANO)
        return self._write.pack(b"\0\1\0\0", seconds, nanoseconds, 1, 0, *fields)

    def unpack(self, data: bytes) -> tuple[int, tuple[float, ...]]:
        """Stamp (ns) and fields of a message. Raises WireError."""
        try:
            little = data[1] & 1
            seconds, nanoseconds, length = struct.unpack_from("<iII" if little else ">iII", data, _ENCAPSULATION)
            fields = (self._little if little else self._big).unpack_from(
                data, _ENCAPSULATION + ((_FRAME_AT - _ENCAPSULATION + length + 7) & ~7)
            )
        except (struct.error, IndexError):
            raise WireError(f"{len(data)} bytes are too few for a {self._name}") from None
        return seconds * NANO + nanoseconds, fields


_STATE: Wire[PlantSample] = Wire("PlantState", "QddddII")
_SETPOINT: Wire[Setpoint] = Wire("Setpoint", "QdB")
_COMMAND: Wire[ValveCommand] = Wire("ValveCommand", "QddBB")
_RESIDUAL: Wire[ResidualSample] = Wire("Residual", "Q8d")
_NUMBER: Wire[int] = Wire("numbered message", "Q")


def state_to_bytes(sample: PlantSample) -> bytes:
    """PlantState of a sample."""
    return _STATE.pack(
        sample.stamp_ns,
        sample.sequence,
        sample.position_m,
        sample.pressure_pa,
        sample.load_voltage_v,
        sample.servo_voltage_v,
        int(sample.flags),
        0,
    )


def state_from_bytes(data: bytes) -> PlantSample:
    """The sample of a PlantState."""
    stamp_ns, (sequence, position, pressure, load, servo, flags, _) = _STATE.unpack(data)
    return PlantSample(int(sequence), stamp_ns, position, pressure, load, servo, SampleFlag(int(flags)))


def setpoint_to_bytes(setpoint: Setpoint) -> bytes:
    """Setpoint message of a set-point."""
    return _SETPOINT.pack(setpoint.stamp_ns, setpoint.sequence, setpoint.value, setpoint.streaming)


def setpoint_from_bytes(data: bytes) -> Setpoint:
    """The set-point of a Setpoint message."""
    stamp_ns, (sequence, value, streaming) = _SETPOINT.unpack(data)
    return Setpoint(int(sequence), stamp_ns, value, bool(streaming))


def command_to_bytes(command: ValveCommand) -> bytes:
    """ValveCommand message of a command."""
    return _COMMAND.pack(
        command.stamp_ns, command.sequence, command.voltage_v, command.setpoint, int(command.mode), command.limited
    )


def command_from_bytes(data: bytes) -> ValveCommand:
    """The command of a ValveCommand message."""
    stamp_ns, (sequence, voltage, setpoint, mode, limited) = _COMMAND.unpack(data)
    known = ControlMode(int(mode)) if mode <= ControlMode.FUZZY.value else ControlMode.MANUAL
    return ValveCommand(int(sequence), stamp_ns, voltage, setpoint, known, bool(limited))


def sequence_of(data: bytes) -> int:
    """The sequence number of any of the station's numbered messages: their first field."""
    _, (sequence,) = _NUMBER.unpack(data)
    return int(sequence)


def residual_to_bytes(residual: ResidualSample) -> bytes:
    """Residual message; each channel's tuple is residual, ISE, windowed RMS, fit percent."""
    return _RESIDUAL.pack(residual.stamp_ns, residual.sequence, *residual.position, *residual.pressure)


def residual_from_bytes(data: bytes) -> ResidualSample:
    """The figures of a Residual message."""
    stamp_ns, fields = _RESIDUAL.unpack(data)
    return ResidualSample(
        int(fields[0]),
        stamp_ns,
        (fields[1], fields[2], fields[3], fields[4]),
        (*fields[5:9],),  # type: ignore[arg-type]
    )
