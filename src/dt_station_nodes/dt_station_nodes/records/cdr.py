"""Serialized messages (CDR) to numpy structured arrays, many at a time, without deserialising one by one.

A message's byte layout depends on its type and on the lengths of its strings and sequences only. The
layout of one message therefore decodes every message of the same size whose length words agree.
CDR: OMG Common Data Representation, PLAIN_CDR of DDSI-RTPS 10.5.
"""

import struct
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces import Nodetype
from rosbags.typesys.store import Typestore

from .definitions import fields
from .errors import RecordError

Bytes = NDArray[np.uint8]
_CODES = {
    "bool": "u1", "byte": "u1", "char": "u1", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2",
    "int32": "i4", "uint32": "u4", "int64": "i8", "uint64": "u8", "float32": "f4", "float64": "f8",
}  # fmt: skip
_HEADER = 4
_PADDING = 3
_MAX_FIELDS = 4096


@dataclass(frozen=True)
class Layout:
    """Where each field of a message lies; `guards` are (offset, value) of the length words it rests on."""

    size: int
    order: str
    names: tuple[str, ...]
    formats: tuple[str, ...]
    offsets: tuple[int, ...]
    guards: tuple[tuple[int, int], ...]

    @cached_property
    def dtype(self) -> np.dtype[np.void]:
        """Structured type of one message, encapsulation header and padding included."""
        return np.dtype(
            {
                "names": list(self.names),
                "formats": list(self.formats),
                "offsets": list(self.offsets),
                "itemsize": self.size,
            }
        )

    def fits(self, rows: Bytes) -> NDArray[np.bool_]:
        """Which of the messages `rows`, shape (n, size), have this layout."""
        good = rows[:, 1] == (1 if self.order == "<" else 0)
        good &= rows[:, 0] == 0
        for offset, value in self.guards:
            words = np.ascontiguousarray(rows[:, offset : offset + 4]).view(self.order + "u4")[:, 0]
            good &= words == value
        return np.asarray(good)

    def view(self, rows: Bytes) -> NDArray[np.void]:
        """The messages `rows`, shape (n, size), as a structured array of shape (n,)."""
        return np.ascontiguousarray(rows).view(self.dtype)[:, 0]


class _Walker:
    def __init__(self, store: Typestore, message: bytes, order: str) -> None:
        self.store, self.message, self.order = store, message, order
        self.position = 0
        self.names: list[str] = []
        self.formats: list[str] = []
        self.offsets: list[int] = []
        self.guards: list[tuple[int, int]] = []

    def align(self, size: int) -> None:
        self.position = -(-self.position // size) * size

    def add(self, name: str, code: str, size: int) -> None:
        self.names.append(name)
        self.formats.append(code)
        self.offsets.append(self.position + _HEADER)
        self.position += size
        if self.position + _HEADER > len(self.message) or len(self.names) > _MAX_FIELDS:
            raise ValueError("message ends early")

    def length(self) -> int:
        self.align(4)
        (value,) = struct.unpack_from(self.order + "I", self.message, self.position + _HEADER)
        self.guards.append((self.position + _HEADER, value))
        self.position += 4
        if self.position + _HEADER + value > len(self.message):
            raise ValueError("length beyond the message")
        return int(value)

    def scalar(self, name: str, kind: str) -> None:
        if kind == "string":
            size = self.length()
            self.add(name, f"S{size}", size)
        elif kind in _CODES:
            code = _CODES[kind]
            size = int(code[1])
            self.align(size)
            self.add(name, (self.order if size > 1 else "|") + code, size)
        else:
            raise ValueError(f"a field of kind {kind}")

    def many(self, name: str, desc: tuple[Nodetype, object], count: int) -> None:
        kind, what = desc
        if kind is Nodetype.BASE and what[0] in _CODES:  # type: ignore[index]
            code = _CODES[what[0]]  # type: ignore[index]
            size = int(code[1])
            if count:
                self.align(size)
                self.add(name, f"({count},){self.order if size > 1 else '|'}{code}", size * count)
            return
        for i in range(count):
            self.field(f"{name}[{i}]", desc)

    def field(self, name: str, desc: tuple[Nodetype, object]) -> None:
        kind, what = desc
        if kind is Nodetype.BASE:
            self.scalar(name, what[0])  # type: ignore[index]
        elif kind is Nodetype.NAME:
            self.message_type(str(what), name + ".")
        elif kind is Nodetype.ARRAY:
            self.many(name, what[0], what[1])  # type: ignore[index]
        else:
            self.many(name, what[0], self.length())  # type: ignore[index]

    def message_type(self, msgtype: str, prefix: str) -> None:
        for name, desc in fields(self.store, msgtype):
            self.field(prefix + name, desc)


def layout_of(store: Typestore, msgtype: str, message: bytes) -> Layout:
    """The layout of one serialized message; raises RecordError where it does not fit its definition."""
    if len(message) < _HEADER or message[0] != 0 or message[1] not in (0, 1):
        raise RecordError(f"a message of type {msgtype} is not serialized as plain CDR")
    order = "<" if message[1] == 1 else ">"
    walker = _Walker(store, message, order)
    try:
        walker.message_type(msgtype, "")
        spare = len(message) - _HEADER - walker.position
        if not 0 <= spare <= _PADDING:
            raise ValueError("bytes left over")
    except (ValueError, struct.error):
        raise RecordError(
            f"a message of {len(message)} bytes does not fit the definition of {msgtype}; "
            "the bag was written with another one"
        ) from None
    return Layout(
        len(message), order, tuple(walker.names), tuple(walker.formats), tuple(walker.offsets), tuple(walker.guards)
    )


class Decoder:
    """Decodes messages of one type; remembers the layouts it has met."""

    def __init__(self, store: Typestore, msgtype: str) -> None:
        self._store, self._msgtype = store, msgtype
        self._layouts: dict[int, list[Layout]] = {}

    def decode(self, rows: Bytes) -> list[tuple[NDArray[np.intp], NDArray[np.void]]]:
        """Messages `rows`, shape (n, size), as (positions, structured array) for each layout among them."""
        left = np.arange(len(rows))
        parts = []
        for layout in self._layouts.setdefault(rows.shape[1], []):
            good = layout.fits(rows[left] if len(left) < len(rows) else rows)
            if good.all():
                parts.append((left, layout.view(rows[left] if len(left) < len(rows) else rows)))
                return parts
            if good.any():
                parts.append((left[good], layout.view(rows[left[good]])))
                left = left[~good]
        while len(left):
            layout = layout_of(self._store, self._msgtype, rows[left[0]].tobytes())
            self._remember(layout)
            good = layout.fits(rows[left])
            parts.append((left[good], layout.view(rows[left[good]])))
            left = left[~good]
        return parts

    def one(self, message: bytes) -> np.void:
        """A single message as a structured scalar."""
        ((_, table),) = self.decode(np.frombuffer(message, np.uint8)[np.newaxis])
        return table[0]

    def _remember(self, layout: Layout) -> None:
        known = self._layouts.setdefault(layout.size, [])
        known.append(layout)
        if len(known) > 8:
            known.pop(0)
