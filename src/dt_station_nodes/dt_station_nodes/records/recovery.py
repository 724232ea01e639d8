"""A damaged or torn bag written anew from what is whole in it, with an account of what is missing."""

import contextlib
import struct
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from mcap.records import Attachment

from .bag import storage_files
from .bagwriter import CONTEXT, BagWriter, RecordedTopic, WriterOptions
from .definitions import type_hash
from .errors import RecordError
from .rosbag2 import BagInfo, TopicInfo
from .salvage import Survey, salvaged_blocks, salvaged_extras, survey
from .sequences import SequenceCounter, kind_of, sequence_number

RECOVERY = "dt_station_recovery"
_OWN = ("rosbag2", "dt_station_loss", RECOVERY)


@dataclass(slots=True)
class RecoveredTopic:
    """What was saved of a topic: messages, and sequence numbers missing between the first and the last."""

    name: str
    messages: int = 0
    missing: int = 0
    first_ns: int = 0
    last_ns: int = 0


@dataclass
class Recovery:
    """What a recovery found; `complete` if nothing at all was wrong with the files."""

    source: Path
    out: Path
    complete: bool
    torn: bool
    topics: list[RecoveredTopic]
    chunks: int
    damaged_chunks: int
    skipped_bytes: int
    orphans: int
    info: BagInfo | None = field(repr=False, default=None)

    @property
    def messages(self) -> int:
        """Messages saved."""
        return sum(topic.messages for topic in self.topics)

    def sentence(self) -> str:
        """What is missing, in one sentence."""
        saved = f"{self.messages} messages in {self.chunks} chunks saved to {self.out}"
        if self.complete:
            return f"{saved}; nothing is missing"
        if not (self.torn or self.damaged_chunks or self.skipped_bytes or self.orphans):
            return f"{saved}; no message is missing, but what the bag says about itself may be damaged"
        missing = sum(topic.missing for topic in self.topics)
        parts = []
        if self.damaged_chunks:
            parts.append(f"{self.damaged_chunks} damaged chunks")
        if self.skipped_bytes:
            parts.append(f"{self.skipped_bytes} bytes that are no whole chunk")
        if missing:
            parts.append(f"{missing} messages by their sequence numbers")
        if self.orphans:
            parts.append(f"{self.orphans} messages of topics whose definition is lost")
        end = max((topic.last_ns for topic in self.topics), default=0)
        tail = f"; whatever came after {end * 1e-9:.3f} s (log time) is missing too" if self.torn and end else ""
        return f"{saved}; missing: {', '.join(parts) or 'the end of the file'}{tail}"


def bag_files(path: Path) -> list[Path]:
    """The MCAP files at a path; raises RecordError."""
    if not path.exists():
        raise RecordError(f"{path}: no such file or directory")
    files = storage_files(path, ".mcap") if path.is_dir() else [path]
    if not files:
        raise RecordError(f"{path}: holds no .mcap file; only these can be recovered")
    return files


def recover(path: str | Path, out: Path) -> Recovery:
    """Write what is whole in a bag to the new directory `out`; the damaged one is left alone.

    Raises RecordError where there is nothing to save.
    """
    source = Path(path)
    files = bag_files(source)
    surveys, empty = [], 0
    for file in files:
        try:
            surveys.append(survey(file))
        except RecordError:
            if len(files) == 1:
                raise
            empty += 1
    if not surveys:
        raise RecordError(f"{source}: no whole chunk in any of its {len(files)} files")
    writer = BagWriter(out, WriterOptions(sync=False, chunk_seconds=1e9), library="dt_station recover")
    topics: list[RecoveredTopic] = []
    counters: list[SequenceCounter | None] = []
    orphans = 0
    for found in surveys:
        numbers = _register(found, writer, topics, counters)
        orphans += _copy(found, numbers, writer, topics, counters)
    for topic, counter in zip(topics, counters, strict=True):
        topic.missing = counter.lost if counter is not None else 0
    recovery = Recovery(
        source,
        out,
        not empty and all(found.complete for found in surveys) and not orphans,
        bool(empty) or any(found.torn for found in surveys),
        topics,
        sum(found.chunks for found in surveys),
        sum(found.damaged_chunks for found in surveys),
        sum(found.skipped_bytes for found in surveys),
        orphans,
    )
    writer.context({RECOVERY: recovery.sentence()})
    recovery.info = writer.close()
    if writer.problem:
        raise RecordError(writer.problem)
    return recovery


def _register(
    found: Survey, writer: BagWriter, topics: list[RecoveredTopic], counters: list[SequenceCounter | None]
) -> Mapping[int, int]:
    numbers: dict[int, int] = {}
    known = {topic.name: number for number, topic in enumerate(topics)}
    for number, channel in sorted(found.channels.items()):
        schema = found.schemas.get(channel.schema_id)
        if schema is None:
            continue
        if channel.topic in known:
            numbers[number] = known[channel.topic]
            continue
        text = schema.data.decode("utf-8", "replace")
        qos = channel.metadata.get("offered_qos_profiles", "")
        computed = type_hash(schema.name, text) if schema.encoding == "ros2msg" else ""
        info = TopicInfo(channel.topic, schema.name, 0, qos, channel.metadata.get("topic_type_hash") or computed)
        numbers[number] = writer.topic(RecordedTopic(info, text))
        topics.append(RecoveredTopic(channel.topic))
        counters.append(SequenceCounter() if _numbered(schema.name, text) else None)
    return numbers


def _numbered(msgtype: str, text: str) -> bool:
    try:
        return kind_of(msgtype, text).numbered
    except RecordError:
        return False


def _copy(
    found: Survey,
    numbers: Mapping[int, int],
    writer: BagWriter,
    topics: list[RecoveredTopic],
    counters: list[SequenceCounter | None],
) -> int:
    orphans = 0
    for record in salvaged_extras(found):
        if isinstance(record, Attachment):
            writer.attach(record.name, record.media_type, record.data, record.log_time)
        elif record.name == CONTEXT:
            mark = "unverified." if found.checksum_fails else ""
            writer.context({mark + key: value for key, value in record.metadata.items()})
        elif record.name not in _OWN:
            writer.context({f"{record.name}.{key}": value for key, value in record.metadata.items()})
    for block in salvaged_blocks(found):
        for i in range(len(block)):
            number = numbers.get(int(block.channel[i]))
            if number is None:
                orphans += 1
                continue
            data, time = block.payload(i), int(block.log_time[i])
            topic, counter = topics[number], counters[number]
            if counter is not None:
                with contextlib.suppress(struct.error, IndexError):
                    counter.add(sequence_number(data))
            topic.first_ns = time if not topic.messages else min(time, topic.first_ns)
            topic.last_ns = max(time, topic.last_ns)
            topic.messages += 1
            writer.write(number, int(block.sequence[i]), time, data, int(block.publish_time[i]))
        writer.tick(1.0)
    return orphans
