"""The metronome: samples the object, publishes sample k, writes the commands that answer it."""

from collections.abc import Callable
from typing import Any

from rclpy.event_handler import PublisherEventCallbacks
from rclpy.node import Node

from dt_station_msgs.msg import PlantState, Residual, ValveCommand

from ..core.channels import Channel
from ..core.metronome import Metronome, Pace
from ..core.samples import PlantSample
from . import convert, ready
from .backends import backend_from
from .bridge_parameters import TABLE, awaited, checked, holding
from .bridge_statistics import BridgeStatistics
from .diagnostics import Diagnostics
from .parameters import ParameterSet
from .qos import STREAM
from .sampling import Sampling
from .sending import send
from .spinning import run_node

NAME = "daq_bridge"
TOPIC = {Channel.PRESSURE: "load/command", Channel.POSITION: "position/command"}
FOLLOWERS = {"twin": ("twin/state", PlantState), "shadow": ("shadow/residual", Residual)}


class DaqBridge:
    """The node's own half: topics and parameters around the loop of `sampling`."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._parameters = ParameterSet(node, TABLE, checked, lambda values: self._loop.hold(*holding(values)))
        values = self._parameters.values
        sample_time_s = values["sample_time_s"]
        metronome = Metronome(
            sample_time_s,
            Pace(values["pace"]),
            awaited(values["expect"], values["followers"]),
            values["command_timeout_s"],
            values["patience"],
            values["max_lead"],
            follower_timeout_s=values["follower_timeout_s"],
        )
        self._following = bool(values["followers"])
        self._exit = values["exit_at_end"]
        backend = backend_from(values["backend"], values["backend_options"], sample_time_s)
        backend.open()
        last = round(values["duration_s"] / sample_time_s) or None
        self._loop = Sampling(metronome, backend, self._publish, self._on_end, last, values["command_delay"])
        self._publisher = node.create_publisher(
            PlantState, "object/state", STREAM, event_callbacks=PublisherEventCallbacks(matched=self._on_reader)
        )
        inputs = {
            topic: node.create_subscription(ValveCommand, topic, self._command_callback(channel), STREAM, raw=True)
            for channel, topic in TOPIC.items()
        }
        for name in values["followers"]:
            topic, kind = FOLLOWERS[name]
            inputs[topic] = node.create_subscription(kind, topic, self._on_follower, STREAM, raw=True)
        self._diagnostics = Diagnostics(node, lambda: self.statistics.health(self.running, self.ended))
        self._gate = ready.ReadyGate(
            node,
            ready.parse_readers(values["wait_for_readers"]),
            {"object/state": self._publisher},
            values["wait_timeout_s"],
            self._start,
            ready.chosen(values["wait_for_writers"], inputs),
            values["wait_for_nodes"],
        )

    @property
    def ticker(self) -> Sampling:
        """The bridge is the one node with a clock."""
        return self._loop

    @property
    def statistics(self) -> BridgeStatistics:
        """What was counted so far."""
        return self._loop.statistics

    @property
    def running(self) -> bool:
        """Whether samples are being taken."""
        return self._loop.running

    @property
    def ended(self) -> bool:
        """Whether the last sample was taken."""
        return self._loop.ended

    def close(self) -> None:
        """Bring the object to rest."""
        self._loop.stop()

    def _start(self) -> None:
        self._loop.hold(*holding(self._parameters.values))
        self._loop.start(self._node.get_clock().now().nanoseconds, self._following)

    def _publish(self, sample: PlantSample) -> None:
        send(self._node, self._publisher, convert.state_to_bytes(sample))

    def _command_callback(self, channel: Channel) -> Callable[[bytes], None]:
        return lambda data: self._loop.on_command(channel, convert.command_from_bytes(data))

    def _on_follower(self, data: bytes) -> None:
        self._loop.on_follower(convert.sequence_of(data))

    def _on_reader(self, status: Any) -> None:
        if status.current_count_change > 0:
            self._loop.on_reader()

    def _on_end(self) -> None:
        self._diagnostics.report()
        if self._exit:
            self._node.context.try_shutdown()


def make(node: Node) -> DaqBridge:
    """The node's own half."""
    return DaqBridge(node)


def main(args: list[str] | None = None) -> int:
    """Run the node."""
    return run_node(NAME, make, args)
