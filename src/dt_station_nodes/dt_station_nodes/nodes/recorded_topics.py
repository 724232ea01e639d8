"""What the recorder must know of a topic: its type, how its writers offer it, where it lies in the bag."""

import importlib
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

from ..records.bag import storage_files
from ..records.bagwriter import RecordedTopic
from ..records.definitions import installed_definition, type_hash
from ..records.rosbag2 import NAME as METADATA
from ..records.rosbag2 import TopicInfo, dump_qos
from ..records.sequences import kind_of, number_reader
from ..records.writerthread import WriterThread
from . import lifeline
from .parameters import ParameterError

_NANO = 1_000_000_000


def message_class(msgtype: str) -> Any:
    """The class of a message type such as std_msgs/msg/String. Raises ParameterError."""
    package, _, name = msgtype.split("/")
    try:
        return getattr(importlib.import_module(f"{package}.msg"), name)
    except (ImportError, AttributeError):
        raise ParameterError(
            f"the messages of {package} are not installed; source the workspace they come from"
        ) from None


class TopicSlot:
    """A recorded topic. It enters the bag with its first message, when its writers' quality of service is known."""

    __slots__ = ("_definition", "_hash", "msgtype", "name", "number", "numbered", "sequence")

    def __init__(self, name: str, msgtype: str) -> None:
        self.name, self.msgtype = name, msgtype
        self.number: int | None = None
        # all that takes time is done now: a pause at the first message would cost those behind it
        self._definition = installed_definition(msgtype)
        self._hash = type_hash(msgtype, self._definition)
        kind = kind_of(msgtype, self._definition)
        self.numbered = kind.numbered
        self.sequence: Callable[[bytes], int] = number_reader(kind)

    @property
    def running(self) -> bool:
        """Whether samples, or what answers them, were heard on it."""
        return self.numbered and self.number is not None

    def register(self, node: Node, writer: WriterThread) -> None:
        """Enter the topic into the bag, once."""
        if self.number is not None:
            return
        qos = dump_qos(offered(node, self.name))
        info = TopicInfo(self.name, self.msgtype, 0, qos, self._hash)
        self.number = writer.topic(RecordedTopic(info, self._definition))


def offered(node: Node, topic: str) -> list[dict[str, Any]]:
    """The quality of service of each writer of a topic, in rosbag2's words."""
    try:
        profiles = [info.qos_profile for info in node.get_publishers_info_by_topic(topic)]
    except Exception:  # the context may be gone at the end of a recording
        return []
    found = [_profile(profile) for profile in profiles]
    return [profile for i, profile in enumerate(found) if profile not in found[:i]]


def _profile(profile: QoSProfile) -> dict[str, Any]:
    return {
        "history": profile.history.name.lower(),
        "depth": profile.depth,
        "reliability": profile.reliability.name.lower(),
        "durability": profile.durability.name.lower(),
        "deadline": _time(profile.deadline),
        "lifespan": _time(profile.lifespan),
        "liveliness": profile.liveliness.name.lower(),
        "liveliness_lease_duration": _time(profile.liveliness_lease_duration),
        "avoid_ros_namespace_conventions": profile.avoid_ros_namespace_conventions,
    }


def _time(duration: Any) -> dict[str, int]:
    seconds, nanoseconds = divmod(duration.nanoseconds, _NANO)
    return {"sec": seconds, "nsec": nanoseconds}


def writer_qos(text: str) -> QoSProfile:
    """Quality of service to publish a recorded topic with: reliable, and latched where its writers latched."""
    latched = "durability: transient_local" in text or "durability: 1" in text
    durability = DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST, depth=2000, reliability=ReliabilityPolicy.RELIABLE, durability=durability
    )


def deepened(qos: QoSProfile, depth: int) -> QoSProfile:
    """The same quality of service with room for more messages."""
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST, depth=depth, reliability=qos.reliability, durability=qos.durability
    )


def free_folder(node: Node, folder: Path) -> Path:
    """Where to record: the folder itself, unless a supervised recorder was killed there and this is its successor.

    Then the torn bag is left for `recover`, and the recording goes on beside it.
    """
    if lifeline.VARIABLE not in os.environ or not storage_files(folder, ".mcap") or (folder / METADATA).exists():
        return folder
    number = 2
    while (beside := folder.with_name(f"{folder.name}-{number}")).exists():
        number += 1
    node.get_logger().warning(f"{folder} is torn, its recorder was killed; going on in {beside}")
    return beside
