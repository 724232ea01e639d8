"""Single samples far off all others: found where they are, and nowhere else."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import lfilter

sys.path.insert(0, str(Path(__file__).parent))

from cases import Case, make

from dt_station_nodes.core.models import ModelSpec
from dt_station_nodes.discovery import DiscoverySettings, Verdict, discover
from dt_station_nodes.discovery.spikes import spikes, without_spikes

PAPER = ModelSpec.from_yaml((Path(__file__).parents[3] / "config" / "models" / "paper.yaml").read_text())
TIME = np.arange(1200) * 0.02


@given(st.lists(st.integers(0, 199), max_size=3, unique=True), st.integers(0, 9), st.floats(0.5, 30.0))
@settings(max_examples=30, deadline=None)
def test_spikes_are_found_where_they_are(places, seed, size):
    course = np.sin(2.0 * np.pi * 0.3 * TIME) + 0.01 * np.random.default_rng(seed).standard_normal(len(TIME))
    at = sorted(3 + 5 * place for place in places)
    course[at] += size * (-1.0) ** seed
    assert list(spikes(course)) == at


@pytest.mark.parametrize("noise", [0.0, 0.01])
@pytest.mark.parametrize("hz", [0.05, 0.4, 3.0])
def test_corners_jumps_and_noise_are_none(noise, hz):
    turn = TIME * hz % 1.0
    hiss = noise * np.random.default_rng(1).standard_normal(len(TIME))
    for course in (np.abs(turn - 0.5), (turn > 0.5).astype(float), turn, np.zeros(len(TIME))):
        assert not len(spikes(course + hiss))
    assert not len(spikes(np.round(20.0 * np.sin(2.0 * np.pi * turn)) + hiss))


@pytest.mark.parametrize("late", [0.1, 0.3, 0.5, 0.6, 0.9])
def test_a_slow_way_up_and_a_quick_way_back_is_none(late):
    """An axis with a lag of one sample that a sawtooth drives: it turns within a sample or two."""
    fine = 10
    at = (np.arange(len(TIME) * fine) / fine + late) % 238.0
    speed = np.where(at < 234.0, 0.01, -0.01 * 234.0 / 4.0)
    lagging = lfilter([1.0 / fine], [1.0, 1.0 / fine - 1.0], speed)
    assert not len(spikes(np.cumsum(lagging)[::fine]))


def test_a_run_without_any_is_the_same_run():
    run = make(Case(seconds=12.0))
    assert without_spikes(run) == (run, [])


def test_what_was_read_wrongly_changes_no_verdict_and_is_said():
    run = make(Case((("dead_zone", "position", 1.0),), seconds=12.0))
    spoilt = {name: values.copy() for name, values in run.signals.items()}
    spoilt["position_m"][[100, 333]] += 0.5
    spoilt["pressure_pa"][200] = 0.0
    clean, mended = (
        discover(each, PAPER, settings=DiscoverySettings(max_effects=1)) for each in (run, replace(run, signals=spoilt))
    )
    assert clean.verdict is mended.verdict is Verdict.NAMED
    assert [e.name for e in mended.effects] == [e.name for e in clean.effects] == ["dead_zone"]
    assert any("position: 2 single samples" in note and "2 s" in note for note in mended.data_notes)
    assert any("pressure: 1 single sample " in note for note in mended.data_notes)
