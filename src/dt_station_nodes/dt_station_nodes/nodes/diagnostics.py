"""What a node says of itself on /diagnostics, once a second and when asked."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.clock import Clock, ClockType
from rclpy.node import Node

from .qos import DIAGNOSTICS_WRITER


class Level(int, Enum):
    """As in DiagnosticStatus.msg."""

    OK = 0
    WARN = 1
    ERROR = 2


@dataclass(frozen=True, slots=True)
class Health:
    """A node's state in one sentence, with figures."""

    level: Level = Level.OK
    message: str = "running"
    values: Mapping[str, Any] = field(default_factory=dict)


class Diagnostics:
    """Publishes a node's health."""

    def __init__(self, node: Node, collect: Callable[[], Health], period_s: float = 1.0) -> None:
        self._node = node
        self._collect = collect
        self._name = node.get_fully_qualified_name().lstrip("/")
        self._publisher = node.create_publisher(DiagnosticArray, "/diagnostics", DIAGNOSTICS_WRITER)
        # a steady clock: reports go on where /clock stands still
        self._timer = node.create_timer(period_s, self.report, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def report(self) -> None:
        """Publish now; nothing where the node has already been told to stop."""
        if not self._node.context.ok():
            return
        health = self._collect()
        status = DiagnosticStatus(
            level=bytes([health.level.value]),
            name=self._name,
            message=health.message,
            hardware_id="dt_station",
            values=[KeyValue(key=key, value=_text(value)) for key, value in health.values.items()],
        )
        message = DiagnosticArray(status=[status])
        message.header.stamp = self._node.get_clock().now().to_msg()
        self._publisher.publish(message)


def _text(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.6g}"
    return str(value)
