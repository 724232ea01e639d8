"""An end of the way that one run does not come to is told by another that does, or by none."""

from pathlib import Path

import numpy as np
import pytest

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import ModelSpec, PathSimulator, PathSpec
from dt_station_nodes.core.run import Run
from dt_station_nodes.discovery.candidates import Candidate, add_effect, hypothesis
from dt_station_nodes.discovery.hypothesis_fit import Fit, fit_hypothesis
from dt_station_nodes.discovery.measure import take_measure
from dt_station_nodes.discovery.out_of_reach import NEVER, ends_elsewhere
from dt_station_nodes.discovery.parsimony import simplified
from dt_station_nodes.discovery.problem import Problem, make_problem
from dt_station_nodes.discovery.selection import Bench, fit_null
from dt_station_nodes.discovery.settings import DiscoverySettings
from dt_station_nodes.discovery.terms import nominal_terms

PAPER = ModelSpec.from_yaml((Path(__file__).resolve().parents[3] / "config/models/paper.yaml").read_text())
ALONE = PAPER.paths[Channel.POSITION].model_copy(update={"disturbance": None})
SPEC = PAPER.model_copy(update={"paths": {Channel.POSITION: ALONE}})
STOPS = {"limit": 0.05, "lower_limit": -0.03, "standing": 1.0}
HISS_M = 1e-4
STOPPING = Candidate("overflow", apart=True)


def problem(amplitude_v: float, seed: int) -> Problem:
    voltage = -amplitude_v * np.sin(2.0 * np.pi * 0.4 * np.arange(600) * 0.02)
    simulator = PathSimulator(Channel.POSITION, 0.02, voltage, np.zeros(0), 0.0, 0.0)
    position = simulator.simulate(add_effect(ALONE, STOPPING, STOPS))
    noisy = position + HISS_M * np.random.default_rng(seed).standard_normal(600)
    run = Run(0.02, {"servo_voltage_v": voltage, "position_m": noisy})
    return make_problem(run, SPEC, Channel.POSITION, DiscoverySettings())


@pytest.fixture(scope="module")
def fit() -> Fit:
    """A run that meets the lower end only, explained with the upper one somewhere beyond it."""
    shown = problem(0.85, 1)
    begin = add_effect(ALONE, STOPPING, {**STOPS, "limit": 3.0 * float(np.abs(shown.measured).max())})
    free = hypothesis(shown, begin, nominal_terms(ALONE, shown.signal), {"overflow": STOPPING.required})
    found = fit_hypothesis(shown, free)
    assert np.std(found.residual) < 1.1 * HISS_M
    return found


def limit(path: PathSpec) -> float:
    return path.effects[-1].parameters["limit"]


def test_the_other_run_tells_where_it_meets_an_end(fit: Fit) -> None:
    other = problem(2.5, 2)
    told = ends_elsewhere(other, fit)
    assert limit(told.path) == pytest.approx(STOPS["limit"], abs=2.0 * HISS_M)
    assert np.std(other.residual(told.path)) < 1.1 * HISS_M < 0.1 * np.std(other.residual(fit.path))
    assert told.path.effects[-1].parameters["lower_limit"] == fit.path.effects[-1].parameters["lower_limit"]
    assert np.array_equal(told.residual, fit.residual)


def test_an_explanation_is_held_against_the_other_run_with_the_end_that_run_tells(fit: Fit) -> None:
    shown, other = problem(0.85, 1), problem(2.5, 2)
    bench = Bench(shown, nominal_terms(ALONE, shown.signal), other)
    found = bench.explained(fit, ("overflow",), {"overflow": STOPPING.required}, glance=True)
    assert limit(found.fit.path) == pytest.approx(STOPS["limit"], abs=2.0 * HISS_M)
    assert found.unseen is not None
    assert np.std(found.unseen) < 1.1 * HISS_M


def test_no_end_is_made_up_where_no_run_meets_one(fit: Fit) -> None:
    other = problem(0.8, 3)
    told = ends_elsewhere(other, fit)
    assert limit(told.path) > float(other.measured.max())
    assert np.array_equal(other.residual(told.path), other.residual(fit.path))


LIMITS = {"upper_v": 0.53, "lower_v": -0.53}


def limited(middle_v: float, seed: int) -> Problem:
    """A run of an amplifier that gives no more than so much, about a mean voltage."""
    voltage = middle_v + 0.9 * np.sin(2.0 * np.pi * 0.4 * np.arange(600) * 0.02)
    simulator = PathSimulator(Channel.POSITION, 0.02, voltage, np.zeros(0), 0.0, 0.0)
    position = simulator.simulate(add_effect(ALONE, Candidate("saturation"), LIMITS))
    noisy = position + HISS_M * np.random.default_rng(seed).standard_normal(600)
    run = Run(0.02, {"servo_voltage_v": voltage, "position_m": noisy})
    return make_problem(run, SPEC, Channel.POSITION, DiscoverySettings())


def test_a_limit_that_a_run_does_not_come_to_is_told_by_the_other_and_kept() -> None:
    shown, other = limited(-0.5, 4), limited(0.1, 5)
    bench = Bench(shown, nominal_terms(ALONE, shown.signal), other)
    begin = add_effect(ALONE, Candidate("saturation"), {"upper_v": 0.7, "lower_v": -0.5})
    freed = {"saturation": ("upper_v", "lower_v")}
    fit = fit_hypothesis(shown, hypothesis(shown, begin, bench.nominal, freed))
    found = bench.explained(fit, ("saturation",), freed)
    null = fit_null(bench, ALONE)
    (kept,) = simplified(bench, [found], take_measure(bench, [null, found]))
    for told in (found, kept):
        assert told.fit.path.effects[-1].parameters["upper_v"] == pytest.approx(LIMITS["upper_v"], rel=0.01)


def test_a_limit_that_no_run_comes_to_is_said_to_be_nowhere() -> None:
    shown = limited(-0.5, 4)
    bench = Bench(shown, nominal_terms(ALONE, shown.signal))
    begin = add_effect(ALONE, Candidate("saturation"), {"upper_v": 0.7, "lower_v": -0.5})
    freed = {"saturation": ("upper_v", "lower_v")}
    found = bench.explained(
        fit_hypothesis(shown, hypothesis(shown, begin, bench.nominal, freed)), ("saturation",), freed
    )
    (kept,) = simplified(bench, [found], take_measure(bench, [fit_null(bench, ALONE), found]))
    assert kept.fit.path.effects[-1].parameters["upper_v"] >= NEVER
    assert "upper_v" not in kept.freed["saturation"]
