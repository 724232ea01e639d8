"""The metronome: samples the object, publishes sample k, writes the commands that answer it."""

import math
import time
from collections.abc import Mapping
from functools import partial

from rclpy.node import Node

from dt_station_msgs.msg import PlantState, Residual, ValveCommand

from ..core.channels import Channel
from ..core.metronome import Metronome, Pace
from ..core.samples import PlantSample, SampleFlag
from . import convert, ready
from .backends import backend_from
from .bridge_parameters import TABLE, awaited
from .bridge_statistics import BridgeStatistics
from .diagnostics import Diagnostics
from .parameters import ParameterSet
from .qos import STREAM
from .sending import send
from .spinning import run_node

NAME = "daq_bridge"
TOPIC = {Channel.PRESSURE: "load/command", Channel.POSITION: "position/command"}
FOLLOWERS = {"twin": ("twin/state", PlantState), "shadow": ("shadow/residual", Residual)}


class DaqBridge:
    """The node's own half: backend, metronome, publisher."""

    def __init__(self, node: Node) -> None:
        self._node = node
        values = ParameterSet(node, TABLE, dict).values
        self._delay = values["command_delay"]
        self._sample_time_s = values["sample_time_s"]
        self._last = round(values["duration_s"] / self._sample_time_s) or None
        self._exit = values["exit_at_end"]
        self._metronome = Metronome(
            self._sample_time_s,
            Pace(values["pace"]),
            awaited(values["expect"], values["followers"]),
            values["command_timeout_s"],
            values["patience"],
            values["max_lead"],
        )
        self._following = bool(values["followers"])
        self._state = self._metronome.start(0)
        self._backend = backend_from(values["backend"], values["backend_options"], self._sample_time_s)
        self._backend.open()
        self.running = self.ended = False
        self._applied = (0.0, 0.0)
        self._flags = SampleFlag.OK
        self._pending: Mapping[Channel, float] = {}
        self.statistics = BridgeStatistics(self._metronome.pace, self._sample_time_s)
        self._publisher = node.create_publisher(PlantState, "object/state", STREAM)
        inputs = {
            topic: node.create_subscription(ValveCommand, topic, partial(self._on_command, channel), STREAM, raw=True)
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
    def ticker(self) -> "DaqBridge":
        """The bridge is the one node with a clock."""
        return self

    def deadline_ns(self) -> int | None:
        """When the next sample is due or a silent controller is given up."""
        if not self.running:
            return None
        return 0 if self._metronome.due(self._state, time.perf_counter_ns()) else self._state.due_ns

    def tick(self) -> None:
        """Take the next sample if it is due, whatever has come in."""
        if self.running and self._metronome.due(self._state, time.perf_counter_ns()):
            self._take()

    def close(self) -> None:
        """Bring the object to rest."""
        self.running = False
        self._backend.close()

    def _start(self) -> None:
        # the first sample one period from now: the start itself must not count as lateness
        now = time.perf_counter_ns()
        lead = self._metronome.offset_ns(1) if self._metronome.pace is Pace.REALTIME else 0
        self._state = self._metronome.start(now + lead, self._following)
        self._stamp_ns = self._node.get_clock().now().nanoseconds + lead
        self.running = True
        self.statistics.start(now)

    def _take(self) -> None:
        if not self._state.answered:
            self._answer()
        now = time.perf_counter_ns()
        self._state, tick = self._metronome.take(self._state, now)
        flags = self._flags
        if tick.overrun(self._metronome.offset_ns(1)):
            flags |= SampleFlag.OVERRUN
        reading = self._backend.read()
        sequence = tick.sequence
        ended = reading.ended or sequence == self._last
        sample = PlantSample(
            sequence,
            self._stamp_ns + self._metronome.offset_ns(sequence),
            reading.position_m,
            reading.pressure_pa,
            *self._applied,
            flags | reading.flags | (SampleFlag.END if ended else SampleFlag.OK),
        )
        send(self._node, self._publisher, convert.state_to_bytes(sample))
        self.statistics.sampled(tick, now, sample.flags)
        if ended:
            self._end()
            return
        if self._delay:
            self._write(self._pending)
        if not self._state.answered and self._metronome.complete(self._state):
            self._answer()

    def _answer(self) -> None:
        self._state, answer = self._metronome.answer(self._state)
        now = time.perf_counter_ns()
        if self._state.sequence == 0 and self._metronome.pace is Pace.REALTIME:
            self._state = self._metronome.begin(self._state, now)
            self.statistics.start(now - self._metronome.offset_ns(1))
        else:
            self.statistics.answered(answer, now)
        self._flags = answer.flags
        if self._delay:
            self._pending = answer.voltage_v
        else:
            self._write(answer.voltage_v)

    def _write(self, voltage_v: Mapping[Channel, float]) -> None:
        applied = self._backend.write(voltage_v.get(Channel.PRESSURE, 0.0), voltage_v.get(Channel.POSITION, 0.0))
        self._applied = (applied.load_voltage_v, applied.servo_voltage_v)
        self._flags |= applied.flags

    def _on_command(self, channel: Channel, data: bytes) -> None:
        command = convert.command_from_bytes(data)
        # a command that is no number is none at all
        if not math.isfinite(command.voltage_v):
            return
        self._state = self._metronome.accept(self._state, channel, command)
        if not self.running or self._state.answered:
            return
        if self._metronome.complete(self._state):
            self._answer()
            self._go_on()

    def _on_follower(self, data: bytes) -> None:
        self._state = self._metronome.follow(self._state, convert.sequence_of(data))
        if self.running:
            self._go_on()

    def _go_on(self) -> None:
        if self._metronome.due(self._state, time.perf_counter_ns()):
            self._take()

    def _end(self) -> None:
        self.running, self.ended = False, True
        self.statistics.end(time.perf_counter_ns())
        self._backend.close()
        self._diagnostics.report()
        if self._exit:
            self._node.context.try_shutdown()


def make(node: Node) -> DaqBridge:
    """The node's own half."""
    return DaqBridge(node)


def main(args: list[str] | None = None) -> int:
    """Run the node."""
    return run_node(NAME, make, args)
