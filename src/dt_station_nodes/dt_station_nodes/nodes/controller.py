"""What both controllers share: samples and set-points in, commands out, the loop's configuration as parameters."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from rclpy.node import Node
from rclpy.subscription import Subscription

from dt_station_msgs.msg import PlantState, Setpoint, ValveCommand

from ..core import samples
from ..core.answering import Answering, AnsweringState
from ..core.channels import Channel
from ..core.control import LoopConfig
from . import convert, ready
from .diagnostics import Diagnostics, Health, Level
from .loop_parameters import load_loop, loop_from_values, loop_table
from .parameters import Parameter, ParameterSet
from .qos import SETPOINT_READER, STREAM
from .sending import send
from .standing import StandingSetpoint


@dataclass(frozen=True, slots=True)
class Wiring:
    """What tells one controller from the other: topics, default files, set-point at the start (Pa or m)."""

    channel: Channel
    setpoint_topic: str
    command_topic: str
    config: str
    alternatives: tuple[str, ...]
    setpoint: float


class Controller:
    """The node's own half; `core.answering` decides which sample is answered when."""

    ticker = None

    def __init__(self, node: Node, wiring: Wiring) -> None:
        files = ParameterSet(
            node,
            (
                *ready.TABLE,
                Parameter(
                    "config", wiring.config, "controller file, by path or name in config/controllers", fixed=True
                ),
                Parameter("alternatives", list(wiring.alternatives), "files of further modes to switch to", fixed=True),
                Parameter("sample_time_s", 0.02, "the bridge's sample time", "s", 1e-4, 60.0, fixed=True),
                Parameter("setpoint", wiring.setpoint, "set-point until one comes", wiring.channel.unit, fixed=True),
            ),
            dict,
        ).values
        self._node, self._wiring = node, wiring
        base = load_loop(files["config"], files["alternatives"])
        self._loop = ParameterSet(node, loop_table(base), lambda values: _build(base, values), self._apply)
        self._answering = Answering(wiring.channel, self._loop.config, files["sample_time_s"])
        self._state: AnsweringState = self._answering.initial_state(files["setpoint"])
        self._limited = 0
        self._publisher = node.create_publisher(ValveCommand, wiring.command_topic, STREAM)
        self._setpoints = node.create_subscription(
            Setpoint, wiring.setpoint_topic, self._on_setpoint, SETPOINT_READER, raw=True
        )
        self._standing = StandingSetpoint(
            node, wiring.setpoint_topic, self._take_setpoint, lambda: self._state.inbox.heard
        )
        self._diagnostics = Diagnostics(node, self._health)
        wanted = ready.parse_readers(files["wait_for_readers"])
        publishers = {wiring.command_topic: self._publisher}
        writers = ready.chosen(files["wait_for_writers"], {wiring.setpoint_topic: self._setpoints})
        self._gate = ready.ReadyGate(node, wanted, publishers, files["wait_timeout_s"], self._start, writers)

    def close(self) -> None:
        """Nothing to bring to rest: the bridge does."""

    def _start(self) -> Subscription:
        return self._node.create_subscription(PlantState, "object/state", self._on_state, STREAM, raw=True)

    def _apply(self, config: LoopConfig) -> None:
        self._answering, self._state = self._answering.reconfigured(config, self._state)

    def _on_setpoint(self, data: bytes) -> None:
        self._take_setpoint(convert.setpoint_from_bytes(data))

    def _take_setpoint(self, setpoint: samples.Setpoint) -> None:
        self._state, commands = self._answering.on_setpoint(self._state, setpoint)
        self._publish(commands)

    def _on_state(self, data: bytes) -> None:
        awaited = not self._state.inbox.heard and self._setpoints.get_publisher_count() > 0
        sample = convert.state_from_bytes(data)
        self._state, commands = self._answering.on_sample(self._state, sample, awaited)
        self._publish(commands)

    def _publish(self, commands: list[samples.ValveCommand]) -> None:
        for command in commands:
            send(self._node, self._publisher, convert.command_to_bytes(command))
            self._limited += command.limited

    def _health(self) -> Health:
        state = self._state
        values: Mapping[str, Any] = {
            "sequence": state.sequence,
            "mode": self._loop.config.mode.name.lower(),
            "setpoint": state.inbox.standing,
            "late_setpoints": state.late,
            "limited_samples": self._limited,
        }
        if not self._gate.ready:
            return Health(Level.OK, f"waiting for {', '.join(self._gate.missing())}", values)
        if state.late:
            return Health(Level.WARN, f"{state.late} samples answered with a held set-point", values)
        return Health(Level.OK, "controlling", values)


def _build(base: LoopConfig, values: Mapping[str, Any]) -> LoopConfig:
    return loop_from_values(base, values)
