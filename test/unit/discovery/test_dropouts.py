"""Commands that never arrive are found by when, and nothing that answers to its voltage is taken for them."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))

from valves import BARE, PAPER, SPEC, TIME_S, WAVES, answered

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import EffectSpec, ModelSpec, PathSimulator
from dt_station_nodes.core.run import Run
from dt_station_nodes.discovery import DiscoverySettings, Verdict, discover
from dt_station_nodes.discovery.dropouts import Spell, applied, commands_lost
from dt_station_nodes.discovery.problem import Problem, make_problem

GIVEN_V = 2.0 + 1.2 * WAVES[0]
LOST = ((120, 131), (404, 409), (777, 795), (1000, 1012))
PISTON = PAPER.paths[Channel.POSITION].model_copy(update={"effects": (), "disturbance": None})
PISTON_SPEC = ModelSpec(name="piston", paths={Channel.POSITION: PISTON})


def spells(held: bool) -> list[Spell]:
    return [Spell(float(first), float(stop), held) for first, stop in LOST]


def problem(run: Run, spec: ModelSpec = SPEC) -> Problem:
    return make_problem(run, spec, next(iter(spec.paths)), DiscoverySettings())


def found(problem: Problem, spec: ModelSpec = SPEC, over: float = 9.0) -> list[Spell]:
    """What explains a gap, where something else leaves so many times the noise power."""
    noise = problem.noise**2
    lost = commands_lost(problem, spec.paths[problem.channel], over * noise, noise)
    return sorted(lost, key=lambda spell: spell.first)


def lost_share(given: np.ndarray, acts: np.ndarray, lost: list[Spell]) -> float:
    """What of the voltages lost is not among the spells found, RMS."""
    return float(np.std(applied(given, lost) - acts) / np.std(given - acts))


def test_a_lost_command_is_none_or_the_one_before_over_the_share_of_a_sample_that_it_is_lost() -> None:
    volts = np.arange(1.0, 7.0)
    assert list(applied(volts, [Spell(2.0, 4.0, True)])) == [1.0, 2.0, 2.0, 2.0, 5.0, 6.0]
    assert list(applied(volts, [Spell(1.5, 3.25, False)])) == [1.0, 1.0, 0.0, 3.0, 5.0, 6.0]


@pytest.mark.parametrize("held", [False, True])
def test_each_spell_without_commands_is_found_from_its_first_sample_to_its_last(held: bool) -> None:
    acts = applied(GIVEN_V, spells(held))
    lost = found(problem(answered(GIVEN_V, acts, 0)))
    assert [spell.held for spell in lost] == [held] * len(LOST)
    assert lost_share(GIVEN_V, acts, lost) < 0.2
    if not held:
        np.testing.assert_allclose([(spell.first, spell.stop) for spell in lost], LOST, atol=0.6)


def test_they_are_found_behind_a_piston_that_integrates_and_whose_gain_is_off() -> None:
    given = 3.0 * np.sin(2.0 * np.pi * 0.4 * TIME_S) + np.sin(2.0 * np.pi * 1.1 * TIME_S)
    truth = PISTON.model_copy(update={"gain": 1.03})
    acts = applied(given, spells(False))
    position = PathSimulator(Channel.POSITION, 0.02, acts, np.zeros(0), 0.0, 0.0).simulate(truth)
    noise = 0.01 * np.std(position) * np.random.default_rng(3).standard_normal(position.size)
    run = Run(0.02, {"servo_voltage_v": given, "position_m": position + noise})
    assert lost_share(given, acts, found(problem(run, PISTON_SPEC), PISTON_SPEC)) < 0.2


@pytest.mark.parametrize(
    "effect",
    [
        EffectSpec(name="dead_zone", parameters={"half_width_v": 0.4, "centre_v": 2.0}),
        EffectSpec(name="hysteresis", parameters={"half_width_v": 0.3}),
        EffectSpec(name="friction", parameters={"coulomb_v": 0.3, "slip": 0.7}),
        EffectSpec(name="rate_limit", parameters={"rate_v_per_s": 1.5}),
        EffectSpec(name="saturation", parameters={"upper_v": 2.6, "lower_v": 0.0}),
        EffectSpec(name="gain_drift", parameters={"rate_per_s": 0.01}),
    ],
    ids=lambda effect: effect.name,
)
def test_what_answers_to_the_voltage_is_no_lost_command(effect: EffectSpec) -> None:
    path = BARE.model_copy(update={"effects": (effect,)})
    pressure = PathSimulator(Channel.PRESSURE, 0.02, GIVEN_V, np.zeros(0), 1e6, 1e6).simulate(path)
    noise = 0.01 * np.std(pressure) * np.random.default_rng(5).standard_normal(pressure.size)
    shown = problem(Run(0.02, {"load_voltage_v": GIVEN_V, "pressure_pa": pressure + noise}))
    assert np.std(shown.residual(BARE)) > 2.0 * shown.noise
    assert not found(shown)


def test_what_another_explanation_leaves_hardly_any_of_is_left_to_it() -> None:
    lost = problem(answered(GIVEN_V, applied(GIVEN_V, spells(False)), 0))
    assert not found(lost, over=1.3)


def test_a_run_whose_commands_got_lost_is_unexplained_and_says_so() -> None:
    run = answered(GIVEN_V, applied(GIVEN_V, spells(False)), 0)
    result = discover(run, SPEC, settings=DiscoverySettings(max_effects=1))
    assert result.verdict is Verdict.UNEXPLAINED
    assert "commands that were lost in 4 spells, the first at 2.40 s" in result.sentence
