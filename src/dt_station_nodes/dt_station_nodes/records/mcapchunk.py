"""An MCAP chunk being filled, and the records it becomes."""

import struct
import zlib
from collections.abc import Sequence

import zstandard
from mcap.opcode import Opcode
from mcap.records import Chunk, ChunkIndex

from .mcaprecords import message_index, packed

_MESSAGE = struct.Struct("<BQHIQQ")


class OpenChunk:
    """Messages and definitions in memory. Times are ns."""

    __slots__ = ("_index", "_parts", "count", "definitions", "end", "size", "start")

    def __init__(self) -> None:
        self._parts: list[bytes] = []
        self._index: dict[int, list[tuple[int, int]]] = {}
        self.definitions: list[bytes] = []
        self.size = self.start = self.end = self.count = 0

    def define(self, definitions: Sequence[bytes]) -> None:
        """Put schema and channel records before the messages that follow."""
        self.definitions += definitions
        self._parts += definitions
        self.size += sum(map(len, definitions))

    def add(self, channel: int, sequence: int, log_time: int, publish_time: int, data: bytes) -> None:
        """Append a message."""
        if self.count:
            self.start, self.end = min(self.start, log_time), max(self.end, log_time)
        else:
            self.start = self.end = log_time
        self._index.setdefault(channel, []).append((log_time, self.size))
        length = 22 + len(data)
        header = _MESSAGE.pack(Opcode.MESSAGE, length, channel, sequence & 0xFFFFFFFF, log_time, publish_time)
        self._parts += (header, data)
        self.size += 9 + length
        self.count += 1

    def counts(self) -> dict[int, int]:
        """Messages per channel."""
        return {channel: len(entries) for channel, entries in self._index.items()}

    def packed(self, compressor: zstandard.ZstdCompressor, offset: int) -> tuple[bytes, ChunkIndex]:
        """The chunk record and its message indexes, to be written at `offset`, and the summary's word on them."""
        data = b"".join(self._parts)
        body = compressor.compress(data)
        record = packed(Chunk("zstd", body, self.end, self.start, zlib.crc32(data), len(data)))
        offsets, indexes, place = {}, [], offset + len(record)
        for channel, entries in self._index.items():
            indexes.append(message_index(channel, entries))
            offsets[channel] = place
            place += len(indexes[-1])
        length = sum(map(len, indexes))
        index = ChunkIndex(
            len(record), offset, "zstd", len(body), self.end, length, offsets, self.start, len(data)
        )  # fmt: skip
        return record + b"".join(indexes), index
