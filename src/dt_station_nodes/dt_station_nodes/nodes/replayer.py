"""Plays a bag back into the graph: in order of sequence and stamp, paced by a clock or by those who follow."""

import time
from collections.abc import Mapping
from functools import partial
from typing import Any

from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rosgraph_msgs.msg import Clock as ClockMessage
from std_srvs.srv import Trigger

from ..records import Bag
from ..records.bagrun import STATE
from ..records.pacing import Pace
from ..records.player import Player
from ..records.playlist import INPUTS, PlayedMessage, choose, renamed, stretch
from . import convert, ready
from .diagnostics import Diagnostics, Health, Level
from .parameters import ParameterError, ParameterSet
from .qos import STREAM
from .recorded_topics import message_class, writer_qos
from .replay_parameters import FOLLOWERS, TABLE, checked
from .spinning import run_node
from .stamps import to_stamp

NAME = "replayer"
# what was published last must reach its readers before the process ends, and what is first find all of them
_SETTLE_S = 0.3
# a reader of the samples may be a moment from reading the other inputs too, but need not read all of them
_GRACE_S = 2.0


class Replayer:
    """The node's own half: publishers, and the player's clock."""

    def __init__(self, node: Node) -> None:
        self._node = node
        values = self._values = ParameterSet(node, TABLE, checked, self._change).values
        self._bag = Bag(values["bag"])
        followers = values["followers"]
        topics = choose(self._bag, values["topics"], bool(followers))
        if not topics:
            held = ", ".join(self._bag.topics) or "no topic"
            raise ParameterError(f"{values['bag']}: nothing to play; the bag has {held}")
        self._names = names = renamed(topics, values["remap"])
        self._publishers = {topic: self._publisher(topic) for topic in topics}
        self._clock = node.create_publisher(ClockMessage, "/clock", 10) if values["clock"] else None
        self._player = Player(
            lambda: stretch(self._bag, topics, values["from_s"], values["to_s"]),
            self._play,
            Pace(values["rate"], values["paused"]),
            followers,
            round(values["follow_timeout_s"] * 1e9),
            values["loop"],
        )
        for name in followers:
            topic, msgtype = FOLLOWERS[name]
            node.create_subscription(message_class(msgtype), topic, partial(self._heard, name), STREAM, raw=True)
        node.create_service(Trigger, "~/step", self._step)
        self._diagnostics = Diagnostics(node, self._health)
        first = [topic for topic in topics if topic.endswith(STATE)] or topics
        wanted = {names[topic]: values["least_readers"] for topic in first}
        wanted |= ready.parse_readers(values["wait_for_readers"])
        self._gate = ready.ReadyGate(node, wanted, self._by_name(), values["wait_timeout_s"], self._settle)

    @property
    def ticker(self) -> "Replayer":
        """The replayer has a clock of its own."""
        return self

    def close(self) -> None:
        """Close the bag."""
        self._bag.close()

    def deadline_ns(self) -> int | None:
        """When the next message is due, or a follower is given up."""
        return self._player.deadline_ns()

    def tick(self) -> None:
        """Play what is due."""
        was_over = self._player.ended
        self._player.tick(time.perf_counter_ns())
        if self._player.ended and not was_over:
            self._end()

    def _by_name(self) -> dict[str, Any]:
        """Publishers by the names a user may write, with and without the namespace."""
        full = {self._names[topic]: publisher for topic, publisher in self._publishers.items()}
        space = self._node.get_namespace() + "/"
        return {**full, **{name.removeprefix(space): publisher for name, publisher in full.items()}}

    def _settle(self) -> None:
        now = time.monotonic()
        self._given_up, self._graced = now + self._values["wait_timeout_s"], now + _GRACE_S
        self._timer = self._later(self._start)

    def _start(self) -> None:
        deaf = [name for name in self._values["followers"] if not self._listens(name)]
        if deaf and time.monotonic() < self._given_up:
            return
        if deaf:
            self._node.get_logger().warning(f"going on without {', '.join(deaf)}")
        if self._values["least_readers"] and time.monotonic() < self._graced:
            inputs = [publisher for topic, publisher in self._publishers.items() if topic.endswith(INPUTS)]
            if not all(publisher.get_subscription_count() for publisher in inputs):
                return
        self._timer.cancel()
        self._player.start(time.perf_counter_ns())
        if self._player.ended:
            self._end()

    def _listens(self, follower: str) -> bool:
        """Whether the node that answers is listening to what is played."""
        node = self._node
        answering = {info.node_name for info in node.get_publishers_info_by_topic(FOLLOWERS[follower][0])}
        played = [p.topic_name for topic, p in self._publishers.items() if topic.endswith(STATE)]
        listening = {info.node_name for name in played for info in node.get_subscriptions_info_by_topic(name)}
        return not played or bool(answering & listening)

    def _end(self) -> None:
        self._diagnostics.report()
        if self._values["exit_at_end"]:
            self._timer = self._later(self._node.context.try_shutdown)

    def _later(self, callback: Any) -> Any:
        return self._node.create_timer(_SETTLE_S, callback, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _play(self, message: PlayedMessage) -> None:
        if self._clock is not None and message.due_ns > self._player.last_due_ns:
            self._clock.publish(ClockMessage(clock=to_stamp(message.due_ns)))
        self._publishers[message.topic].publish(message.data)

    def _heard(self, follower: str, data: bytes) -> None:
        self._player.heard(follower, convert.sequence_of(data))
        if self._player.started:
            self.tick()

    def _publisher(self, topic: str) -> Any:
        info = self._bag.topics[topic].info
        return self._node.create_publisher(message_class(info.msgtype), self._names[topic], writer_qos(info.qos))

    def _change(self, values: Mapping[str, Any]) -> None:
        self._player.change(values["rate"], values["paused"], time.perf_counter_ns())

    def _step(self, _: Any, response: Any) -> Any:
        response.success = self._player.step()
        response.message = "one sample" if response.success else "set paused first; there is no step past the end"
        return response

    def _health(self) -> Health:
        player = self._player
        values = {"played": player.played, "stamp_ns": player.last_due_ns, "unanswered": player.unanswered}
        if player.unanswered:
            return Health(Level.ERROR, f"{player.unanswered} samples were not answered in time", values)
        if not self._gate.ready:
            return Health(Level.OK, f"waiting for readers: {', '.join(self._gate.missing())}", values)
        return Health(Level.OK, "ended" if player.ended else "paused" if player.pace.paused else "playing", values)


def main(args: list[str] | None = None) -> int:
    """Run the node."""
    return run_node(NAME, Replayer, args)
