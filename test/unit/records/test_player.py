"""Replay: order, pace, pause, steps, loops, stretches, and waiting for those who follow."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from dt_station_nodes.records import Bag, RecordError
from dt_station_nodes.records.pacing import Pace
from dt_station_nodes.records.player import Player
from dt_station_nodes.records.playlist import PlayedMessage, choose, playlist, renamed, stretch
from support import bags

MS = 1_000_000


def samples(count: int = 5) -> Iterator[PlayedMessage]:
    """A state and two messages that follow from it, every 20 ms."""
    for k in range(count):
        for topic in ("state", "setpoint", "command"):
            yield PlayedMessage(1_000_000_000 + k * 20 * MS, topic, k, topic == "state", b"")


class Stage:
    """A player, what it has played, and a clock."""

    def __init__(self, pace: Pace, **options: object) -> None:
        self.played: list[tuple[str, int]] = []
        self.player = Player(samples, lambda m: self.played.append((m.topic, m.sequence)), pace, **options)  # type: ignore[arg-type]
        self.player.start(0)

    def at(self, ms: float) -> int:
        self.player.tick(round(ms * MS))
        return len(self.played)


def test_real_time() -> None:
    stage = Stage(Pace(1.0))
    assert [stage.at(ms) for ms in (0, 19.9, 20, 45, 80)] == [3, 3, 6, 9, 15]
    assert stage.player.ended
    assert stage.played == [(m.topic, m.sequence) for m in samples()]


def test_the_next_deadline() -> None:
    stage = Stage(Pace(2.0))
    stage.at(0)
    assert stage.player.deadline_ns() == 10 * MS


@pytest.mark.parametrize(("rate", "expected"), [(2.0, [3, 6, 9]), (0.5, [3, 3, 3]), (0.0, [15, 15, 15])])
def test_rates(rate: float, expected: list[int]) -> None:
    stage = Stage(Pace(rate))
    assert [stage.at(ms) for ms in (0, 10, 20)] == expected


def test_the_rate_is_changed_while_playing() -> None:
    stage = Stage(Pace(1.0))
    assert stage.at(10) == 3
    stage.player.change(4.0, False, 10 * MS)
    assert [stage.at(ms) for ms in (12.4, 12.6, 17.6)] == [3, 6, 9]


def test_a_pause_stops_time() -> None:
    stage = Stage(Pace(1.0))
    stage.at(10)
    stage.player.change(1.0, True, 10 * MS)
    assert stage.player.deadline_ns() is None
    assert stage.at(500) == 3
    stage.player.change(1.0, False, 500 * MS)
    assert [stage.at(ms) for ms in (509, 511)] == [3, 6]


def test_steps_go_from_sample_to_sample() -> None:
    stage = Stage(Pace(1.0, paused=True))
    assert stage.at(100) == 0
    for k in range(3):
        assert stage.player.step()
        assert stage.player.deadline_ns() is not None
        stage.at(100)
        assert stage.played[-1] == ("state", k)
    stage.player.change(1.0, False, 0)
    assert not stage.player.step()


def test_a_loop_begins_anew() -> None:
    stage = Stage(Pace(1.0), loop=True)
    stage.at(81)
    stage.at(81)
    assert not stage.player.ended
    assert stage.at(200) > 20
    assert stage.played[15:18] == stage.played[:3]


def test_lockstep_waits_for_every_follower() -> None:
    stage = Stage(Pace(0.0), followers=["twin", "shadow"])
    assert stage.at(0) == 3
    stage.player.heard("twin", 0)
    assert stage.at(1) == 3
    stage.player.heard("shadow", 0)
    assert stage.at(2) == 6


def test_a_follower_that_is_silent_is_given_up_and_counted() -> None:
    stage = Stage(Pace(0.0), followers=["twin"], timeout_ns=100 * MS)
    assert [stage.at(ms) for ms in (0, 99, 101)] == [3, 3, 6]
    assert stage.player.unanswered == 1


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bag]:
    with Bag(bags.write_bag(tmp_path_factory.mktemp("bags") / "played", 60)) as opened:
        yield opened


def test_messages_are_played_in_order_of_stamp_and_cause(bag: Bag) -> None:
    played = list(playlist(bag, list(bag.topics)))
    assert len(played) == 240
    assert [m.due_ns for m in played] == sorted(m.due_ns for m in played)
    kinds = [m.topic for m in played[:4]]
    assert kinds[0] == bags.STATE
    assert kinds[-1] == bags.TWIN
    assert [m.sequence for m in played[::4]] == list(range(60))


def test_a_stretch(bag: Bag) -> None:
    played = list(stretch(bag, [bags.STATE], 0.2, 0.6))
    assert [m.sequence for m in played] == list(range(10, 30))


def test_topics_are_chosen_by_their_ends(bag: Bag) -> None:
    assert choose(bag, ["object/state"], False) == [bags.STATE]
    assert set(choose(bag, [], True)) == {bags.STATE, bags.LOAD, bags.POSITION}
    assert len(choose(bag, [], False)) == 4
    assert choose(bag, ["nothing"], False) == []


def test_remaps() -> None:
    topics = [bags.STATE, bags.TWIN]
    assert (
        renamed(topics, ["object/state:=/other"])
        == renamed(topics, ["object/state=/other"])
        == {bags.STATE: "/other", bags.TWIN: bags.TWIN}
    )
    for word in ("object/state", "nothing:=/x", "object/state:="):
        with pytest.raises(RecordError, match="OLD=NEW"):
            renamed(topics, [word])


def test_a_second_run_is_played_after_the_first(tmp_path: Path) -> None:
    with Bag(bags.write_bag(tmp_path / "two", 40, restart_at=25)) as two:
        numbers = [m.sequence for m in playlist(two, [bags.STATE])]
    assert numbers == [*range(25), *range(15)]
