"""Ready means heard: a node asks for samples only once those who need its output are listening.

So the bridge, which waits for its readers, starts when the whole graph is connected, and no first message is lost.
"""

import time
from collections.abc import Callable, Sequence

from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.publisher import Publisher

from .parameters import Parameter, ParameterError

_POLL_S = 0.01
# A writer knows its reader a little before the reader knows the writer; what is sent in between can be lost.
_SETTLED_POLLS = 3

TABLE = (
    Parameter(
        "wait_for_readers",
        [],
        "what to wait for before taking part, each TOPIC:NUMBER of readers, such as load/setpoint:2",
        fixed=True,
    ),
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
    """Calls `on_ready` once every publisher named has its readers, or the time-out is over."""

    def __init__(
        self,
        node: Node,
        wanted: dict[str, int],
        publishers: dict[str, Publisher],
        timeout_s: float,
        on_ready: Callable[[], None],
    ) -> None:
        unknown = sorted(set(wanted) - set(publishers))
        if unknown:
            raise ParameterError(f"wait_for_readers names {unknown[0]}, but this node writes {', '.join(publishers)}")
        self.ready = False
        self._node = node
        self._wanted = wanted
        self._publishers = publishers
        self._on_ready = on_ready
        self._deadline = time.monotonic() + timeout_s
        self._settled = 0
        self._timer = node.create_timer(_POLL_S, self._poll, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def missing(self) -> list[str]:
        """Topics that still lack readers, each with what it has and wants."""
        have = {topic: self._publishers[topic].get_subscription_count() for topic in self._wanted}
        return [f"{topic} {have[topic]} of {n}" for topic, n in self._wanted.items() if have[topic] < n]

    def _poll(self) -> None:
        if self.ready:
            return
        missing = self.missing()
        self._settled = 0 if missing else self._settled + 1
        if self._settled < (_SETTLED_POLLS if self._wanted else 1) and time.monotonic() < self._deadline:
            return
        if missing:
            self._node.get_logger().warning(f"going on without all readers: {', '.join(missing)}")
        self.ready = True
        self._timer.cancel()
        self._on_ready()
