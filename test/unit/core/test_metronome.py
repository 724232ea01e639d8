"""The metronome with a clock that the test turns."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.metronome import Metronome, MetronomeError, Pace
from dt_station_nodes.core.samples import ControlMode, SampleFlag, ValveCommand

MS = 1_000_000
BOTH = tuple(Channel)


def command(sequence, voltage=1.0):
    return ValveCommand(sequence, 0, voltage, 0.0, ControlMode.PI, False)


def taken(metronome, now=0, **start):
    state, _ = metronome.take(metronome.start(0, **start), now)
    return state


def test_realtime_schedule_does_not_drift_for_a_period_that_is_no_whole_number_of_nanoseconds():
    metronome = Metronome(1.0 / 3.0, Pace.REALTIME)
    state = metronome.start(100)
    for k in range(3000):
        now = state.due_ns
        state, tick = metronome.take(state, now)
        assert tick.sequence == k
        assert tick.late_ns == 0
        state, _ = metronome.answer(state)
        state = metronome.begin(state, 100) if k == 0 else state
    assert state.due_ns == 100 + 1000 * 1_000_000_000


def test_lockstep_goes_on_when_both_commands_are_in_and_not_before():
    metronome = Metronome(0.02, Pace.LOCKSTEP)
    state = taken(metronome)
    assert not metronome.due(state, MS)
    state = metronome.accept(state, Channel.PRESSURE, command(0))
    assert metronome.missing(state) == (Channel.POSITION,)
    state = metronome.accept(state, Channel.POSITION, command(0, 2.0))
    assert metronome.complete(state)
    assert metronome.due(state, MS)
    state, answer = metronome.answer(state)
    assert answer.voltage_v == {Channel.PRESSURE: 1.0, Channel.POSITION: 2.0}
    assert answer.flags is SampleFlag.OK


def test_a_missing_command_is_held_flagged_and_never_a_hang():
    metronome = Metronome(0.02, Pace.LOCKSTEP, command_timeout_s=1.0)
    state = metronome.accept(taken(metronome), Channel.PRESSURE, command(0, 3.0))
    state = metronome.accept(state, Channel.POSITION, command(0, 4.0))
    state, _ = metronome.take(metronome.answer(state)[0], 10)
    state = metronome.accept(state, Channel.POSITION, command(1, 5.0))
    assert not metronome.due(state, 999 * MS)
    assert metronome.due(state, 1001 * MS)
    state, answer = metronome.answer(state)
    assert answer.voltage_v == {Channel.PRESSURE: 3.0, Channel.POSITION: 5.0}
    assert answer.flags == SampleFlag.LOAD_COMMAND_MISSED


def test_a_silent_controller_is_waited_for_a_few_times_only_and_welcome_again():
    metronome = Metronome(0.02, Pace.LOCKSTEP, patience=3)
    state = metronome.start(0)
    waits = 0
    for _ in range(6):
        state, _ = metronome.take(state, 0)
        waits += not metronome.complete(state)
        state, answer = metronome.answer(state)
        assert answer.missed == BOTH
    assert waits == 3
    state, _ = metronome.take(state, 0)
    for channel in BOTH:
        state = metronome.accept(state, channel, command(6))
    state, _ = metronome.take(metronome.answer(state)[0], 0)
    assert not metronome.complete(state)


def test_one_started_anew_that_runs_after_the_samples_is_waited_for_once_more():
    metronome = Metronome(0.02, Pace.LOCKSTEP, frozenset({Channel.PRESSURE}), patience=3)
    state = metronome.start(0)
    for _ in range(5):
        state, _ = metronome.take(state, 0)
        state, _ = metronome.answer(state)
    state, _ = metronome.take(state, 0)
    assert metronome.complete(state)
    late = metronome.accept(state, Channel.PRESSURE, command(4))
    assert not metronome.complete(late)
    # it hears the sample that is out and answers it
    caught_up = metronome.accept(late, Channel.PRESSURE, command(5))
    state, answer = metronome.answer(caught_up)
    assert answer.missed == ()
    # or it does not, and is not waited for again
    state, _ = metronome.take(metronome.answer(late)[0], 0)
    assert metronome.complete(state)


def test_commands_of_an_earlier_run_and_old_ones_are_ignored():
    metronome = Metronome(0.02, Pace.REALTIME)
    state = taken(metronome)
    assert metronome.accept(state, Channel.PRESSURE, command(7)) is state
    state = metronome.accept(state, Channel.PRESSURE, command(0, 1.0))
    assert metronome.accept(state, Channel.PRESSURE, command(0, 2.0)) is state


def test_channels_without_controller_are_neither_waited_for_nor_flagged():
    metronome = Metronome(0.02, Pace.LOCKSTEP, frozenset())
    state = taken(metronome)
    assert metronome.complete(state)
    assert metronome.answer(state)[1].missed == ()


def test_lockstep_does_not_run_away_from_a_follower_but_survives_it():
    metronome = Metronome(0.02, Pace.LOCKSTEP, frozenset(), max_lead=3)
    state = metronome.start(0, following=True)
    taken_samples = 0
    while metronome.due(state, 0):
        state, _ = metronome.take(state, 0)
        state, _ = metronome.answer(state)
        taken_samples += 1
    assert taken_samples == 3
    assert metronome.due(metronome.follow(state, 0), 0)
    state, tick = metronome.take(state, 10**12)
    assert tick.follower_lost
    assert metronome.due(metronome.answer(state)[0], 0)


def test_a_follower_is_waited_for_longer_than_a_command_so_that_it_can_be_started_anew():
    metronome = Metronome(0.02, Pace.LOCKSTEP, max_lead=1, command_timeout_s=1.0, follower_timeout_s=10.0)
    state = taken(metronome, following=True)
    state, answer = metronome.answer(state)
    assert answer.missed == BOTH
    assert not metronome.due(state, 9999 * MS)
    assert metronome.due(metronome.follow(state, 0), 0)
    assert metronome.due(metronome.welcome(state), 0)
    assert metronome.due(state, 10_000 * MS)
    assert metronome.welcome(taken(metronome)).followed is None


def test_a_late_sample_is_an_overrun_and_a_standstill_moves_the_schedule():
    metronome = Metronome(0.02, Pace.REALTIME, max_late_s=0.5)
    state = metronome.start(0)
    state, _ = metronome.take(state, 0)
    state = metronome.begin(metronome.answer(state)[0], 0)
    state, tick = metronome.take(state, 31 * MS)
    assert tick.overrun(20 * MS)
    assert state.due_ns == 40 * MS
    state, tick = metronome.take(metronome.answer(state)[0], 2040 * MS)
    assert tick.shifted_ns == 2000 * MS
    assert state.due_ns == 2060 * MS


def test_the_clock_starts_when_sample_0_is_answered():
    metronome = Metronome(0.02, Pace.REALTIME, command_timeout_s=1.0)
    state = taken(metronome)
    assert not metronome.due(state, 500 * MS)
    assert metronome.due(state, 1000 * MS)
    state = metronome.begin(metronome.answer(state)[0], 300 * MS)
    assert not metronome.due(state, 319 * MS)
    assert metronome.due(state, 320 * MS)
    alone = Metronome(0.02, Pace.REALTIME, frozenset())
    assert alone.due(taken(alone), 20 * MS)


@pytest.mark.parametrize("arguments", [(0.0, Pace.REALTIME), (-1.0, Pace.LOCKSTEP)])
def test_an_impossible_sample_time_is_refused(arguments):
    with pytest.raises(MetronomeError):
        Metronome(*arguments)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 3), st.integers(0, 40), st.booleans()), max_size=80))
def test_whatever_arrives_whenever_each_sample_is_taken_once_and_answered_once(events):
    metronome = Metronome(0.02, Pace.REALTIME)
    state, now, answered = metronome.start(0), 0, []
    for kind, step, late in events:
        now += step * MS
        if kind < 2:
            sequence = max(0, state.sequence - late)
            state = metronome.accept(state, BOTH[kind], command(sequence, float(step)))
            if not state.answered and metronome.complete(state):
                state, _ = metronome.answer(state)
                answered.append(state.sequence)
        while metronome.due(state, now):
            if not state.answered:
                state, _ = metronome.answer(state)
                answered.append(state.sequence)
            state, _ = metronome.take(state, now)
    assert answered == list(range(len(answered)))
    assert state.sequence in (len(answered) - 1, len(answered))
