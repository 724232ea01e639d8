"""A run may find a loop or a gap anywhere: where it began is sought, in another run too."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))

from valves import BARE, SPEC, TIME_S, answered

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models.effects import Attachment
from dt_station_nodes.core.run import Run
from dt_station_nodes.discovery import DiscoverySettings, discover
from dt_station_nodes.discovery.beginnings import BEGINS, beginnings, loop_of
from dt_station_nodes.discovery.candidates import Candidate, add_effect
from dt_station_nodes.discovery.problem import Problem, make_problem
from dt_station_nodes.discovery.unseen import unseen_residual

HALF_V = 0.5
# Slow, so that the gap is not passed while the path settles, which is not looked at.
SLOW = (-np.sin(2.0 * np.pi * 0.07 * TIME_S), 1.0 - 2.0 * np.abs((0.11 * TIME_S + 0.5) % 2.0 - 1.0))
PLAY = Candidate("backlash", Attachment.INPUT)
WIDTHS = {"backlash": "half_width", "hysteresis": "half_width_v"}


def run(wave: int, place: float) -> Run:
    """Pressure of a valve whose linkage has play, found at a `place` (-1..1) in its gap."""
    given = 2.2 + 1.3 * SLOW[wave]
    spool, acts = given[0] + place * HALF_V, []
    for voltage in map(float, given):
        spool = min(max(spool, voltage - HALF_V), voltage + HALF_V)
        acts.append(spool)
    return answered(given, np.array(acts), wave)


def problem(wave: int, place: float) -> Problem:
    return make_problem(run(wave, place), SPEC, Channel.PRESSURE, DiscoverySettings())


@pytest.mark.parametrize("name", list(WIDTHS))
@pytest.mark.parametrize("place", [-1.0, 0.0, 0.6])
def test_a_place_in_the_gap_is_where_the_simulated_run_begins(name: str, place: float) -> None:
    given = problem(0, place)
    valve = Candidate(name, Attachment.INPUT)
    plain = add_effect(BARE, valve, {WIDTHS[name]: HALF_V})
    (begins,) = beginnings(given, plain, name, (place,))
    begun = add_effect(BARE, valve, {WIDTHS[name]: HALF_V, BEGINS: begins})
    assert np.std(given.residual(begun)) < 1.05 * given.noise
    # From rest a voltage pulls it to its lower end.
    assert place == -1.0 or np.std(given.residual(plain)) > 1.5 * given.noise


@pytest.mark.parametrize("place", [-0.9, -0.2, 0.5, 1.0])
def test_where_it_begins_is_no_gap_of_another_run(place: float) -> None:
    other = problem(1, place)
    path = add_effect(BARE, PLAY, {"half_width": HALF_V, BEGINS: 0.123})
    assert np.std(unseen_residual(other, path)) < 1.1 * other.noise
    # From rest a voltage pulls it to its lower end.
    assert place < -0.5 or np.std(other.residual(path)) > 2.0 * other.noise


def test_a_loop_that_is_not_open_begins_nowhere() -> None:
    assert loop_of(add_effect(BARE, PLAY, {"half_width": 0.0})) is None
    assert loop_of(BARE) is None


def test_play_found_in_the_middle_of_its_gap_is_backlash_of_its_width() -> None:
    result = discover(run(0, 0.2), SPEC, run(1, 0.6))
    (effect,) = result.effects
    assert effect.name == "backlash"
    assert effect.parameters["half_width"].value == pytest.approx(HALF_V, rel=0.02)
