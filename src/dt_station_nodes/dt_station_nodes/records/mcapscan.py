"""The records of an MCAP file, one level deep, and its chunks unpacked. Format: https://mcap.dev/spec."""

import struct
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from io import BytesIO
from typing import BinaryIO, TypeVar

import lz4.frame  # type: ignore[import-untyped]
import numpy as np
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode

from .blocks import Block, BlockError, Index, block_of, walk

MAGIC = b"\x89MCAP0\r\n"
FOOTER_SIZE = 29
MAX_CHUNK = 1 << 32
MAX_RECORD = 1 << 36
_BATCH = 1 << 20
_HEAD = struct.Struct("<BQ")
_CHUNK = struct.Struct("<QQQII")
_T = TypeVar("_T")


class DamagedError(ValueError):
    """Bytes that are not what the format says."""


@dataclass(frozen=True, slots=True)
class Place:
    """Where a record lies in a file: its head at `offset`, `length` bytes of content after 9 of head."""

    offset: int
    opcode: int
    length: int

    @property
    def end(self) -> int:
        """Offset of the next record."""
        return self.offset + 9 + self.length


def places(file: BinaryIO, start: int, end: int) -> Iterator[Place]:
    """Records between two offsets; raises DamagedError where one does not fit."""
    while start < end:
        file.seek(start)
        head = file.read(9)
        if len(head) < 9:
            raise DamagedError(f"a record at byte {start} ends early")
        opcode, length = _HEAD.unpack(head)
        place = Place(start, opcode, length)
        if opcode == 0 or length > MAX_RECORD or place.end > end:
            raise DamagedError(f"a record at byte {start} is damaged or ends early")
        yield place
        start = place.end


def content(file: BinaryIO, place: Place) -> bytes:
    """The bytes of a record after its head."""
    file.seek(place.offset + 9)
    data = file.read(place.length)
    if len(data) != place.length:
        raise DamagedError(f"a record at byte {place.offset} ends early")
    return data


def parse(reader: Callable[[ReadDataStream], _T], data: bytes) -> _T:
    """A record of the mcap library from its content; raises DamagedError."""
    stream = ReadDataStream(BytesIO(data))
    try:
        record = reader(stream)
    except (McapError, struct.error, UnicodeDecodeError, OverflowError, MemoryError) as error:
        raise DamagedError(f"a record is damaged ({type(error).__name__})") from None
    if stream.count > len(data):
        raise DamagedError("a record is damaged")
    return record


def unpack_chunk(data: bytes) -> bytes:
    """The records inside a chunk, from the chunk record's content, checked against its CRC where it has one."""
    try:
        _, _, size, crc, name_length = _CHUNK.unpack_from(data)
        compression = data[32 : 32 + name_length].decode("ascii")
        (body_length,) = struct.unpack_from("<Q", data, 32 + name_length)
        body = memoryview(data)[40 + name_length :]
        if len(body) != body_length or size > MAX_CHUNK:
            raise DamagedError("a chunk has a wrong size")
        if compression == "zstd":
            records = zstandard.ZstdDecompressor().decompress(body, max_output_size=size) if size else b""
        elif compression == "lz4":
            records = bytes(lz4.frame.decompress(body))
        elif compression == "":
            records = bytes(body)
        else:
            raise DamagedError(f"a chunk is compressed in an unknown way ({compression!r})")
    except (struct.error, UnicodeDecodeError, zstandard.ZstdError, RuntimeError, MemoryError) as error:
        raise DamagedError(f"a chunk is damaged ({' '.join(str(error).split())})") from None
    if len(records) != size or (crc and zlib.crc32(records) != crc):
        raise DamagedError("a chunk fails its checksum")
    return records


def index_offsets(data: bytes) -> Index:
    """Message offsets within a chunk, from the message index records after it."""
    parts, position = [], 0
    while position < len(data):
        if position + 15 > len(data):
            raise DamagedError("a message index ends early")
        opcode, length = _HEAD.unpack_from(data, position)
        (size,) = struct.unpack_from("<I", data, position + 11)
        if opcode != Opcode.MESSAGE_INDEX or size % 16 or length != size + 6 or position + 9 + length > len(data):
            raise DamagedError("a message index is damaged")
        entries = np.frombuffer(data, "<u8", size // 8, position + 15).reshape(-1, 2)
        if len(entries) and entries[:, 1].max() > MAX_CHUNK:
            raise DamagedError("a message index is damaged")
        parts.append(entries[:, 1].astype(np.int64))
        position += 9 + length
    return np.concatenate(parts) if parts else np.empty(0, np.int64)


def chunk_block(data: bytes, index: bytes | None = None) -> Block:
    """The messages of a chunk record's content; `index` are the message index records after it, if known."""
    records = unpack_chunk(data)
    try:
        starts = index_offsets(index) if index else walk(records)
        return block_of(records, starts)
    except BlockError as error:
        raise DamagedError(f"a chunk is damaged: {error}") from None


def data_checksum_holds(file: BinaryIO, end: int) -> bool:
    """Whether the data before the data end record at `end` have the checksum it states, if it states one."""
    file.seek(end)
    tail = file.read(13)
    if len(tail) < 13 or tail[0] != Opcode.DATA_END or tail[1:9] != b"\x04" + bytes(7):
        return True
    expected = int.from_bytes(tail[9:], "little")
    if not expected:
        return True
    file.seek(0)
    crc, left = 0, end
    while left:
        data = file.read(min(_BATCH, left))
        if not data:
            return False
        crc, left = zlib.crc32(data, crc), left - len(data)
    return crc == expected


def definitions(records: bytes) -> Iterator[tuple[int, bytes]]:
    """Schema and channel records among a chunk's records."""
    position = 0
    while position + 9 <= len(records):
        opcode, length = records[position], int.from_bytes(records[position + 1 : position + 9], "little")
        if opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            yield opcode, records[position + 9 : position + 9 + length]
        position += 9 + length
