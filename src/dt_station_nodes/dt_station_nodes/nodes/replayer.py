"""Plays a bag back into the graph: in order of sequence and stamp, paced by a clock or by those who follow."""

import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from rclpy.node import Node
from rosgraph_msgs.msg import Clock as ClockMessage
from std_srvs.srv import Trigger

from ..core.errors import StationError
from ..records import Bag
from ..records.pacing import Pace
from ..records.playlist import INPUTS, PlayedMessage, playlist
from . import convert, ready
from .diagnostics import Diagnostics, Health, Level
from .parameters import Parameter, ParameterError, ParameterSet
from .qos import STREAM
from .recorded_topics import message_class, writer_qos
from .spinning import run_node
from .stamps import to_stamp

NAME = "replayer"
FOLLOWERS = {
    "twin": ("twin/state", "dt_station_msgs/msg/PlantState"),
    "shadow": ("shadow/residual", "dt_station_msgs/msg/Residual"),
}
TABLE = (
    *ready.TABLE,
    Parameter("bag", "", "the bag to play", fixed=True),
    Parameter("topics", [], "topics to play; none: all, or in lockstep the inputs of twin and shadow", fixed=True),
    Parameter("remap", [], "topics to play under another name, each OLD:=NEW", fixed=True),
    Parameter("rate", 1.0, "speed; 0: as fast as possible", "1", 0.0, 1e6),
    Parameter("paused", False, "stand still; ~/step then plays one sample"),
    Parameter("from_s", 0.0, "start of the stretch played", "s", 0.0, 1e9, fixed=True),
    Parameter("to_s", 0.0, "end of the stretch played; 0: the bag's end", "s", 0.0, 1e9, fixed=True),
    Parameter("loop", False, "begin anew at the end", fixed=True),
    Parameter("clock", True, "publish /clock", fixed=True),
    Parameter("followers", [], "lockstep: those whose answers are waited for: twin, shadow", fixed=True),
    Parameter("follow_timeout_s", 2.0, "lockstep: how long an answer is waited for", "s", 1e-3, 600.0, fixed=True),
    Parameter("least_readers", 1, "readers of every topic to wait for", "readers", 0, 100, fixed=True),
    Parameter("exit_at_end", True, "end the process after the last message", fixed=True),
)  # fmt: skip


class Replayer:
    """The node's own half: publishers, and a ticker that plays what is due."""

    def __init__(self, node: Node) -> None:
        self._node = node
        parameters = ParameterSet(node, TABLE, _checked, self._repace)
        values = self._values = parameters.values
        self._bag = Bag(values["bag"])
        self._topics = self._choose()
        self._pace = Pace(values["rate"], values["paused"])
        self._steps, self.ended, self.played, self._late_follows = 0, False, 0, 0
        self._last_due, self._waiting_for = 0, -1
        self._base: int | None = None
        self._answered = dict.fromkeys(values["followers"], -1)
        self._deadline_ns: int | None = None
        self._names = _renamed(self._topics, values["remap"])
        self._publishers = {name: self._publisher(name) for name in self._topics}
        self._clock = node.create_publisher(ClockMessage, "/clock", 10) if values["clock"] else None
        for name in values["followers"]:
            topic, msgtype = FOLLOWERS[name]
            node.create_subscription(message_class(msgtype), topic, self._follower(name), STREAM, raw=True)
        node.create_service(Trigger, "~/step", self._step)
        self._messages = self._stretch()
        self._next: PlayedMessage | None = None
        self._diagnostics = Diagnostics(node, self._health)
        least = values["least_readers"]
        wanted = {self._names[t]: least for t in self._topics if least and t.endswith(INPUTS)}
        wanted |= ready.parse_readers(values["wait_for_readers"])
        publishers = {self._names[topic]: publisher for topic, publisher in self._publishers.items()}
        publishers |= {name.removeprefix(node.get_namespace() + "/"): p for name, p in publishers.items()}
        self._gate = ready.ReadyGate(node, wanted, publishers, values["wait_timeout_s"], self._start)

    @property
    def ticker(self) -> "Replayer":
        """The replayer has a clock of its own."""
        return self

    def close(self) -> None:
        """Close the bag."""
        self._bag.close()

    def deadline_ns(self) -> int | None:
        """When the next message is due, or a follower is given up."""
        if not self._gate.ready or self.ended or self._next is None:
            return None
        if self._held():
            return self._deadline_ns
        if self._pace.paused and not self._steps:
            return None
        return time.perf_counter_ns() if self._steps else self._pace.wall_of(self._next.due_ns)

    def tick(self) -> None:
        """Play what is due."""
        now = time.perf_counter_ns()
        if self._held():
            if self._deadline_ns is not None and now >= self._deadline_ns:
                self._late_follows += 1
                self._answered = dict.fromkeys(self._answered, self._waiting_for)
            return
        while self._next is not None and not self._held():
            message = self._next
            if self._steps:
                if message.is_state:
                    self._steps -= 1
            elif self._pace.paused or self._pace.wall_of(message.due_ns) > time.perf_counter_ns():
                return
            self._play(message)
            self._advance()
            if message.is_state and self._steps == 0 and self._pace.paused:
                return

    def _play(self, message: PlayedMessage) -> None:
        if self._clock is not None and message.due_ns > self._last_due:
            self._clock.publish(ClockMessage(clock=to_stamp(message.due_ns)))
        self._last_due = message.due_ns
        self._publishers[message.topic].publish(message.data)
        self.played += 1
        if message.is_state and self._answered:
            self._waiting_for = message.sequence
            self._answered = dict.fromkeys(self._answered, -1)
            self._deadline_ns = time.perf_counter_ns() + round(self._values["follow_timeout_s"] * 1e9)

    def _held(self) -> bool:
        """Whether the next sample has to wait for an answer to the last one; what is not a sample need not."""
        if self._next is None or not self._next.is_state:
            return False
        return any(number < self._waiting_for for number in self._answered.values())

    def _follower(self, name: str) -> Any:
        def heard(data: bytes) -> None:
            self._answered[name] = max(self._answered[name], convert.sequence_of(data))
            if self._gate.ready and not self._held():
                self.tick()

        return heard

    def _start(self) -> None:
        self._advance()
        if self._next is not None:
            self._pace = self._pace.anchored(time.perf_counter_ns(), self._next.due_ns)

    def _advance(self) -> None:
        self._next = next(self._messages, None)
        if self._next is None and self._values["loop"] and self.played:
            self._messages = self._stretch()
            self._next = next(self._messages, None)
            if self._next is not None:
                self._last_due = 0
                self._pace = self._pace.anchored(time.perf_counter_ns(), self._next.due_ns)
        if self._next is None:
            self.ended = True
            self._diagnostics.report()
            if self._values["exit_at_end"]:
                # what was published last must reach its readers first
                self._node.create_timer(0.3, self._node.context.try_shutdown)

    def _stretch(self) -> Iterator[PlayedMessage]:
        start, stop = self._values["from_s"], self._values["to_s"]
        for message in playlist(self._bag, self._topics):
            if self._base is None:
                self._base = message.due_ns
            at = (message.due_ns - self._base) * 1e-9
            # latched words about the run belong to every stretch of it
            if at + 1e-9 >= start or (not message.is_state and message.topic.endswith("twin/model")):
                if stop and at + 1e-9 >= stop:
                    return
                yield message

    def _choose(self) -> list[str]:
        wanted = self._values["topics"]
        known = [name for name, topic in self._bag.topics.items() if topic.info.count]
        if not wanted:
            chosen = [n for n in known if n.endswith(INPUTS)] if self._values["followers"] else known
            chosen = [name for name in chosen if not name.endswith(("/clock", "/parameter_events", "/rosout"))]
        else:
            chosen = [name for name in known if any(name == w or name.endswith("/" + w.lstrip("/")) for w in wanted)]
        if not chosen:
            raise ParameterError(
                f"{self._values['bag']}: nothing to play; the bag has {', '.join(known) or 'no messages'}"
            )
        return chosen

    def _publisher(self, name: str) -> Any:
        stored = self._bag.topics[name]
        return self._node.create_publisher(
            message_class(stored.info.msgtype), self._names[name], writer_qos(stored.info.qos)
        )

    def _repace(self, values: Mapping[str, Any]) -> None:
        self._values = dict(values)
        self._pace = self._pace.changed(values["rate"], values["paused"], time.perf_counter_ns(), self._last_due)

    def _step(self, _: Any, response: Any) -> Any:
        response.success = self._pace.paused and not self.ended
        response.message = "one sample" if response.success else "set paused first, and do not step past the end"
        self._steps += response.success
        return response

    def _health(self) -> Health:
        values = {"played": self.played, "stamp_ns": self._last_due, "answers_missed": self._late_follows}
        if self._late_follows:
            return Health(Level.ERROR, f"{self._late_follows} samples were not answered in time", values)
        if not self._gate.ready:
            return Health(Level.OK, f"waiting for readers: {', '.join(self._gate.missing())}", values)
        return Health(Level.OK, "ended" if self.ended else "paused" if self._pace.paused else "playing", values)


def _renamed(topics: list[str], remap: list[str]) -> dict[str, str]:
    names = {topic: topic for topic in topics}
    for word in remap:
        old, _, new = word.partition(":=")
        hits = [topic for topic in topics if topic == old or topic.endswith("/" + old.lstrip("/"))]
        if not new or not hits:
            raise ParameterError(f"remap takes OLD:=NEW with OLD among the topics played, got {word!r}")
        names.update(dict.fromkeys(hits, new))
    return names


def _checked(values: Mapping[str, Any]) -> Mapping[str, Any]:
    if not values["bag"] or not Path(values["bag"]).exists():
        raise ParameterError(f"there is no bag {values['bag']!r}; name one, such as -p bag:=runs/demo/pid")
    if values["to_s"] and values["to_s"] <= values["from_s"]:
        raise ParameterError(f"to_s {values['to_s']:g} is not after from_s {values['from_s']:g}")
    unknown = sorted(set(values["followers"]) - set(FOLLOWERS))
    if unknown:
        raise StationError(f"followers takes twin and shadow, got {unknown[0]!r}")
    return values


def main(args: list[str] | None = None) -> int:
    """Run the node."""
    return run_node(NAME, Replayer, args)
