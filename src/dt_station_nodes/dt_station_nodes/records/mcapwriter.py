"""One MCAP file, written a chunk at a time so that what has been flushed survives anything.

Unlike the mcap library's writer, whose records it uses: a chunk can be closed at any moment, a failed write leaves
the file as it was, and a full disk still gets an end, by giving up the last chunks. Format: https://mcap.dev/spec.
"""

import contextlib
import os
import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import zstandard
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    ChunkIndex,
    DataEnd,
    Header,
    McapRecord,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
)

from .mcapchunk import OpenChunk
from .mcaprecords import packed, summary
from .mcapscan import MAGIC

LEVEL = 3
_SPARE = 1 << 14

LastWords = Mapping[str, Mapping[str, str]]


@dataclass(frozen=True)
class _Kept:
    """A written chunk, and the state of the file before it."""

    offset: int
    crc: int
    index: ChunkIndex
    counts: Mapping[int, int]


class McapWriter:
    """Writes one file; every method that touches the disk may raise OSError and can be tried again.

    Times are ns. Not thread-safe: one thread owns it.
    """

    def __init__(self, path: Path, library: str = "", sync: bool = False) -> None:
        self.path = path
        self._sync = sync
        self._fd = os.open(path, os.O_CREAT | os.O_EXCL | os.O_RDWR, 0o644)
        self._offset = self._crc = 0
        self._schemas: dict[int, Schema] = {}
        self._channels: dict[int, Channel] = {}
        self._unwritten: list[bytes] = []
        self._chunks: list[_Kept] = []
        self._attachments: list[tuple[int, AttachmentIndex]] = []
        self._metadata: list[tuple[int, MetadataIndex]] = []
        self._pending = OpenChunk()
        self._compressor = zstandard.ZstdCompressor(level=LEVEL)
        self._append(MAGIC + packed(Header("ros2", library)))

    @property
    def size(self) -> int:
        """Bytes on disk and in the open chunk."""
        return self._offset + self._pending.size

    @property
    def pending(self) -> int:
        """Bytes in the open chunk."""
        return self._pending.size

    def schema_of(self, name: str, text: str, encoding: str = "ros2msg") -> int:
        """Register a message definition, once; returns its id."""
        for known in self._schemas.values():
            if (known.name, known.data) == (name, text.encode()):
                return known.id
        schema = Schema(len(self._schemas) + 1, text.encode(), encoding, name)
        self._schemas[schema.id] = schema
        self._unwritten.append(packed(schema))
        return schema.id

    def channel(self, topic: str, schema: int, metadata: Mapping[str, str]) -> int:
        """Register a topic; returns its id."""
        channel = Channel(len(self._channels) + 1, topic, "cdr", dict(metadata), schema)
        self._channels[channel.id] = channel
        self._unwritten.append(packed(channel))
        return channel.id

    def message(self, channel: int, sequence: int, log_time: int, publish_time: int, data: bytes) -> None:
        """Add a message to the open chunk; nothing is written yet."""
        chunk = self._pending
        if not chunk.count and (number := len(self._chunks)) and number & (number - 1) == 0:
            # again in chunks 1, 2, 4, 8...: one damaged chunk must not take the definitions with it
            self._unwritten = self._definitions()
        if self._unwritten:
            chunk.define(self._unwritten)
            self._unwritten = []
        chunk.add(channel, sequence, log_time, publish_time, data)

    def flush(self) -> dict[int, int]:
        """Write the open chunk. Returns the messages per channel it held.

        On OSError the file is as before and the chunk is still open: try again, or `discard` it.
        """
        chunk = self._pending
        if not chunk.count:
            return {}
        record, index = chunk.packed(self._compressor, self._offset)
        counts = chunk.counts()
        before = self._offset, self._crc
        self._append(record)
        self._chunks.append(_Kept(*before, index, counts))
        self._pending = OpenChunk()
        return counts

    def discard(self) -> dict[int, int]:
        """Give up the open chunk; returns the messages per channel that are lost with it."""
        chunk, self._pending = self._pending, OpenChunk()
        self._unwritten = [*chunk.definitions, *self._unwritten]
        return chunk.counts()

    def _definitions(self) -> list[bytes]:
        return [packed(record) for record in (*self._schemas.values(), *self._channels.values())]

    def attachment(self, name: str, media_type: str, data: bytes, time: int) -> None:
        """Write a whole file into the bag."""
        record = packed(Attachment(time, time, name, media_type, data))
        index = AttachmentIndex(self._offset, len(record), time, time, len(data), name, media_type)
        self._append(record)
        self._attachments.append((index.offset, index))

    def metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Write a map of strings into the bag."""
        record = packed(Metadata(name, dict(values)))
        index = MetadataIndex(self._offset, len(record), name)
        self._append(record)
        self._metadata.append((index.offset, index))

    def close(self, last_words: Callable[[dict[int, int]], LastWords] | None = None) -> dict[int, int]:
        """Write metadata and index and close the file. Returns messages per channel given up to make room for them.

        `last_words` turns those into the metadata records that end the data. Raises OSError where even giving
        up everything does not help; the file is then torn, and closed.
        """
        lost: dict[int, int] = {}
        try:
            try:
                self.flush()
            except OSError:
                _add(lost, self.discard())
            room = False
            while True:
                end = self._end(last_words(lost) if last_words else {})
                try:
                    if room and self._chunks and not self._takes(len(end) + _SPARE):
                        raise OSError("no room for the index")
                    self._append(end)
                    return lost
                except OSError:
                    if not self._chunks:
                        raise
                    room = True
                    _add(lost, self._give_up_last())
        finally:
            os.close(self._fd)

    def statistics(self) -> Statistics:
        """Counts and times of what has been written."""
        counts = dict.fromkeys(self._channels, 0)
        for kept in self._chunks:
            _add(counts, kept.counts)
        return Statistics(
            attachment_count=len(self._attachments),
            channel_count=len(self._channels),
            channel_message_counts=counts,
            chunk_count=len(self._chunks),
            message_count=sum(counts.values()),
            message_end_time=max((kept.index.message_end_time for kept in self._chunks), default=0),
            message_start_time=min((kept.index.message_start_time for kept in self._chunks), default=0),
            metadata_count=len(self._metadata),
            schema_count=len(self._schemas),
        )

    def _append(self, data: bytes) -> None:
        view = memoryview(data)
        try:
            done = 0
            while done < len(view):
                done += os.pwrite(self._fd, view[done:], self._offset + done)
            if self._sync:
                os.fdatasync(self._fd)
        except OSError:
            with contextlib.suppress(OSError):
                os.ftruncate(self._fd, self._offset)
            raise
        self._offset += len(data)
        self._crc = zlib.crc32(data, self._crc)

    def _takes(self, wanted: int) -> bool:
        """Whether the file system takes that many bytes at the end of the file; leaves the file as it was."""
        try:
            os.pwrite(self._fd, bytes(wanted), self._offset)
            return os.fstat(self._fd).st_size >= self._offset + wanted
        except OSError:
            return False
        finally:
            os.ftruncate(self._fd, self._offset)

    def _give_up_last(self) -> dict[int, int]:
        kept = self._chunks.pop()
        self._offset, self._crc = kept.offset, kept.crc
        os.ftruncate(self._fd, kept.offset)
        self._attachments = [pair for pair in self._attachments if pair[0] < kept.offset]
        self._metadata = [pair for pair in self._metadata if pair[0] < kept.offset]
        return dict(kept.counts)

    def _end(self, last_words: LastWords) -> bytes:
        data = b"".join(self._unwritten)
        indexes = [index for _, index in self._metadata]
        for name, values in last_words.items():
            record = packed(Metadata(name, dict(values)))
            indexes.append(MetadataIndex(self._offset + len(data), len(record), name))
            data += record
        data += packed(DataEnd(zlib.crc32(data, self._crc)))
        statistics = self.statistics()
        statistics.metadata_count = len(indexes)
        groups: list[list[McapRecord]] = [
            list(self._schemas.values()),
            list(self._channels.values()),
            [statistics],
            [kept.index for kept in self._chunks],
            [index for _, index in self._attachments],
            list(indexes),
        ]
        return data + summary(groups, self._offset + len(data))


def _add(total: dict[int, int], more: Mapping[int, int]) -> None:
    for channel, count in more.items():
        total[channel] = total.get(channel, 0) + count
