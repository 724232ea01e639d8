"""Messages by the block: many serialized messages in one buffer, cut into rows without a loop over them."""

import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .cdr import Bytes

Index = NDArray[np.int64]
_HEAD = np.dtype(
    [("op", "u1"), ("length", "<u8"), ("channel", "<u2"), ("sequence", "<u4"), ("log", "<u8"), ("publish", "<u8")]
)
_RECORD_HEAD = struct.Struct("<BQ")
_MESSAGE = 5
_HEAD_SIZE = _HEAD.itemsize


class BlockError(ValueError):
    """The records of a block contradict each other."""


@dataclass(frozen=True)
class Block:
    """Messages in writing order: payload i is data[offset[i] : offset[i] + length[i]]. Times in ns."""

    data: Bytes
    offset: Index
    length: Index
    channel: Index
    sequence: Index
    log_time: Index
    publish_time: Index

    def __len__(self) -> int:
        return len(self.offset)

    def pick(self, chosen: NDArray[np.bool_] | NDArray[np.intp]) -> "Block":
        """The chosen messages."""
        return Block(
            self.data, self.offset[chosen], self.length[chosen], self.channel[chosen], self.sequence[chosen],
            self.log_time[chosen], self.publish_time[chosen],
        )  # fmt: skip

    def payload(self, i: int) -> bytes:
        """Serialized message i."""
        return self.data[self.offset[i] : self.offset[i] + self.length[i]].tobytes()

    def rows(self) -> Iterator[tuple[NDArray[np.intp], Bytes]]:
        """(positions, payloads of shape (n, size)) for each size among the messages."""
        sizes = np.unique(self.length)
        for size in sizes.tolist():
            where = np.arange(len(self)) if len(sizes) == 1 else np.flatnonzero(self.length == size)
            if size == 0:
                yield where, np.empty((len(where), 0), np.uint8)
            else:
                windows = np.lib.stride_tricks.sliding_window_view(self.data, size)
                yield where, windows[self.offset[where]]


def walk(data: bytes) -> Index:
    """Offsets of the message records in a chunk's bytes, found one by one."""
    found, position, end = [], 0, len(data)
    while position < end:
        if position + 9 > end:
            raise BlockError("a record ends early")
        opcode, length = _RECORD_HEAD.unpack_from(data, position)
        if opcode == _MESSAGE:
            found.append(position)
        position += 9 + length
    if position != end:
        raise BlockError("a record ends early")
    return np.array(found, dtype=np.int64)


def block_of(data: bytes, starts: Index) -> Block:
    """The block of a chunk's bytes whose message records start at `starts`.

    Raises BlockError unless these and the definitions between them are all that the bytes hold.
    """
    buffer = np.frombuffer(data, np.uint8)
    if not len(starts):
        walk(data)
        empty = np.empty(0, np.int64)
        return Block(buffer, empty, empty, empty, empty, empty, empty)
    starts = np.sort(starts)
    if starts[0] < 0 or starts[-1] + _HEAD_SIZE > len(buffer):
        raise BlockError("a message lies outside its chunk")
    heads = np.lib.stride_tricks.sliding_window_view(buffer, _HEAD_SIZE)[starts].view(_HEAD)[:, 0]
    length = heads["length"].astype(np.int64)
    ends = starts + 9 + length
    if (heads["op"] != _MESSAGE).any() or (length < _HEAD_SIZE - 9).any() or (length > len(buffer)).any():
        raise BlockError("the index points at something that is no message")
    gaps = np.flatnonzero(np.r_[starts, len(buffer)] != np.r_[0, ends])
    for gap in gaps.tolist():
        left = int(ends[gap - 1]) if gap else 0
        right = int(starts[gap]) if gap < len(starts) else len(buffer)
        if right < left or len(walk(data[left:right])):
            raise BlockError("the index misses messages")
    return Block(
        buffer,
        starts + _HEAD_SIZE,
        length - (_HEAD_SIZE - 9),
        heads["channel"].astype(np.int64),
        heads["sequence"].astype(np.int64),
        heads["log"].astype(np.int64),
        heads["publish"].astype(np.int64),
    )


def block_from_messages(messages: Sequence[tuple[int, int, bytes]]) -> Block:
    """A block of (channel, log time, payload) tuples."""
    length = np.array([len(payload) for _, _, payload in messages], dtype=np.int64)
    log = np.array([time for _, time, _ in messages], dtype=np.int64)
    channel = np.array([number for number, _, _ in messages], dtype=np.int64)
    data = np.frombuffer(b"".join(payload for _, _, payload in messages), np.uint8)
    offset = np.cumsum(length) - length
    return Block(data, offset, length, channel, np.zeros_like(log), log, log)
