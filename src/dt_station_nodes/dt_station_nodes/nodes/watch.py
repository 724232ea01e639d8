"""An observer of the running station: health of each node, the shadow's summary."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.context import Context
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from dt_station_msgs.msg import ShadowSummary

from .dds_profile import use_profile
from .qos import DIAGNOSTICS_READER, LATCHED
from .scenario import NAMESPACE
from .spinning import make_executor
from .stopping import uninterrupted

_LEVELS = {0: "ok", 1: "warn", 2: "error", 3: "stale"}
_FIGURES = tuple(f"{channel}_{figure}" for channel in ("position", "pressure") for figure in ("ise", "rms", "fit"))
_SUMMARY = ("samples", "missed", "model", "model_sha256", *_FIGURES)


@dataclass(frozen=True, slots=True)
class NodeHealth:
    """The last report of one node; values are numbers where they read as such."""

    level: str
    message: str
    values: dict[str, Any]


@dataclass(slots=True)
class Observations:
    """What was heard so far, by node name."""

    health: dict[str, NodeHealth] = field(default_factory=dict)
    summary: dict[str, Any] = field(default_factory=dict)

    def value(self, node: str, key: str, default: Any = None) -> Any:
        """One figure of one node's last report."""
        health = self.health.get(node)
        return default if health is None else health.values.get(key, default)


def observe(node: Node, observed: Observations) -> None:
    """Subscribe a node to what is to be observed."""

    def on_diagnostics(message: DiagnosticArray) -> None:
        for status in message.status:
            space, _, name = status.name.rpartition("/")
            if space == NAMESPACE:
                level = _LEVELS.get(int.from_bytes(status.level, "little"), "stale")
                values = {pair.key: _number(pair.value) for pair in status.values}
                observed.health[name] = NodeHealth(level, status.message, values)

    def on_summary(message: ShadowSummary) -> None:
        observed.summary = {name: getattr(message, name) for name in _SUMMARY}

    # history where the writers keep some: a node's last report is still there after its run
    qos = DIAGNOSTICS_READER
    node.create_subscription(DiagnosticArray, "/diagnostics", on_diagnostics, qos)
    node.create_subscription(ShadowSummary, "shadow/summary", on_summary, LATCHED)


class Watch:
    """A node of its own in a context of its own, spun by whoever holds it; Ctrl-C waits for rclpy's calls to end."""

    def __init__(self, name: str = "dt_station_watch") -> None:
        self.observed = Observations()
        use_profile()
        try:
            with uninterrupted():
                self._open(name)
        except KeyboardInterrupt:
            self.close()
            raise

    def _open(self, name: str) -> None:
        self._context = Context()
        rclpy.init(args=[], context=self._context, signal_handler_options=SignalHandlerOptions.NO)
        self.node = Node(
            name,
            namespace=NAMESPACE,
            context=self._context,
            use_global_arguments=False,
            enable_rosout=False,
            start_parameter_services=False,
        )
        self._executor = make_executor(self._context)
        self._executor.add_node(self.node)
        observe(self.node, self.observed)

    def spin(self, duration_s: float, until: Callable[[], bool] | None = None) -> bool:
        """Listen for a while, or until a condition holds; whether it held."""
        end = time.monotonic() + duration_s
        while (left := end - time.monotonic()) > 0.0:
            if until is not None and until():
                return True
            with uninterrupted():
                self._executor.spin_once(timeout_sec=min(left, 0.05))
        return until is not None and until()

    def close(self) -> None:
        """End the node; safe to call twice."""
        if self._context.ok():
            with uninterrupted():
                self._executor.remove_node(self.node)
                self._executor.shutdown()
                self.node.destroy_node()
                rclpy.shutdown(context=self._context)


def _number(text: str) -> Any:
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text
