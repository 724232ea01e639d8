"""Pairing of object and twin samples in any interleaving."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.samples import PlantSample, SampleFlag
from dt_station_nodes.core.shadow import Shadow


def sample(sequence, value=0.0, flags=SampleFlag.OK):
    return PlantSample(sequence, sequence, value, 1e6 + value, 0.0, 0.0, flags)


def play(order):
    """Order of (is object, number); states, numbers compared, misses."""
    shadow = Shadow(0.02, 1.0)
    state, seen = shadow.initial_state(), []
    for is_object, number in order:
        offer = shadow.measured if is_object else shadow.simulated
        state, scores = offer(state, sample(number, 0.5 if is_object else 0.25))
        if scores is not None:
            seen.append(state.sequence)
            assert scores[Channel.POSITION].residual == 0.25
    return state, seen


@settings(max_examples=60, deadline=None)
@given(st.lists(st.booleans(), max_size=60))
def test_any_interleaving_compares_every_sample_in_order(turns):
    counters, order = [0, 0], []
    for turn in turns:
        order.append((turn, counters[turn]))
        counters[turn] += 1
    state, seen = play(order)
    assert seen == list(range(min(counters)))
    assert state.missed == 0


def test_samples_without_partner_are_counted():
    state, seen = play([(True, 0), (False, 0), (True, 1), (True, 2), (False, 2), (False, 3), (True, 4), (False, 4)])
    assert seen == [0, 2, 4]
    assert state.missed == 2


def test_a_run_begun_anew_starts_the_figures_anew_whoever_comes_first():
    order = [(True, 0), (False, 0), (True, 1), (False, 1)]
    state, _ = play([*order, *order])
    assert state.channels[Channel.POSITION].samples == 2
    state, _ = play([*order, (False, 0), (True, 0), (True, 1), (False, 1)])
    assert state.channels[Channel.POSITION].samples == 2
    assert state.missed == 0


def test_memory_is_bounded_when_the_twin_is_gone():
    state, _ = play([(True, k) for k in range(1000)])
    assert len(state.waiting) <= 400
    assert state.missed == 600


def test_the_end_is_passed_on():
    shadow = Shadow(0.02, 1.0)
    state, _ = shadow.simulated(shadow.initial_state(), sample(0))
    state, _ = shadow.measured(state, sample(0, flags=SampleFlag.END))
    assert state.ended
    assert state.stamp_ns == pytest.approx(0)
