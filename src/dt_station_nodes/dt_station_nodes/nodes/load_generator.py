"""Plays a waveform as the set-point of one channel; used for load and for position."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from rclpy.event_handler import PublisherEventCallbacks
from rclpy.node import Node
from rclpy.subscription import Subscription

from dt_station_msgs.msg import PlantState, Setpoint, Waveform

from ..core import samples, waveforms
from ..core.setpoint_stream import SetpointStream
from . import convert, ready
from .diagnostics import Diagnostics, Health, Level
from .parameters import Parameter, ParameterError, ParameterSet
from .qos import LATCHED, SETPOINT_WRITER, STREAM, WAVEFORM
from .sending import send
from .spinning import run_node

NAME = "load_generator"
SHAPES = {shape.name.lower(): shape for shape in waveforms.Shape}

TABLE = (
    *ready.TABLE,
    Parameter("channel", "load", "whose set-point is played", choices=("load", "position"), fixed=True),
    Parameter("sample_time_s", 0.02, "the bridge's sample time", "s", 1e-4, 60.0, fixed=True),
    Parameter("enabled", True, "off: the last value stands, and others may publish the set-point"),
    Parameter("shape", "constant", "form of the waveform", choices=tuple(SHAPES)),
    Parameter("amplitude", 0.0, "half of peak to peak", "Pa or m", 0.0, 1e9),
    Parameter("offset", 0.0, "middle of the waveform", "Pa or m", -1e9, 1e9),
    Parameter("frequency_hz", 0.25, "frequency", "Hz", 1e-6, 1e4),
    Parameter("phase_rad", 0.0, "added to the running phase", "rad", -1e3, 1e3),
    Parameter("duty", 0.5, "share of the period spent high (square) or rising (triangle, sawtooth)", "1", 0.0, 1.0),
)


@dataclass(frozen=True, slots=True)
class GeneratorConfig:
    """What is played, and whether."""

    channel: str
    sample_time_s: float
    enabled: bool
    waveform: waveforms.Waveform


def _build(values: Mapping[str, Any]) -> GeneratorConfig:
    waveform = waveforms.Waveform(
        SHAPES[values["shape"]],
        *(values[name] for name in ("amplitude", "offset", "frequency_hz", "phase_rad", "duty")),
    )
    return GeneratorConfig(values["channel"], values["sample_time_s"], values["enabled"], waveform)


class LoadGenerator:
    """The node's own half: parameters, waveform topic, set-point publisher."""

    ticker = None

    def __init__(self, node: Node) -> None:
        self._node = node
        self._parameters = ParameterSet(node, TABLE, _build, self._apply)
        config = self._config = self._parameters.config
        self._stream = SetpointStream(config.sample_time_s)
        self._state = self._stream.initial_state(config.waveform)
        self._value = config.waveform.offset
        self._sequence, self._since, self._refused = -1, 0, ""
        topic = f"{config.channel}/setpoint"
        # readers that ask for history do not match the stream, which is no mistake: the latched writer is for them
        silent = PublisherEventCallbacks(use_default_callbacks=False)
        self._publisher = node.create_publisher(Setpoint, topic, SETPOINT_WRITER, event_callbacks=silent)
        self._latched = node.create_publisher(Setpoint, topic, LATCHED)
        node.create_subscription(Waveform, f"{config.channel}/waveform", self._on_waveform, WAVEFORM)
        self._diagnostics = Diagnostics(node, self._health)
        values = self._parameters.values
        wanted = ready.parse_readers(values["wait_for_readers"])
        self._gate = ready.ReadyGate(node, wanted, {topic: self._publisher}, values["wait_timeout_s"], self._start)

    def close(self) -> None:
        """Nothing to bring to rest."""

    def _start(self) -> Subscription:
        if not self._config.enabled:
            self._publish_standing(0)
        return self._node.create_subscription(PlantState, "object/state", self._on_state, STREAM, raw=True)

    def _apply(self, config: GeneratorConfig) -> None:
        if self._config.enabled and not config.enabled and self._sequence >= 0:
            self._publish_standing(0)
        self._config, self._since = config, self._state.upcoming
        # whoever asked for it waits to hear from which sample on it plays
        self._diagnostics.report()

    def _on_state(self, data: bytes) -> None:
        sample = convert.state_from_bytes(data)
        self._sequence = sample.sequence
        if not self._config.enabled:
            return
        self._state, sent = self._stream.step(self._state, sample.sequence, self._config.waveform)
        for number, self._value in sent:
            self._publish(number, sample.stamp_ns)

    def _publish(self, number: int, stamp_ns: int) -> None:
        setpoint = samples.Setpoint(number, stamp_ns, self._value, True)
        send(self._node, self._publisher, convert.setpoint_to_bytes(setpoint))

    def _publish_standing(self, stamp_ns: int) -> None:
        send(self._node, self._latched, convert.setpoint_to_bytes(samples.Setpoint(0, stamp_ns, self._value, False)))

    def _on_waveform(self, message: Waveform) -> None:
        try:
            shape = waveforms.Shape(message.shape).name.lower()
            changes = {
                "shape": shape,
                "amplitude": message.amplitude,
                "offset": message.offset,
                "phase_rad": message.phase,
                "duty": message.duty,
            }
            if message.frequency > 0.0 or shape != "constant":
                changes["frequency_hz"] = message.frequency
            if not all(math.isfinite(value) for value in changes.values() if isinstance(value, float)):
                raise ParameterError("a waveform's values must be finite numbers")
            self._parameters.set(changes)
            self._refused = ""
        except ValueError as error:
            self._refused = f"refused waveform: {error}"
            self._node.get_logger().warning(self._refused)

    def _health(self) -> Health:
        values: dict[str, Any] = {"sequence": self._sequence, "value": self._value, "since": self._since}
        values["shape"] = self._config.waveform.shape.name.lower()
        if self._refused:
            return Health(Level.WARN, self._refused, values)
        if not self._gate.ready:
            return Health(Level.OK, f"waiting for {', '.join(self._gate.missing())}", values)
        return Health(Level.OK, "playing" if self._config.enabled else "off", values)


def make(node: Node) -> LoadGenerator:
    """The node's own half."""
    return LoadGenerator(node)


def main(args: list[str] | None = None) -> int:
    """Run the node."""
    return run_node(NAME, make, args)
