"""The metadata.yaml of a rosbag2 directory: what we read of any version, and what we write (version 9, Jazzy)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

from .errors import RecordError

NAME = "metadata.yaml"
VERSION = 9
DISTRO = "jazzy"


@dataclass(frozen=True, slots=True)
class TopicInfo:
    """A recorded topic; `qos` is the YAML list of offered profiles, `type_hash` its RIHS01 hash or empty."""

    name: str
    msgtype: str
    count: int = 0
    qos: str = ""
    type_hash: str = ""
    serialization: str = "cdr"


@dataclass(frozen=True, slots=True)
class FileInfo:
    """A storage file: log times (ns) and number of its messages."""

    path: str
    start_ns: int
    end_ns: int
    count: int


@dataclass(frozen=True, slots=True)
class BagInfo:
    """What metadata.yaml says."""

    storage: str
    files: tuple[FileInfo, ...]
    topics: tuple[TopicInfo, ...]
    compression: str = ""
    custom: Mapping[str, str] = field(default_factory=dict)
    distro: str = DISTRO

    @property
    def count(self) -> int:
        """Messages in all files."""
        return sum(topic.count for topic in self.topics)


def dump_info(info: BagInfo) -> str:
    """The text of metadata.yaml as rosbag2 of Jazzy writes it."""
    filled = [file for file in info.files if file.count]
    start = min((file.start_ns for file in filled), default=0)
    end = max((file.end_ns for file in filled), default=0)
    content = {
        "rosbag2_bagfile_information": {
            "version": VERSION,
            "storage_identifier": info.storage,
            "duration": {"nanoseconds": end - start},
            "starting_time": {"nanoseconds_since_epoch": start},
            "message_count": info.count,
            "topics_with_message_count": [
                {
                    "topic_metadata": {
                        "name": topic.name,
                        "type": topic.msgtype,
                        "serialization_format": topic.serialization,
                        "offered_qos_profiles": yaml.safe_load(topic.qos) or [] if topic.qos else [],
                        "type_description_hash": topic.type_hash,
                    },
                    "message_count": topic.count,
                }
                for topic in info.topics
            ],
            "compression_format": "",
            "compression_mode": "",
            "relative_file_paths": [file.path for file in info.files],
            "files": [
                {
                    "path": file.path,
                    "starting_time": {"nanoseconds_since_epoch": file.start_ns},
                    "duration": {"nanoseconds": file.end_ns - file.start_ns},
                    "message_count": file.count,
                }
                for file in info.files
            ],
            "custom_data": dict(info.custom) or None,
            "ros_distro": info.distro,
        }
    }
    return yaml.safe_dump(content, sort_keys=False, width=1 << 16)


def dump_qos(profiles: Sequence[Mapping[str, Any]]) -> str:
    """Offered profiles as the YAML that rosbag2 keeps with a channel."""
    return yaml.safe_dump(list(map(dict, profiles)), sort_keys=False).strip() if profiles else ""


def load_info(folder: Path) -> BagInfo:
    """Read metadata.yaml of a bag; raises RecordError with what is wrong."""
    path = folder / NAME
    try:
        content = yaml.safe_load(path.read_text(encoding="utf-8"))
        body = content["rosbag2_bagfile_information"]
        topics = tuple(_topic(entry) for entry in body["topics_with_message_count"])
        names = [Path(str(name)).name for name in body["relative_file_paths"]]
        per_file = {Path(str(entry["path"])).name: entry for entry in body.get("files") or ()}
        files = tuple(_file(name, per_file.get(name)) for name in names)
        info = BagInfo(
            str(body["storage_identifier"]),
            files,
            topics,
            str(body.get("compression_mode") or "").lower().replace("none", ""),
            {str(key): str(value) for key, value in (body.get("custom_data") or {}).items()},
            str(body.get("ros_distro") or ""),
        )
        count = int(body["message_count"])
    except OSError as error:
        raise RecordError(f"{path}: cannot be read ({error.strerror})") from None
    except (yaml.YAMLError, UnicodeDecodeError):
        raise RecordError(f"{path}: no valid YAML; dt-station recover rebuilds it") from None
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        raise RecordError(
            f"{path}: not the metadata of a bag ({type(error).__name__}: {error}); dt-station recover rebuilds it"
        ) from None
    if count != info.count:
        raise RecordError(f"{path}: {count} messages in all, but {info.count} by topic; dt-station recover rebuilds it")
    return info


def _topic(entry: Mapping[str, Any]) -> TopicInfo:
    about = entry["topic_metadata"]
    qos = about.get("offered_qos_profiles") or ""
    return TopicInfo(
        str(about["name"]),
        str(about["type"]),
        int(entry["message_count"]),
        qos if isinstance(qos, str) else dump_qos(qos),
        str(about.get("type_description_hash") or ""),
        str(about["serialization_format"]),
    )


def _file(name: str, entry: Mapping[str, Any] | None) -> FileInfo:
    if entry is None:
        return FileInfo(name, 0, 0, -1)
    start = int(entry["starting_time"]["nanoseconds_since_epoch"])
    return FileInfo(name, start, start + int(entry["duration"]["nanoseconds"]), int(entry["message_count"]))
