"""Sequence numbers and stamps read straight from serialized messages, and the losses they show."""

import struct
from collections.abc import Callable
from dataclasses import dataclass

from rosbags.interfaces import Nodetype

from .definitions import fields, typestore

_WORD = {"<": struct.Struct("<I"), ">": struct.Struct(">I")}
_LONG = {"<": struct.Struct("<Q"), ">": struct.Struct(">Q")}
_STAMP = {"<": struct.Struct("<iI"), ">": struct.Struct(">iI")}
_HEADER = (Nodetype.NAME, "std_msgs/msg/Header")
_NUMBER = (Nodetype.BASE, ("uint64", 0))


@dataclass(frozen=True, slots=True)
class Kind:
    """What a message type starts with."""

    stamped: bool
    numbered: bool


def kind_of(msgtype: str, definition: str) -> Kind:
    """Whether messages of a type start with a header, and whether `uint64 sequence` follows it."""
    listed = fields(typestore({msgtype: definition}), msgtype)
    stamped = bool(listed) and listed[0][1] == _HEADER
    numbered = stamped and len(listed) > 1 and listed[1] == ("sequence", _NUMBER)
    return Kind(stamped, numbered)


def _order(data: bytes) -> str:
    return "<" if data[1] & 1 else ">"


def stamp_ns(data: bytes) -> int:
    """Header stamp of a serialized stamped message, ns."""
    seconds, nanoseconds = _STAMP[_order(data)].unpack_from(data, 4)
    return int(seconds * 1_000_000_000 + nanoseconds)


def sequence_number(data: bytes) -> int:
    """Sequence number of a serialized numbered message."""
    order = _order(data)
    (length,) = _WORD[order].unpack_from(data, 12)
    return int(_LONG[order].unpack_from(data, 4 + ((12 + length + 7) & ~7))[0])


def number_reader(kind: Kind) -> Callable[[bytes], int]:
    """Reads a message's sequence number; 0 for types without one."""
    return sequence_number if kind.numbered else lambda data: 0


@dataclass(slots=True)
class SequenceCounter:
    """Messages received on a topic and numbers skipped; a number that does not grow starts a new count."""

    received: int = 0
    lost: int = 0
    first: int = -1
    last: int = -1
    restarts: int = 0

    def add(self, sequence: int) -> None:
        """Count one message."""
        self.received += 1
        if self.first < 0:
            self.first = sequence
        elif sequence > self.last:
            self.lost += sequence - self.last - 1
        else:
            self.restarts += 1
        self.last = sequence
