"""The twin: simulates the model beside the object, from set-points or from the voltages applied."""

import hashlib
from functools import partial
from typing import Any

from rclpy.node import Node
from rclpy.subscription import Subscription

from dt_station_msgs.msg import PlantState, Setpoint, TwinModel

from ..core import samples
from ..core.channels import Channel
from ..core.control import LoopController
from ..core.models import ModelSpec, PlantModel
from ..core.samples import PlantSample
from ..core.twin import CommandTwin
from ..core.twin_loops import TwinLoops
from . import convert, ready
from .configuration import find_config
from .diagnostics import Diagnostics, Health, Level
from .loop_parameters import load_loop, loop_table
from .parameters import ParameterSet
from .qos import LATCHED, SETPOINT_READER, STREAM
from .sending import send
from .spinning import run_node
from .stamps import to_stamp
from .standing import StandingSetpoint
from .twin_parameters import FILES, LIVE, TwinConfig, build

NAME = "twin_simulator"
_NOWHERE = PlantSample(0, 0, 0.0, 0.0, 0.0, 0.0)


class TwinSimulator:
    """The node's own half; the simulation is core's."""

    ticker = None

    def __init__(self, node: Node) -> None:
        self._node = node
        self._files = files = ParameterSet(node, FILES, dict).values
        text = find_config("models", files["model"]).read_text(encoding="utf-8")
        loops = {}
        if files["feed"] == "setpoints":
            loops["load."] = load_loop(files["load_config"])
            loops["position."] = load_loop(files["position_config"], files["alternatives"])
        table = (*LIVE, *(line for prefix, loop in loops.items() for line in loop_table(loop, prefix)))
        self._parameters = ParameterSet(node, table, lambda values: build(text, loops, values), self._apply)
        self._publisher = node.create_publisher(PlantState, "twin/state", STREAM)
        self._models = node.create_publisher(TwinModel, "twin/model", LATCHED)
        self._stamp_ns, self._sequence = 0, -1
        self._config = self._parameters.config
        self._make(self._config)
        setpoints: dict[str, Subscription] = {}
        self._setpoints: dict[Channel, Subscription] = {}
        if loops:
            for topic, channel in (("load/setpoint", Channel.PRESSURE), ("position/setpoint", Channel.POSITION)):
                setpoints[topic] = self._setpoints[channel] = node.create_subscription(
                    Setpoint, topic, partial(self._on_setpoint, channel), SETPOINT_READER, raw=True
                )
                StandingSetpoint(
                    node, topic, partial(self._take_setpoint, channel), partial(self._heard_setpoint, channel)
                )
        self._diagnostics = Diagnostics(node, self._health)
        wanted = ready.parse_readers(files["wait_for_readers"])
        publishers = {"twin/state": self._publisher}
        writers = ready.chosen(files["wait_for_writers"], setpoints)
        self._gate = ready.ReadyGate(node, wanted, publishers, files["wait_timeout_s"], self._start, writers)

    def close(self) -> None:
        """Nothing to bring to rest."""

    def _start(self) -> Subscription:
        return self._node.create_subscription(PlantState, "object/state", self._on_state, STREAM, raw=True)

    def _make(self, config: TwinConfig) -> None:
        sample_time_s = self._files["sample_time_s"]
        model = PlantModel(config.spec, sample_time_s)
        self._commands = CommandTwin(model, config.measured_pressure)
        self._state = self._commands.initial_state()
        # the compiled kernel is loaded now, not at the first sample
        self._commands.step(self._state, _NOWHERE)
        self._loops: TwinLoops | None = None
        if config.load is not None and config.position is not None:
            self._loops = TwinLoops(
                model, LoopController(config.load, sample_time_s), LoopController(config.position, sample_time_s)
            )
            self._loop_state = self._loops.initial_state()
        self._announce(config)

    def _announce(self, config: TwinConfig) -> None:
        digest = hashlib.sha256(config.text.encode()).hexdigest()
        message = TwinModel(name=config.spec.name, yaml=config.text, sha256=digest, feed=self._files["feed"])
        message.header.stamp = to_stamp(self._stamp_ns)
        send(self._node, self._models, message)

    def _apply(self, config: TwinConfig) -> None:
        before, self._config = self._config, config
        if config.text != before.text or config.measured_pressure != before.measured_pressure:
            self._make(config)
        elif self._loops is not None and config.load is not None and config.position is not None:
            self._loops, self._loop_state = self._loops.reconfigured(config.load, config.position, self._loop_state)

    def _on_setpoint(self, channel: Channel, data: bytes) -> None:
        self._take_setpoint(channel, convert.setpoint_from_bytes(data))

    def _take_setpoint(self, channel: Channel, setpoint: samples.Setpoint) -> None:
        if self._loops is not None:
            self._loop_state, done = self._loops.on_setpoint(self._loop_state, channel, setpoint)
            self._publish(done)

    def _heard_setpoint(self, channel: Channel) -> bool:
        return self._loops is not None and self._loop_state.inbox[channel].heard

    def _on_state(self, data: bytes) -> None:
        sample = convert.state_from_bytes(data)
        self._stamp_ns = sample.stamp_ns
        if self._loops is None:
            self._state, simulated = self._commands.step(self._state, sample)
            self._publish([simulated])
        else:
            heard = self._loop_state.inbox
            awaited = frozenset(c for c, s in self._setpoints.items() if not heard[c].heard and s.get_publisher_count())
            self._loop_state, done = self._loops.on_sample(self._loop_state, sample, awaited)
            self._publish(done)

    def _publish(self, simulated: list[Any]) -> None:
        for sample in simulated:
            self._sequence = sample.sequence
            send(self._node, self._publisher, convert.state_to_bytes(sample))

    def _health(self) -> Health:
        late = self._loop_state.late if self._loops is not None else 0
        values = {"sequence": self._sequence, "model": self._config.spec.name, "late_setpoints": late}
        if not self._gate.ready:
            return Health(Level.OK, f"waiting for {', '.join(self._gate.missing())}", values)
        if late:
            return Health(Level.WARN, f"{late} samples simulated with a held set-point", values)
        return Health(Level.OK, "simulating", values)


def make(node: Node) -> TwinSimulator:
    """The node's own half."""
    return TwinSimulator(node)


def preload() -> None:
    """Load the compiled kernel once for all nodes that are forked later."""
    spec = ModelSpec.from_yaml(find_config("models", "paper").read_text(encoding="utf-8"))
    twin = CommandTwin(PlantModel(spec, 0.02))
    twin.step(twin.initial_state(), _NOWHERE)


def main(args: list[str] | None = None) -> int:
    """Run the node."""
    return run_node(NAME, make, args)
