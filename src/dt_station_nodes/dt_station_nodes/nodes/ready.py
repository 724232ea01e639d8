"""Ready means connected, both ways: writers know their readers and readers know their writers.

A node asks for samples only once those who need its output are listening and its own inputs have writers. A
writer knows its reader a little before the reader knows the writer, and what is sent in between is lost or
late; so when its request for samples has been heard, the node shows that it is ready by an endpoint on a hidden
topic. The bridge counts these and starts when the whole graph is connected: no first message is lost.
"""

import time
from collections.abc import Callable, Mapping, Sequence

from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.subscription import Subscription
from std_msgs.msg import Empty

from .parameters import Parameter, ParameterError
from .qos import LATCHED

TOPIC = "_ready"
_POLL_S = 0.01

TABLE = (
    Parameter("wait_for_readers", [], "readers to wait for, each TOPIC:NUMBER, such as load/setpoint:2", fixed=True),
    Parameter("wait_for_writers", [], "topics of its own inputs that must have a writer", fixed=True),
    Parameter(
        "wait_timeout_s", 30.0, "how long to wait for them before going on without", "s", 0.0, 3600.0, fixed=True
    ),
)


def parse_readers(entries: Sequence[str]) -> dict[str, int]:
    """Topic -> number of readers. Raises ParameterError."""
    wanted = {}
    for entry in entries:
        topic, _, number = entry.rpartition(":")
        if not topic or not number.isdigit():
            raise ParameterError(f"wait_for_readers takes TOPIC:NUMBER, got {entry!r}")
        wanted[topic] = int(number)
    return wanted


class ReadyGate:
    """Calls `on_ready` once every publisher has the readers wanted and every subscription of `writers` a writer.

    `nodes` counts ready nodes to wait for besides (the bridge). If `on_ready` returns a subscription, the node
    shows itself ready when that one has a writer. After `timeout_s` it goes on without what is missing.
    """

    def __init__(
        self,
        node: Node,
        wanted: dict[str, int],
        publishers: Mapping[str, Publisher],
        timeout_s: float,
        on_ready: Callable[[], Subscription | None],
        writers: Mapping[str, Subscription] | None = None,
        nodes: int = 0,
    ) -> None:
        unknown = sorted(set(wanted) - set(publishers))
        if unknown:
            raise ParameterError(f"wait_for_readers names {unknown[0]}, but this node writes {', '.join(publishers)}")
        self.ready = False
        self._node, self._nodes = node, nodes
        self._wanted, self._publishers, self._writers = wanted, publishers, writers or {}
        self._on_ready = on_ready
        self._awaited: Subscription | None = None
        self._deadline = time.monotonic() + timeout_s
        self._timer = node.create_timer(_POLL_S, self._poll, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def missing(self) -> list[str]:
        """What is still waited for, in words."""
        have = {topic: self._publishers[topic].get_subscription_count() for topic in self._wanted}
        lacking = [f"{topic}: {have[topic]} of {n} readers" for topic, n in self._wanted.items() if have[topic] < n]
        lacking += [f"{topic}: no writer" for topic, each in self._writers.items() if not each.get_publisher_count()]
        if self._nodes and (ready := self._node.count_publishers(TOPIC)) < self._nodes:
            lacking.append(f"{ready} of {self._nodes} nodes ready")
        return lacking

    def _poll(self) -> None:
        if not self.ready:
            missing = self.missing()
            if missing and time.monotonic() < self._deadline:
                return
            if missing:
                self._node.get_logger().warning(f"going on without: {', '.join(missing)}")
            self.ready = True
            self._awaited = self._on_ready()
        if self._awaited is None:
            self._timer.cancel()
        elif self._awaited.get_publisher_count():
            self._timer.cancel()
            # never written to: that it exists is the message
            self._sign = self._node.create_publisher(Empty, TOPIC, LATCHED)


def chosen(names: Sequence[str], subscriptions: Mapping[str, Subscription]) -> dict[str, Subscription]:
    """The subscriptions named by the parameter wait_for_writers. Raises ParameterError."""
    unknown = sorted(set(names) - set(subscriptions))
    if unknown:
        raise ParameterError(f"wait_for_writers names {unknown[0]}, but this node reads {', '.join(subscriptions)}")
    return {name: subscriptions[name] for name in names}
