"""Set-points for samples: streams, gaps, restarts, and the inbox at the other end."""

from hypothesis import given
from hypothesis import strategies as st

from dt_station_nodes.core.samples import Setpoint
from dt_station_nodes.core.setpoint_inbox import SetpointInbox
from dt_station_nodes.core.setpoint_stream import SetpointStream
from dt_station_nodes.core.waveforms import Shape, Waveform, waveform_samples

WAVE = Waveform(Shape.SINE, 2.0, 1.0, 0.3)
TRUTH = waveform_samples(WAVE, 0.02, 400)
INBOX = SetpointInbox()


def streaming(sequence, value):
    return Setpoint(sequence, 0, value, True)


def test_every_sample_gets_the_setpoint_of_the_next():
    stream = SetpointStream(0.02)
    state, first = stream.first(stream.initial_state(WAVE))
    assert first == (0, TRUTH[0])
    for k in range(300):
        state, sent = stream.step(state, k)
        assert sent == [(k + 1, TRUTH[k + 1])]


@given(st.integers(1, 398))
def test_one_who_comes_late_plays_as_if_there_from_the_start(sequence):
    stream = SetpointStream(0.02)
    _, sent = stream.step(stream.initial_state(WAVE), sequence)
    assert sent == [(sequence, TRUTH[sequence]), (sequence + 1, TRUTH[sequence + 1])]


def test_a_run_begun_anew_starts_the_waveform_anew():
    stream = SetpointStream(0.02)
    state, _ = stream.step(stream.initial_state(WAVE), 200)
    _, sent = stream.step(state, 0)
    assert sent == [(0, TRUTH[0]), (1, TRUTH[1])]


def test_a_live_change_acts_at_the_next_setpoint_without_a_jump_of_phase():
    stream = SetpointStream(0.02)
    state, _ = stream.step(stream.initial_state(WAVE), 99)
    louder = Waveform(Shape.SINE, 4.0, 1.0, 0.3)
    _, sent = stream.step(state, 100, louder)
    assert sent[-1][0] == 101
    assert sent[-1][1] - 1.0 == 2.0 * (TRUTH[101] - 1.0)


def test_a_streaming_setpoint_is_awaited_and_used_for_its_own_sample_only():
    state = INBOX.initial_state(9.0)
    assert INBOX.find(state, 0)[1] == 9.0
    for k in (0, 1):
        state = INBOX.offer(state, streaming(k, float(k)))
    state, value = INBOX.find(state, 0)
    assert value == 0.0
    state, value = INBOX.find(state, 1)
    assert value == 1.0
    assert INBOX.find(state, 2)[1] is None


def test_a_standing_setpoint_ends_the_streaming():
    state = INBOX.offer(INBOX.initial_state(0.0), streaming(5, 1.0))
    state = INBOX.offer(state, Setpoint(0, 0, 7.0, False))
    assert INBOX.find(state, 6)[1] == 7.0


def test_one_who_comes_late_takes_the_first_it_hears_rather_than_its_start_value():
    state = INBOX.offer(INBOX.initial_state(9.0), streaming(41, 4.1))
    state, value = INBOX.find(state, 40)
    assert value == 4.1
    assert INBOX.find(state, 41)[1] == 4.1


def test_a_run_begun_anew_forgets_what_was_kept_for_the_old_one():
    state = INBOX.initial_state(0.0)
    for setpoint in (streaming(800, 8.0), streaming(0, 1.0), streaming(1, 2.0)):
        state = INBOX.offer(state, setpoint)
    state, value = INBOX.find(INBOX.restart(state), 0)
    assert value == 1.0
    assert INBOX.find(state, 1)[1] == 2.0
