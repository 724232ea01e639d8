"""A rosbag2 directory being written: files split, losses counted, the disk's troubles survived."""

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import yaml

from .errors import RecordError
from .losses import LOSS, TopicLoss, loss_text
from .mcapwriter import McapWriter
from .rosbag2 import NAME, BagInfo, FileInfo, TopicInfo, dump_info

CONTEXT = "dt_station"
ROSBAG2 = "rosbag2"
_RETRY_S = 1.0


@dataclass(frozen=True, slots=True)
class WriterOptions:
    """How a bag is written; sizes in bytes, times in s, 0 splits never."""

    chunk_seconds: float = 0.5
    chunk_bytes: int = 1 << 20
    split_bytes: int = 0
    split_seconds: float = 0.0
    sync: bool = True


@dataclass(frozen=True, slots=True)
class RecordedTopic:
    """A topic to record, with everything a reader needs to understand it."""

    info: TopicInfo
    definition: str


@dataclass(slots=True)
class _File:
    writer: McapWriter
    start: float
    channels: list[int] = field(default_factory=list)


class BagWriter:
    """Writes one bag. Troubles with the disk after the start are kept in `problem`, and counted, never raised.

    Not thread-safe. Raises RecordError where the bag exists already, or cannot be started and `patient` does not
    say to go on trying.
    """

    def __init__(
        self,
        folder: Path,
        options: WriterOptions = WriterOptions(),
        context: Mapping[str, str] | None = None,
        library: str = "dt_station",
        patient: bool = False,
    ) -> None:
        if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
            raise RecordError(f"{folder} exists already; choose another name or remove it")
        self.folder, self.options = folder, options
        self.problem = ""
        self.loss: list[TopicLoss] = []
        self._topics: list[RecordedTopic] = []
        self._counts: list[int] = []
        self._context = dict(context or {})
        self._attachments: dict[str, tuple[str, bytes]] = {}
        self._library = library
        self._files: list[FileInfo] = []
        self._number = 0
        self._last_flush = 0.0
        self._file: _File | None = None
        self._next_try = 0.0
        try:
            self._file = self._start(0.0)
        except OSError as error:
            self._trouble(error)
            if not patient:
                raise RecordError(self.problem) from None

    def topic(self, topic: RecordedTopic) -> int:
        """Register a topic; returns its number."""
        self._topics.append(topic)
        self._counts.append(0)
        self.loss.append(TopicLoss())
        if self._file is not None:
            self._register(self._file, topic)
        return len(self._topics) - 1

    def attach(self, name: str, media_type: str, data: bytes, time_ns: int) -> None:
        """Keep a file in the bag (its first storage file)."""
        self._attachments[name] = (media_type, data)
        if self._file is not None:
            try:
                self._file.writer.attachment(name, media_type, data, time_ns)
            except OSError as error:
                self._trouble(error)

    def context(self, values: Mapping[str, str]) -> None:
        """Add to what the bag says about itself."""
        self._context.update(values)

    def write(self, topic: int, sequence: int, time_ns: int, data: bytes, publish_ns: int | None = None) -> None:
        """Take one message; `tick` brings it to the disk."""
        if self._file is None:
            self.loss[topic].unwritten += 1
            return
        self._file.writer.message(
            self._file.channels[topic], sequence, time_ns, time_ns if publish_ns is None else publish_ns, data
        )

    def tick(self, now: float) -> None:
        """Close the chunk and split the file where it is time; `now` in s of any steady clock."""
        if self._file is None:
            if now >= self._next_try:
                self._next_try = now + _RETRY_S
                try:
                    self._file = self._start(now)
                    self.problem = ""
                except OSError as error:
                    self._trouble(error)
            return
        options, writer = self.options, self._file.writer
        if not self._file.start:
            self._file.start = self._last_flush = now
        if writer.pending >= options.chunk_bytes or now - self._last_flush >= options.chunk_seconds:
            self._last_flush = now
            self._flush()
        if (options.split_bytes and writer.size >= options.split_bytes) or (
            options.split_seconds and now - self._file.start >= options.split_seconds
        ):
            self._finish()
            self.tick(now)

    def close(self) -> BagInfo:
        """Finish the last file and write metadata.yaml."""
        self._finish()
        topics = tuple(
            TopicInfo(t.info.name, t.info.msgtype, count, t.info.qos, t.info.type_hash)
            for t, count in zip(self._topics, self._counts, strict=True)
        )
        info = BagInfo(
            "mcap", tuple(self._files), topics, "", {**self._context, **loss_text(self._names(), self.loss, LOSS + ".")}
        )
        path = self.folder / NAME
        try:
            temporary = path.with_suffix(".yaml.part")
            with temporary.open("w", encoding="utf-8") as file:
                file.write(dump_info(info))
                file.flush()
                os.fsync(file.fileno())
            temporary.replace(path)
        except OSError as error:
            self._trouble(error)
        return info

    def _start(self, now: float) -> _File:
        self.folder.mkdir(parents=True, exist_ok=True)
        path = self.folder / f"{self.folder.name}_{self._number}.mcap"
        self._number += 1
        try:
            file = _File(McapWriter(path, self._library, self.options.sync), now)
        except OSError:
            self._number -= 1
            path.unlink(missing_ok=True)
            raise
        for topic in self._topics:
            self._register(file, topic)
        if self._context:
            file.writer.metadata(CONTEXT, self._context)
        if self._number == 1:
            for name, (media_type, data) in self._attachments.items():
                file.writer.attachment(name, media_type, data, 0)
        return file

    def _register(self, file: _File, topic: RecordedTopic) -> None:
        schema = file.writer.schema_of(topic.info.msgtype, topic.definition)
        metadata = {"offered_qos_profiles": topic.info.qos, "topic_type_hash": topic.info.type_hash}
        file.channels.append(file.writer.channel(topic.info.name, schema, metadata))

    def _flush(self) -> None:
        assert self._file is not None
        try:
            self._count(self._file.writer.flush(), self._file)
            self.problem = ""
        except OSError as error:
            self._trouble(error)
            self._lose(self._file.writer.discard(), self._file)

    def _count(self, counts: Mapping[int, int], file: _File) -> None:
        for channel, count in counts.items():
            self._counts[file.channels.index(channel)] += count

    def _lose(self, counts: Mapping[int, int], file: _File) -> None:
        for channel, count in counts.items():
            self.loss[file.channels.index(channel)].unwritten += count

    def _finish(self) -> None:
        if self._file is None:
            return
        file = self._file
        self._flush()
        path = file.writer.path.name
        given_up: dict[int, int] = {}

        def last_words(lost: dict[int, int]) -> dict[str, dict[str, str]]:
            for channel, count in given_up.items():
                self.loss[file.channels.index(channel)].unwritten -= count
                self._counts[file.channels.index(channel)] += count
            given_up.clear()
            given_up.update(lost)
            for channel, count in given_up.items():
                self.loss[file.channels.index(channel)].unwritten += count
                self._counts[file.channels.index(channel)] -= count
            return {
                CONTEXT: self._context,
                LOSS: loss_text(self._names(), self.loss),
                ROSBAG2: {"serialized_metadata": self._serialized(file)},
            }

        try:
            file.writer.close(last_words)
        except OSError as error:
            self._trouble(error)
        statistics = file.writer.statistics()
        self._files.append(
            FileInfo(path, statistics.message_start_time, statistics.message_end_time, statistics.message_count)
        )
        self._file = None

    def _serialized(self, file: _File) -> str:
        statistics = file.writer.statistics()
        counts = statistics.channel_message_counts
        topics = tuple(
            TopicInfo(t.info.name, t.info.msgtype, counts[c], t.info.qos, t.info.type_hash)
            for t, c in zip(self._topics, file.channels, strict=True)
        )
        about = FileInfo(
            file.writer.path.name, statistics.message_start_time, statistics.message_end_time, statistics.message_count
        )
        body = yaml.safe_load(dump_info(BagInfo("mcap", (about,), topics)))["rosbag2_bagfile_information"]
        return yaml.safe_dump(body, sort_keys=False, width=1 << 16)

    def _names(self) -> list[str]:
        return [topic.info.name for topic in self._topics]

    def _trouble(self, error: OSError) -> None:
        self.problem = f"cannot write to {self.folder}: {error.strerror or error}"
