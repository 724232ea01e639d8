"""The ways a bag can lie on disk, behind one small protocol."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol

from rosbags.rosbag2 import Reader

from .blocks import Block, block_from_messages
from .definitions import installed_definition, type_hash
from .errors import RecordError
from .mcapfile import McapFile
from .rosbag2 import BagInfo, TopicInfo

_BATCH = 1 << 20


@dataclass(frozen=True, slots=True)
class StoredTopic:
    """A topic of a bag with its embedded definition (ros2msg or ros2idl text, empty if there is none)."""

    info: TopicInfo
    definition: str
    encoding: str = "ros2msg"


class Storage(Protocol):
    """Reads the messages of one bag; topics are numbered by their place in `topics`."""

    topics: tuple[StoredTopic, ...]
    metadata: Sequence[tuple[str, Mapping[str, str]]]

    def attachments(self) -> dict[str, tuple[int, bytes]]:
        """Files kept in the bag: log time (ns) and content."""
        ...

    def blocks(self, topics: set[int], start_ns: int | None, stop_ns: int | None) -> Iterator[Block]:
        """Messages of some topics with log times start to stop (exclusive), channels numbered as topics."""
        ...

    def close(self) -> None:
        """Close the files."""
        ...


class McapStorage:
    """One or more MCAP files in a row."""

    def __init__(self, paths: Sequence[Path]) -> None:
        self._files: list[McapFile] = []
        try:
            for path in paths:
                self._files.append(McapFile(path))
            self._number: list[dict[int, int]] = []
            topics: list[StoredTopic] = []
            for file in self._files:
                self._number.append({c: self._topic(file, c, topics) for c in file.channels})
        except BaseException:
            self.close()
            raise
        self.topics = tuple(topics)
        self.metadata: Sequence[tuple[str, Mapping[str, str]]] = [
            (record.name, record.metadata) for file in self._files for record in file.metadata
        ]

    @staticmethod
    def _topic(file: McapFile, number: int, topics: list[StoredTopic]) -> int:
        channel = file.channels[number]
        schema = file.schemas.get(channel.schema_id)
        if schema is None:
            raise RecordError(f"{file.path}: the topic {channel.topic} has no message definition")
        counts = file.counts()
        stored = StoredTopic(
            TopicInfo(
                channel.topic,
                schema.name,
                counts.get(number, 0) if counts is not None else -1,
                channel.metadata.get("offered_qos_profiles", ""),
                channel.metadata.get("topic_type_hash", ""),
                channel.message_encoding,
            ),
            schema.data.decode("utf-8", "replace"),
            schema.encoding,
        )
        for place, known in enumerate(topics):
            if known.info.name == channel.topic:
                if known.info.msgtype != schema.name or known.definition != stored.definition:
                    raise RecordError(f"{file.path}: the topic {channel.topic} has two message definitions")
                both = known.info.count, stored.info.count
                topics[place] = replace(known, info=replace(known.info, count=-1 if -1 in both else sum(both)))
                return place
        topics.append(stored)
        return len(topics) - 1

    def attachments(self) -> dict[str, tuple[int, bytes]]:
        """Files kept in the bag; the first of a name wins."""
        found: dict[str, tuple[int, bytes]] = {}
        for file in self._files:
            found = {**file.attachments(), **found}
        return found

    def blocks(self, topics: set[int], start_ns: int | None, stop_ns: int | None) -> Iterator[Block]:
        """Messages of some topics, a chunk at a time."""
        for file, number in zip(self._files, self._number, strict=True):
            channels = {channel for channel, topic in number.items() if topic in topics}
            if not channels:
                continue
            same = all(channel == topic for channel, topic in number.items())
            for block in file.blocks(channels, start_ns, stop_ns):
                yield block if same else _renumbered(block, number)

    def close(self) -> None:
        """Close the files."""
        for file in self._files:
            file.close()


def _renumbered(block: Block, number: Mapping[int, int]) -> Block:
    channel = block.channel.copy()
    for old, new in number.items():
        channel[block.channel == old] = new
    return replace(block, channel=channel)


class RosbagsStorage:
    """Anything else that the rosbags library reads: sqlite3, and rosbag2's own compression."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self.metadata: Sequence[tuple[str, Mapping[str, str]]] = ()
        try:
            self._reader = Reader(path)
            self._reader.open()
            self._connections = list(self._reader.connections)
        except Exception as error:  # sqlite, zstd and parsing errors have no common root
            raise RecordError(f"{path}: cannot be read as a bag ({_first_line(error)})") from None
        self.topics = tuple(
            StoredTopic(
                TopicInfo(c.topic, c.msgtype, c.msgcount, "", c.digest or ""),
                c.msgdef.data or _installed(c.msgtype),
                "ros2idl" if c.msgdef.format.name == "IDL" else "ros2msg",
            )
            for c in self._connections
        )

    def attachments(self) -> dict[str, tuple[int, bytes]]:
        """Nothing: these bags keep no files."""
        return {}

    def blocks(self, topics: set[int], start_ns: int | None, stop_ns: int | None) -> Iterator[Block]:
        """Messages of some topics, about a megabyte at a time."""
        wanted = [connection for i, connection in enumerate(self._connections) if i in topics]
        number = {id(connection): i for i, connection in enumerate(self._connections)}
        batch: list[tuple[int, int, bytes]] = []
        size = 0
        if not wanted:
            return
        messages = self._reader.messages(wanted, start=start_ns, stop=stop_ns)
        while True:
            try:
                message = next(messages, None)
            except Exception as error:  # as above
                raise RecordError(f"{self._path}: damaged ({_first_line(error)})") from None
            if message is None:
                break
            connection, time, data = message
            batch.append((number.get(id(connection), self._place(connection.topic)), time, bytes(data)))
            size += len(data)
            if size > _BATCH:
                yield block_from_messages(batch)
                batch, size = [], 0
        if batch:
            yield block_from_messages(batch)

    def _place(self, topic: str) -> int:
        return next(i for i, connection in enumerate(self._connections) if connection.topic == topic)

    def close(self) -> None:
        """Close the file."""
        self._reader.close()


def _first_line(error: BaseException) -> str:
    return " ".join(str(error).split()) or type(error).__name__


def _installed(msgtype: str) -> str:
    try:
        return installed_definition(msgtype)
    except RecordError:
        return ""


def check_against(info: BagInfo, storage: Storage, folder: Path) -> None:
    """Raise RecordError where metadata.yaml and the files disagree."""
    said = {(t.name, t.msgtype): t.count for t in info.topics}
    held = {(t.info.name, t.info.msgtype): t.info.count for t in storage.topics}
    if set(held) - set(said) or any(count for key, count in said.items() if key not in held):
        raise RecordError(
            f"{folder}: metadata.yaml names other topics than the files hold; dt-station recover rebuilds it"
        )
    for key, count in held.items():
        if count not in (-1, said[key]):
            raise RecordError(
                f"{folder}: metadata.yaml counts {said[key]} messages on {key[0]}, the files hold {count}; "
                "dt-station recover rebuilds it"
            )


def check_hash(topic: StoredTopic, path: Path) -> None:
    """Raise RecordError where a definition is not the one whose hash was recorded."""
    if topic.info.type_hash.startswith("RIHS01_") and topic.definition and topic.encoding == "ros2msg":
        computed = type_hash(topic.info.msgtype, topic.definition)
        if computed and computed != topic.info.type_hash:
            raise RecordError(
                f"{path}: the definition of {topic.info.msgtype} is not the one the bag was recorded with"
            )
