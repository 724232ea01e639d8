"""The bridge's loop against a clock that the test turns and an object that notes what it gets."""

import pytest

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.metronome import Metronome, Pace
from dt_station_nodes.core.samples import ControlMode, SampleFlag, ValveCommand
from dt_station_nodes.hardware import FakeBackend
from dt_station_nodes.nodes.sampling import Sampling

MS = 1_000_000


class Bench:
    """A loop, its object, what it published, and the clock (ns)."""

    def __init__(self, pace, last=None, delay=0, expected=frozenset(Channel), following=False, **settings):
        self.now, self.published, self.ends = 0, [], 0
        self.backend = FakeBackend()
        self.backend.open()
        metronome = Metronome(0.02, pace, expected, **settings)
        self.loop = Sampling(metronome, self.backend, self.published.append, self.end, last, delay, lambda: self.now)
        self.loop.start(1000, following)
        self.loop.tick()

    def end(self):
        self.ends += 1

    def answer(self, voltage=1.0, sequence=None):
        number = self.published[-1].sequence if sequence is None else sequence
        for channel in Channel:
            self.loop.on_command(channel, ValveCommand(number, 0, voltage, 0.0, ControlMode.PI, False))

    def at(self, milliseconds):
        self.now = round(milliseconds * MS)
        self.loop.tick()


def test_the_clock_starts_with_the_first_answer_and_holds_its_period():
    bench = Bench(Pace.REALTIME)
    bench.now = 7 * MS
    bench.answer()
    for k in range(1, 50):
        bench.at(7 + 20 * k - 0.1)
        assert len(bench.published) == k
        bench.at(7 + 20 * k)
        assert len(bench.published) == k + 1
        bench.now += 2 * MS
        bench.answer(float(k))
    assert [s.stamp_ns for s in bench.published] == [1000 + 20 * MS * k for k in range(50)]
    assert all(s.flags is SampleFlag.OK for s in bench.published)
    figures = bench.loop.statistics.values()
    assert (figures["missed_samples"], figures["overruns"]) == (0, 0)
    assert figures["latency_max_s"] == pytest.approx(2e-3)
    assert bench.backend.written[1:] == [(float(k), float(k)) for k in range(1, 50)]


def test_a_command_that_comes_after_the_next_sample_is_missed_once_and_then_used():
    bench = Bench(Pace.REALTIME)
    bench.answer(1.0)
    bench.at(20)
    bench.at(40)
    assert bench.published[-1].flags == SampleFlag.LOAD_COMMAND_MISSED | SampleFlag.POSITION_COMMAND_MISSED
    assert bench.published[-1].servo_voltage_v == 1.0
    bench.answer(5.0, sequence=1)
    bench.at(60)
    assert bench.published[-1].servo_voltage_v == 5.0
    assert bench.loop.statistics.values()["missed_samples"] == 2


def test_late_samples_are_flagged_and_caught_up():
    bench = Bench(Pace.REALTIME, expected=frozenset())
    bench.at(20)
    bench.at(71)
    bench.at(71)
    bench.at(71)
    assert [s.sequence for s in bench.published] == [0, 1, 2, 3]
    assert [SampleFlag.OVERRUN in s.flags for s in bench.published] == [False, False, True, True]
    assert bench.loop.deadline_ns() == 80 * MS


def test_a_standstill_of_the_machine_makes_a_sample_late_and_no_command_missed():
    bench = Bench(Pace.REALTIME)
    bench.answer(1.0)
    bench.at(20)
    bench.at(74)
    assert len(bench.published) == 2
    bench.now += 2 * MS
    bench.answer(2.0)
    assert bench.published[-1].sequence == 2
    assert bench.published[-1].servo_voltage_v == 2.0
    assert bench.published[-1].flags == SampleFlag.OVERRUN
    bench.at(77)
    bench.answer(3.0)
    bench.answer(4.0)
    bench.at(80)
    assert [s.sequence for s in bench.published] == [0, 1, 2, 3, 4]
    figures = bench.loop.statistics.values()
    assert (figures["missed_samples"], figures["excused_samples"], figures["overruns"]) == (0, 2, 2)
    assert figures["late_max_s"] == pytest.approx(36e-3)
    assert bench.loop.deadline_ns() == 100 * MS


def test_the_grace_after_a_standstill_is_short_and_given_once():
    bench = Bench(Pace.REALTIME)
    bench.answer(1.0)
    bench.at(20)
    bench.at(45)
    assert bench.loop.deadline_ns() == 50 * MS
    bench.at(50)
    assert bench.published[-1].sequence == 2
    assert SampleFlag.LOAD_COMMAND_MISSED in bench.published[-1].flags
    assert bench.loop.statistics.missed == 1
    bench.at(60)
    assert bench.loop.statistics.missed == 2


def test_lockstep_goes_as_fast_as_the_answers_and_ends_once():
    bench = Bench(Pace.LOCKSTEP, last=5)
    for k in range(5):
        bench.answer(float(k))
    assert [s.sequence for s in bench.published] == list(range(6))
    assert bench.published[-1].flags == SampleFlag.END
    assert (bench.ends, bench.loop.ended, bench.loop.running) == (1, True, False)
    assert not bench.backend.is_open
    bench.answer()
    bench.at(10**6)
    assert len(bench.published) == 6
    assert bench.loop.deadline_ns() is None


def test_lockstep_answers_a_silent_controller_in_time_and_waits_longer_for_a_follower():
    bench = Bench(Pace.LOCKSTEP, following=True, max_lead=1, command_timeout_s=1.0, follower_timeout_s=10.0)
    bench.at(1000)
    assert bench.loop.statistics.missed == 1
    assert len(bench.published) == 1
    bench.loop.on_follower(0)
    assert len(bench.published) == 2
    bench.answer()
    bench.at(10_999)
    assert len(bench.published) == 2
    bench.at(11_000)
    assert len(bench.published) == 3
    assert bench.loop.statistics.values()["followers_lost"] == 1


def test_lockstep_goes_on_when_the_follower_that_fell_listens_again():
    bench = Bench(Pace.LOCKSTEP, following=True, max_lead=1)
    bench.answer()
    assert len(bench.published) == 1
    bench.loop.on_reader()
    assert len(bench.published) == 2
    assert bench.loop.statistics.values()["followers_lost"] == 0


def test_commands_act_one_sample_later_where_the_card_latches():
    bench = Bench(Pace.LOCKSTEP, last=5, delay=1)
    for k in range(5):
        bench.answer(float(k + 1))
    assert [s.load_voltage_v for s in bench.published] == [0.0, 0.0, 1.0, 2.0, 3.0, 4.0]


@pytest.mark.parametrize("answered", [False, True])
def test_held_lockstep_takes_no_sample_however_long_and_blames_nobody_when_it_goes_on(answered):
    bench = Bench(Pace.LOCKSTEP, command_timeout_s=1.0, patience=1)
    bench.answer()
    taken = len(bench.published)
    bench.loop.hold(True)
    if answered:
        bench.answer()
    bench.at(60_000)
    assert bench.loop.deadline_ns() is None
    assert len(bench.published) == taken
    bench.loop.hold(False)
    if not answered:
        assert len(bench.published) == taken
        bench.answer()
    bench.answer()
    assert [s.sequence for s in bench.published] == list(range(taken + 2))
    assert all(s.flags is SampleFlag.OK for s in bench.published)


@pytest.mark.parametrize("expected", [frozenset(), frozenset(Channel)])
def test_lockstep_stops_before_a_given_sample_with_the_last_one_answered(expected):
    bench = Bench(Pace.LOCKSTEP, expected=expected)
    bench.loop.hold(False, 3)
    for _ in range(9):
        bench.answer(2.0) if expected else bench.loop.tick()
    assert [s.sequence for s in bench.published] == [0, 1, 2]
    bench.at(60_000)
    assert bench.loop.deadline_ns() is None
    bench.loop.hold(False, 4)
    assert [s.sequence for s in bench.published] == [0, 1, 2, 3]
    assert all(s.flags is SampleFlag.OK for s in bench.published)
    assert bench.published[-1].load_voltage_v == (2.0 if expected else 0.0)
    bench.loop.hold(True, 9)
    bench.loop.hold(True)
    assert len(bench.published) == 4


def test_a_controller_that_is_silent_after_the_hold_is_waited_for_as_long_as_ever():
    bench = Bench(Pace.LOCKSTEP, command_timeout_s=1.0)
    bench.at(300)
    bench.loop.hold(True)
    bench.at(10_000)
    bench.loop.hold(False)
    bench.at(10_699)
    assert len(bench.published) == 1
    bench.at(10_700)
    assert len(bench.published) == 2


def test_a_follower_is_not_run_away_from_because_of_a_hold():
    bench = Bench(Pace.LOCKSTEP, expected=frozenset(), following=True, max_lead=3)
    for _ in range(10):
        bench.loop.tick()
    assert len(bench.published) == 3
    bench.loop.hold(True)
    bench.at(60_000)
    bench.loop.hold(False)
    assert len(bench.published) == 3
    bench.loop.on_follower(1)
    assert len(bench.published) > 3
