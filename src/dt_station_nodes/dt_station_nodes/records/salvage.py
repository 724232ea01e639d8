"""What is whole in a damaged MCAP file: chunks that pass their checksum, wherever they lie."""

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

import numpy as np
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Metadata, Schema

from .blocks import Block, block_of, walk
from .errors import RecordError
from .mcapscan import (
    MAGIC,
    DamagedError,
    Place,
    chunk_block,
    content,
    data_checksum_holds,
    definitions,
    parse,
    places,
    unpack_chunk,
)

_MARKS = (b"\x04\x00\x00\x00zstd", b"\x03\x00\x00\x00lz4")
_MARK_AT = 37
_WINDOW = 1 << 22
_CHUNK_HEAD = 41
_TIMES = struct.Struct("<QQ")
_ORIGIN = np.zeros(1, np.int64)


@dataclass
class Survey:
    """What a scan of one file found. Bytes skipped belong to no whole record; times are log times in ns."""

    path: Path
    size: int = 0
    torn: bool = True
    checksum_fails: bool = False
    chunks: int = 0
    damaged_chunks: int = 0
    skipped_bytes: int = 0
    data_end: int = 0
    messages: int = 0
    start_ns: int = 0
    end_ns: int = 0
    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    places: list[Place] = field(default_factory=list)
    last_records: bytes = b""
    last_counted: int = 0

    @property
    def complete(self) -> bool:
        """Whether nothing is wrong with the file."""
        return not (self.torn or self.checksum_fails or self.skipped_bytes or self.damaged_chunks)


def survey(path: Path) -> Survey:
    """Find every whole chunk, message and definition of a file; raises RecordError where there is nothing to read."""
    found = Survey(path)
    try:
        file: BinaryIO = path.open("rb")
    except OSError as error:
        raise RecordError(f"{path}: cannot be read ({error.strerror})") from None
    with file:
        found.size = file.seek(0, 2)
        if found.size == 0:
            raise RecordError(f"{path}: the file is empty")
        position = len(MAGIC)
        while position < found.size:
            position = _chain(file, position, found)
            if position >= found.size:
                break
            onward = _next_chunk(file, position + 1, found.size)
            found.skipped_bytes += onward - position
            position = onward
        # the index after the last chunk may be cut
        found.messages += len(walk(found.last_records)) - found.last_counted
        found.last_records = b""
        if not found.torn:
            found.checksum_fails = not data_checksum_holds(file, found.data_end)
    if not found.places and not found.channels:
        raise RecordError(f"{path}: no whole chunk of an MCAP file in it")
    return found


def _chain(file: BinaryIO, start: int, found: Survey) -> int:
    """Follow records from `start` as long as they fit; returns where they stop."""
    position = start
    end = found.size - len(MAGIC)
    try:
        for place in places(file, start, found.size):
            if place.opcode > Opcode.DATA_END:
                return position
            if not _take(file, place, found):
                return position
            position = place.end
            if place.opcode == Opcode.DATA_END:
                found.data_end = place.offset
            if place.opcode == Opcode.FOOTER and position == end:
                file.seek(position)
                found.torn = file.read() != MAGIC
                return found.size
    except DamagedError:
        pass
    return position


def _take(file: BinaryIO, place: Place, found: Survey) -> bool:
    """Keep what a record holds; False where its length cannot be trusted."""
    opcode = place.opcode
    try:
        if opcode == Opcode.CHUNK:
            data = content(file, place)
            records = unpack_chunk(data)
            start, end = _TIMES.unpack_from(data)
            found.start_ns = min(start, found.start_ns or start)
            found.end_ns = max(end, found.end_ns)
            for kind, text in definitions(records):
                _define(kind, text, found)
            found.chunks += 1
            found.places.append(place)
            found.last_records, found.last_counted = records, 0
        elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            _define(opcode, content(file, place), found)
        elif opcode in (Opcode.MESSAGE, Opcode.ATTACHMENT, Opcode.METADATA):
            found.places.append(place)
            found.messages += opcode == Opcode.MESSAGE
        elif opcode == Opcode.MESSAGE_INDEX:
            found.messages += max(0, place.length - 6) // 16
            found.last_counted += max(0, place.length - 6) // 16
    except DamagedError:
        if opcode == Opcode.CHUNK:
            found.damaged_chunks += 1
        return opcode != Opcode.CHUNK
    return True


def _define(opcode: int, data: bytes, found: Survey) -> None:
    if opcode == Opcode.SCHEMA:
        schema = parse(Schema.read, data)
        found.schemas.setdefault(schema.id, schema)
    else:
        channel = parse(Channel.read, data)
        found.channels.setdefault(channel.id, channel)


def _next_chunk(file: BinaryIO, start: int, size: int) -> int:
    """Offset of the next chunk whose records pass their checksum, or the end of the file."""
    while start < size:
        file.seek(start)
        window = file.read(_WINDOW + _CHUNK_HEAD + 8)
        marks = {hit - _MARK_AT for mark in _MARKS for hit in _all(window, mark)}
        hits = sorted(hit for hit in marks if hit >= 0 and window[hit] == Opcode.CHUNK)
        for hit in hits:
            place = next(_safe_places(file, start + hit, size), None)
            if place is None:
                continue
            try:
                unpack_chunk(content(file, place))
            except DamagedError:
                continue
            return start + hit
        start += _WINDOW
    return size


def _safe_places(file: BinaryIO, start: int, size: int) -> Iterator[Place]:
    try:
        yield from places(file, start, size)
    except DamagedError:
        return


def _all(window: bytes, mark: bytes) -> Iterator[int]:
    hit = window.find(mark)
    while hit >= 0:
        yield hit
        hit = window.find(mark, hit + 1)


def salvaged_blocks(found: Survey) -> Iterator[Block]:
    """Messages of the whole chunks, and loose ones, in the order of the file."""
    with found.path.open("rb") as file:
        for place in found.places:
            try:
                if place.opcode == Opcode.CHUNK:
                    yield chunk_block(content(file, place))
                elif place.opcode == Opcode.MESSAGE:
                    file.seek(place.offset)
                    yield block_of(file.read(9 + place.length), _ORIGIN)
            except ValueError:
                found.damaged_chunks += 1


def salvaged_extras(found: Survey) -> Iterator[Attachment | Metadata]:
    """Attachments and metadata records that can be read."""
    with found.path.open("rb") as file:
        for place in found.places:
            try:
                if place.opcode == Opcode.ATTACHMENT:
                    data = content(file, place)
                    if zlib.crc32(data[:-4]) == int.from_bytes(data[-4:], "little"):
                        yield parse(Attachment.read, data)
                elif place.opcode == Opcode.METADATA:
                    yield parse(Metadata.read, content(file, place))
            except DamagedError:
                continue
