"""A whole MCAP file, opened for reading and checked before a number leaves it."""

import zlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import BinaryIO

import numpy as np
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    ChunkIndex,
    Footer,
    Header,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
)

from .blocks import Block, block_of
from .errors import RecordError
from .mcapscan import (
    FOOTER_SIZE,
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
from .salvage import survey

_BATCH = 1 << 20


class TornError(RecordError):
    """A file whose end is missing; what is whole in it can be recovered."""


class McapFile:
    """Reads one file. Raises TornError or RecordError on opening and while reading, never gives doubtful data."""

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            self._file: BinaryIO = path.open("rb")
        except OSError as error:
            raise RecordError(f"{path}: cannot be read ({error.strerror})") from None
        self.schemas: dict[int, Schema] = {}
        self.channels: dict[int, Channel] = {}
        self.metadata: list[Metadata] = []
        self.statistics: Statistics | None = None
        self._chunks: list[ChunkIndex] = []
        self._attachments: list[AttachmentIndex] = []
        self._data_end = 0
        try:
            self._open()
        except DamagedError as error:
            self.close()
            raise RecordError(f"{path}: {error}; dt-station recover saves what is whole") from None
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def _open(self) -> None:
        size = self._file.seek(0, 2)
        if size == 0:
            raise RecordError(f"{self.path}: the file is empty")
        self._file.seek(0)
        if self._file.read(len(MAGIC)) != MAGIC:
            raise RecordError(f"{self.path}: this is no MCAP file")
        footer = self._footer(size)
        summary_start = footer.summary_start
        if summary_start:
            self._summary(summary_start, size - len(MAGIC), footer)
        else:
            self._data_end = size - len(MAGIC) - FOOTER_SIZE
        self._check_data()
        if not summary_start or not (self.channels or self._chunks):
            self._scan()

    def _footer(self, size: int) -> Footer:
        if size >= 2 * len(MAGIC) + FOOTER_SIZE:
            self._file.seek(size - len(MAGIC) - FOOTER_SIZE)
            tail = self._file.read()
            if tail[-len(MAGIC) :] == MAGIC and tail[:9] == b"\x02\x14" + bytes(7):
                footer = parse(Footer.read, tail[9:-8])
                if footer.summary_start <= size:
                    return footer
        found = survey(self.path)
        seconds = (found.end_ns - found.start_ns) * 1e-9
        raise TornError(
            f"{self.path}: torn, its end is missing: {found.chunks} chunks with {found.messages} messages of "
            f"{seconds:.1f} s are whole, {found.skipped_bytes} bytes after them are not; dt-station recover saves them"
        )

    def _summary(self, start: int, end: int, footer: Footer) -> None:
        self._file.seek(start)
        data = self._file.read(end - start)
        if footer.summary_crc and zlib.crc32(data[:-4]) != footer.summary_crc:
            raise DamagedError("the index fails its checksum")
        self._data_end = start
        for place in places(self._file, start, end):
            self._keep(place)

    def _keep(self, place: Place) -> None:
        """Remember a record that is not data itself."""
        opcode = place.opcode
        if opcode == Opcode.SCHEMA:
            schema = parse(Schema.read, content(self._file, place))
            self.schemas[schema.id] = schema
        elif opcode == Opcode.CHANNEL:
            channel = parse(Channel.read, content(self._file, place))
            self.channels[channel.id] = channel
        elif opcode == Opcode.STATISTICS:
            self.statistics = parse(Statistics.read, content(self._file, place))
        elif opcode == Opcode.CHUNK_INDEX:
            self._chunks.append(parse(ChunkIndex.read, content(self._file, place)))
        elif opcode == Opcode.ATTACHMENT_INDEX:
            self._attachments.append(parse(AttachmentIndex.read, content(self._file, place)))
        elif opcode == Opcode.METADATA_INDEX:
            index = parse(MetadataIndex.read, content(self._file, place))
            self._keep(self._at(index.offset, Opcode.METADATA))
        elif opcode == Opcode.METADATA:
            self.metadata.append(parse(Metadata.read, content(self._file, place)))

    def _at(self, offset: int, opcode: Opcode) -> Place:
        place = next(places(self._file, offset, self._data_end), None)
        if place is None or place.opcode != opcode:
            raise DamagedError("the index points at a wrong place")
        return place

    def _check_data(self) -> None:
        """Compare the data section with the checksum at its end, if the writer gave one."""
        if self._data_end - 13 < len(MAGIC):
            raise DamagedError("the data section is missing")
        if not data_checksum_holds(self._file, self._data_end - 13):
            raise DamagedError("the data fail their checksum")

    def _scan(self) -> None:
        """Channels and metadata of a file without an index, from its data."""
        for place in places(self._file, len(MAGIC), self._data_end):
            if place.opcode == Opcode.CHUNK:
                for opcode, data in definitions(unpack_chunk(content(self._file, place))):
                    if opcode == Opcode.SCHEMA:
                        schema = parse(Schema.read, data)
                        self.schemas[schema.id] = schema
                    else:
                        channel = parse(Channel.read, data)
                        self.channels[channel.id] = channel
            elif place.opcode == Opcode.HEADER:
                parse(Header.read, content(self._file, place))
            elif place.opcode in (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.METADATA):
                self._keep(place)

    def attachments(self) -> dict[str, tuple[int, bytes]]:
        """Files in the bag by name, with log time (ns); the first of a name wins."""
        found: dict[str, tuple[int, bytes]] = {}
        for place in self._attachment_places():
            data = content(self._file, place)
            attachment = parse(Attachment.read, data)
            if zlib.crc32(data[:-4]) != int.from_bytes(data[-4:], "little"):
                raise RecordError(f"{self.path}: the attachment {attachment.name!r} fails its checksum")
            found.setdefault(attachment.name, (attachment.log_time, attachment.data))
        return found

    def _attachment_places(self) -> Iterator[Place]:
        if self._attachments or self._chunks:
            for index in self._attachments:
                yield self._at(index.offset, Opcode.ATTACHMENT)
        else:
            yield from (p for p in places(self._file, len(MAGIC), self._data_end) if p.opcode == Opcode.ATTACHMENT)

    def counts(self) -> Mapping[int, int] | None:
        """Messages per channel, if the file says so."""
        return None if self.statistics is None else self.statistics.channel_message_counts

    def blocks(
        self, channels: set[int] | None = None, start_ns: int | None = None, stop_ns: int | None = None
    ) -> Iterator[Block]:
        """Messages in the order of the file, a chunk at a time, those of some channels and log times start to stop."""
        try:
            for block in self._blocks(channels, start_ns, stop_ns):
                wanted = np.ones(len(block), np.bool_)
                if channels is not None:
                    wanted &= np.isin(block.channel, list(channels))
                if start_ns is not None:
                    wanted &= block.log_time >= start_ns
                if stop_ns is not None:
                    wanted &= block.log_time < stop_ns
                if wanted.any():
                    yield block if wanted.all() else block.pick(wanted)
        except DamagedError as error:
            raise RecordError(f"{self.path}: {error}; dt-station recover saves what is whole") from None

    def _blocks(self, channels: set[int] | None, start_ns: int | None, stop_ns: int | None) -> Iterator[Block]:
        if not self._chunks:
            yield from self._scanned_blocks()
            return
        for chunk in sorted(self._chunks, key=lambda c: (c.message_start_time, c.chunk_start_offset)):
            offsets = chunk.message_index_offsets
            if channels is not None and offsets and channels.isdisjoint(offsets):
                continue
            if (start_ns is not None and chunk.message_end_time < start_ns) or (
                stop_ns is not None and chunk.message_start_time >= stop_ns
            ):
                continue
            place = self._at(chunk.chunk_start_offset, Opcode.CHUNK)
            data = content(self._file, place)
            yield chunk_block(data, self._file.read(chunk.message_index_length) if offsets else None)

    def _scanned_blocks(self) -> Iterator[Block]:
        """Blocks of a file without a chunk index; messages outside chunks are gathered into blocks."""
        loose: list[bytes] = []
        size = 0
        for place in places(self._file, len(MAGIC), self._data_end):
            if place.opcode == Opcode.CHUNK:
                yield chunk_block(content(self._file, place))
            elif place.opcode == Opcode.MESSAGE:
                self._file.seek(place.offset)
                loose.append(self._file.read(9 + place.length))
                size += len(loose[-1])
            if size > _BATCH:
                yield _loose_block(loose)
                loose, size = [], 0
        if loose:
            yield _loose_block(loose)


def _loose_block(records: list[bytes]) -> Block:
    lengths = np.array([len(record) for record in records], dtype=np.int64)
    return block_of(b"".join(records), np.cumsum(lengths) - lengths)
