"""A bag open for reading: topics, messages in order, and columns decoded in bulk."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from types import TracebackType

import numpy as np
from numpy.typing import NDArray
from rosbags.typesys.store import Typestore

from .cdr import Decoder
from .definitions import typestore
from .errors import RecordError
from .rosbag2 import NAME, BagInfo, load_info
from .storage import McapStorage, RosbagsStorage, Storage, StoredTopic, check_against, check_hash


@dataclass(frozen=True, slots=True)
class RecordedMessage:
    """One serialized message; times in ns."""

    topic: str
    log_time: int
    publish_time: int
    sequence: int
    data: bytes


def _number(path: Path) -> tuple[int, str]:
    found = re.search(r"_(\d+)$", path.stem)
    return (int(found[1]) if found else -1, path.name)


def storage_files(folder: Path, suffix: str) -> list[Path]:
    """Storage files of a bag directory in the order they were written."""
    return sorted(folder.glob(f"*{suffix}"), key=_number)


class Bag:
    """A rosbag2 directory, or a single .mcap or .db3 file. Use as a context manager.

    Raises RecordError for anything that is not whole; times are log times in ns.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self.info: BagInfo | None = None
        self._storage = self._open()
        try:
            if self.info is not None:
                check_against(self.info, self._storage, self.path)
            for topic in self._storage.topics:
                check_hash(topic, self.path)
        except RecordError:
            self.close()
            raise

    def _open(self) -> Storage:
        path = self.path
        if not path.exists():
            raise RecordError(f"{path}: no such file or directory")
        if path.is_file():
            return McapStorage([path]) if path.suffix == ".mcap" else RosbagsStorage(path)
        if not (path / NAME).is_file():
            files = storage_files(path, ".mcap")
            if files:
                return McapStorage(files)
            databases = storage_files(path, ".db3")
            if len(databases) == 1:
                return RosbagsStorage(databases[0])
            raise RecordError(f"{path}: holds no bag (no {NAME} and no .mcap file)")
        info = load_info(path)
        for file in info.files:
            if not (path / file.path).is_file():
                raise RecordError(f"{path}: the file {file.path} is missing")
        if info.storage == "mcap" and not info.compression:
            self.info = info
            return McapStorage([path / file.path for file in info.files])
        return RosbagsStorage(path)

    def __enter__(self) -> "Bag":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the files."""
        self._storage.close()

    @cached_property
    def topics(self) -> Mapping[str, StoredTopic]:
        """Topics by name, in the order of the bag."""
        return {topic.info.name: topic for topic in self._storage.topics}

    @cached_property
    def metadata(self) -> Mapping[str, Mapping[str, str]]:
        """Metadata records by name; later ones win."""
        return dict(self._storage.metadata)

    def attachments(self) -> dict[str, bytes]:
        """Files kept in the bag, by name; the first of a name wins."""
        return {name: data for name, (_, data) in self._storage.attachments().items()}

    def attachment_records(self) -> dict[str, tuple[int, bytes]]:
        """Files kept in the bag with the log time (ns) at which they were put there."""
        return self._storage.attachments()

    def deserialize(self, message: RecordedMessage) -> object:
        """One message as an object of the rosbags library; raises RecordError where it does not fit its definition."""
        msgtype = self.topics[message.topic].info.msgtype
        try:
            return self.store.deserialize_cdr(message.data, msgtype)
        except Exception:  # the library's errors have no common root
            raise RecordError(
                f"{self.path}: a message on {message.topic} does not fit the definition of {msgtype}"
            ) from None

    @cached_property
    def store(self) -> Typestore:
        """The bag's own message types."""
        text = {t.info.msgtype: t.definition for t in self._storage.topics if t.encoding == "ros2msg" and t.definition}
        return typestore(text)

    def find(self, ending: str, msgtype: str | None = None) -> str | None:
        """The topic that ends so (and has this type); the shortest name if there are several."""
        names = [
            name
            for name, topic in self.topics.items()
            if ("/" + name).endswith("/" + ending) and msgtype in (None, topic.info.msgtype)
        ]
        return min(names, key=lambda name: (len(name), name), default=None)

    def messages(
        self, topics: Sequence[str] | None = None, start_ns: int | None = None, stop_ns: int | None = None
    ) -> Iterator[RecordedMessage]:
        """Messages in the order they were recorded."""
        names = list(self.topics)
        for block in self._storage.blocks(self._numbers(topics), start_ns, stop_ns):
            order = np.argsort(block.log_time, kind="stable")
            for i in order.tolist():
                yield RecordedMessage(
                    names[block.channel[i]],
                    int(block.log_time[i]),
                    int(block.publish_time[i]),
                    int(block.sequence[i]),
                    block.payload(i),
                )

    def tables(
        self, topic: str, start_ns: int | None = None, stop_ns: int | None = None
    ) -> Iterator[tuple[NDArray[np.int64], NDArray[np.void]]]:
        """(log times in ns, messages as a structured array), a block at a time, in order.

        Fields are named with dots (`header.stamp.sec`). Bounded memory: one block at a time.
        """
        for _, log_time, table in self.tables_of([topic], start_ns, stop_ns):
            yield log_time, table

    def tables_of(
        self, topics: Sequence[str], start_ns: int | None = None, stop_ns: int | None = None
    ) -> Iterator[tuple[str, NDArray[np.int64], NDArray[np.void]]]:
        """Several topics in one pass: (topic, log times, messages) a block and topic at a time."""
        decoders = {topic: self.decoder(topic) for topic in topics}
        numbers = {i: name for i, name in enumerate(self.topics) if name in decoders}
        for block in self._storage.blocks(set(numbers), start_ns, stop_ns):
            for number, name in numbers.items():
                own = block if len(numbers) == 1 else block.pick(np.flatnonzero(block.channel == number))
                parts = [
                    (where[positions], table)
                    for where, rows in own.rows()
                    for positions, table in decoders[name].decode(rows)
                ]
                for where, table in sorted(parts, key=lambda part: int(part[0][0])):
                    yield name, own.log_time if len(parts) == 1 else own.log_time[where], table

    def columns(
        self, topic: str, names: Sequence[str], start_ns: int | None = None, stop_ns: int | None = None
    ) -> dict[str, NDArray[np.generic]]:
        """Whole columns of a topic, one array a field, in order of log time; `log_time` is one too."""
        found: dict[str, list[NDArray[np.generic]]] = {name: [] for name in ("log_time", *names)}
        for log_time, table in self.tables(topic, start_ns, stop_ns):
            found["log_time"].append(log_time)
            for name in names:
                if name not in (table.dtype.names or ()):
                    raise RecordError(f"{self.path}: {topic} has no field {name!r}")
                found[name].append(np.ascontiguousarray(table[name]))
        joined: dict[str, NDArray[np.generic]] = {}
        for name in list(found):
            # one column at a time: a long bag fits into memory once, not twice
            parts = found.pop(name)
            joined[name] = np.concatenate(parts) if parts else np.empty(0)
        log_times = joined["log_time"].astype(np.int64, copy=False)
        if (log_times[1:] >= log_times[:-1]).all():
            return joined
        order = np.argsort(log_times, kind="stable")
        return {name: values[order] for name, values in joined.items()}

    def decoder(self, topic: str) -> Decoder:
        """A decoder of a topic's messages."""
        stored = self.topics.get(topic)
        if stored is None:
            raise RecordError(f"{self.path}: no topic {topic}; the bag has {', '.join(self.topics) or 'none'}")
        if stored.info.serialization != "cdr" or stored.encoding != "ros2msg":
            raise RecordError(f"{self.path}: {topic} is in a form that is not understood ({stored.encoding})")
        if not stored.definition:
            raise RecordError(f"{self.path}: the definition of {stored.info.msgtype} is neither embedded nor installed")
        return Decoder(self.store, stored.info.msgtype)

    def _numbers(self, topics: Sequence[str] | None) -> set[int]:
        return {i for i, name in enumerate(self.topics) if topics is None or name in topics}
