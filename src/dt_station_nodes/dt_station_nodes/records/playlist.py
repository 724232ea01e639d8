"""A bag's messages in the order in which they have to be played: by stamp and sequence, not by arrival."""

import heapq
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from .bag import Bag
from .bagrun import PLANT_STATE, STATE
from .errors import RecordError
from .sequences import Kind, kind_of, sequence_number, stamp_ns

PACKAGE = "dt_station_msgs/msg/"
INPUTS = (STATE, "load/setpoint", "position/setpoint", "load/command", "position/command", "load/waveform",
          "position/waveform")  # fmt: skip
_HORIZON_NS = 20_000_000_000
# within one stamp: what was sent first comes first
_RANKS = {"PlantState": 0, "Waveform": 1, "Setpoint": 1, "ValveCommand": 2, "TwinModel": -1, "Residual": 4}
_TWIN_RANK, _OTHER_RANK = 3, 5


@dataclass(frozen=True, slots=True)
class PlayedMessage:
    """A serialized message and the time (ns, on the run's own axis) at which it is due."""

    due_ns: int
    topic: str
    sequence: int
    is_state: bool
    data: bytes


@dataclass(frozen=True, slots=True)
class _Track:
    kind: Kind
    rank: int
    is_state: bool


def _tracks(bag: Bag, topics: Sequence[str]) -> dict[str, _Track]:
    state = bag.find(STATE, PLANT_STATE)
    tracks = {}
    for name in topics:
        stored = bag.topics[name]
        msgtype = stored.info.msgtype
        own = msgtype.startswith(PACKAGE) and stored.encoding == "ros2msg"
        kind = kind_of(msgtype, stored.definition) if own and state is not None else Kind(False, False)
        rank = _RANKS.get(msgtype.rsplit("/", 1)[-1], _OTHER_RANK) if own else _OTHER_RANK
        if own and rank == 0 and name != state:
            rank = _TWIN_RANK
        tracks[name] = _Track(kind, rank, name == state)
    return tracks


def playlist(bag: Bag, topics: Sequence[str]) -> Iterator[PlayedMessage]:
    """Messages of the topics, in order.

    The station's own messages are due at their stamps; others at the stamp of the sample recorded before them, and
    in a bag without samples at the time they were recorded. Bounded memory: messages are sorted within a horizon.
    """
    tracks = _tracks(bag, topics)
    has_state = any(track.is_state for track in tracks.values())
    heap: list[tuple[int, int, int, PlayedMessage]] = []
    now: int | None = None
    early: list[tuple[str, bytes]] = []
    count = run = 0
    last_sequence = -1
    for message in bag.messages(topics):
        track = tracks[message.topic]
        sequence = sequence_number(message.data) if track.kind.numbered else 0
        if not has_state:
            yield PlayedMessage(message.log_time, message.topic, sequence, False, message.data)
            continue
        if track.is_state:
            if sequence <= last_sequence:
                # the numbering began anew: play what belongs to the run before first
                yield from _drain(heap)
                run += 1
            last_sequence = sequence
        stamp = stamp_ns(message.data) if track.kind.stamped else 0
        if track.is_state:
            now = stamp
        if now is None:
            early.append((message.topic, message.data))
            continue
        for topic, data in early:
            first = tracks[topic]
            number = sequence_number(data) if first.kind.numbered else 0
            # sent before the first sample: due just before it
            heapq.heappush(heap, (now - 1, first.rank, count, PlayedMessage(now - 1, topic, number, False, data)))
            count += 1
        early.clear()
        due = stamp if track.kind.stamped and stamp > 0 else now
        played = PlayedMessage(due, message.topic, sequence, track.is_state, message.data)
        heapq.heappush(heap, (due, track.rank, count, played))
        count += 1
        while heap and heap[0][0] < now - _HORIZON_NS:
            yield heapq.heappop(heap)[3]
    yield from _drain(heap)
    for topic, data in early:
        yield PlayedMessage(0, topic, 0, False, data)


def _drain(heap: list[tuple[int, int, int, PlayedMessage]]) -> Iterator[PlayedMessage]:
    while heap:
        yield heapq.heappop(heap)[3]


def stretch(bag: Bag, topics: Sequence[str], from_s: float, to_s: float) -> Iterator[PlayedMessage]:
    """The part of a playlist between two times (s from its start; `to_s` 0: to the end).

    What is said of a whole run, the twin's model, belongs to every part of it.
    """
    base: int | None = None
    for message in playlist(bag, topics):
        base = message.due_ns if base is None else base
        at_s = (message.due_ns - base) * 1e-9
        if to_s and at_s + 1e-9 >= to_s:
            return
        if at_s + 1e-9 >= from_s or (not message.is_state and message.topic.endswith("twin/model")):
            yield message


def choose(bag: Bag, wanted: Sequence[str], inputs_only: bool) -> list[str]:
    """Topics with messages to play: those that end as wanted, else the inputs of twin and shadow, or all."""
    known = [name for name, topic in bag.topics.items() if topic.info.count]
    if wanted:
        return [name for name in known if any(name == w or name.endswith("/" + w.lstrip("/")) for w in wanted)]
    chosen = [name for name in known if name.endswith(INPUTS)] if inputs_only else known
    return [name for name in chosen if not name.endswith(("/clock", "/parameter_events", "/rosout"))]


def renamed(topics: Sequence[str], remap: Sequence[str]) -> dict[str, str]:
    """Topic -> the name it is played under; `remap` are OLD:=NEW or OLD=NEW. Raises RecordError."""
    names = {topic: topic for topic in topics}
    for word in remap:
        old, _, new = word.partition(":=" if ":=" in word else "=")
        hits = [topic for topic in topics if topic == old or topic.endswith("/" + old.lstrip("/"))]
        if not new or not hits:
            raise RecordError(f"remap takes OLD=NEW with OLD among the topics played, got {word!r}")
        names.update(dict.fromkeys(hits, new))
    return names
