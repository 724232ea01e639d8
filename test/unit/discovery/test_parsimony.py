"""Refinements that the data do not hold go; those they need stay."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))

from cases import Case, make

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import ModelSpec, PlantModel
from dt_station_nodes.core.run import Run
from dt_station_nodes.discovery import parsimony
from dt_station_nodes.discovery.candidates import Candidate, add_effect, hypothesis
from dt_station_nodes.discovery.hypothesis_fit import fit_hypothesis
from dt_station_nodes.discovery.measure import take_measure
from dt_station_nodes.discovery.parsimony import _rested, as_near, at_usual, simplified, told_exactly
from dt_station_nodes.discovery.problem import make_problem
from dt_station_nodes.discovery.selection import Bench, Explanation
from dt_station_nodes.discovery.settings import DiscoverySettings
from dt_station_nodes.discovery.terms import nominal_terms

from .far_workers import FarWorkers

MODEL = Path(__file__).parents[3] / "config" / "models" / "paper.yaml"
PAPER = ModelSpec.from_yaml(MODEL.read_text(encoding="utf-8"))


def refined(case: Case, name: str, start: dict[str, float]) -> tuple[Bench, Explanation]:
    """An effect on the position fitted with all its refinements there free, from `start`."""
    problem = make_problem(make(case), PAPER, Channel.POSITION, DiscoverySettings())
    path = PAPER.paths[Channel.POSITION]
    bench = Bench(problem, nominal_terms(path, problem.signal))
    candidate = Candidate(name)
    there = (n for n in candidate.optional if Channel.POSITION in candidate.effect.parameter(n).channels)
    freed = {name: (*candidate.required, *there)}
    begin = hypothesis(problem, add_effect(path, candidate, start), bench.nominal, freed)
    return bench, bench.explained(fit_hypothesis(problem, begin, iterations=15), (name,), freed)


@pytest.mark.parametrize(
    ("name", "start", "kept", "gone"),
    [
        ("asymmetric_gain", {"asymmetry": 0.1, "centre_v": 0.1, "rounding_v": 0.2}, "rounding_v", "centre_v"),
        ("delay", {"delay_s": 0.03, "stretch_per_v": -0.03}, "delay_s", "stretch_per_v"),
        ("rate_limit", {"rate_v_per_s": 30.0, "softness_s": 0.01, "asymmetry": 0.2}, "rate_v_per_s", "asymmetry"),
    ],
)
def test_refinements_that_the_run_does_not_hold_go(name: str, start: dict[str, float], kept: str, gone: str) -> None:
    bench, full = refined(Case(((name, "position", 1.0),), "sine", seed=2, seconds=24.0), name, start)
    measure = take_measure(bench, [full])
    (simple,) = simplified(bench, [full], measure)
    parameters = simple.fit.path.effects[-1].parameters
    assert gone not in simple.freed[name]
    assert parameters[gone] == 0.0
    assert parameters[kept] != 0.0
    assert measure.score(simple) < measure.score(full)


def test_numbers_that_do_nothing_go_and_what_was_fitted_stands() -> None:
    """Bristles that never bend have nothing to damp: fitted anew without, the rest would end elsewhere."""
    start = {"coulomb_v": 0.2, "damping_s": 0.02}
    bench, full = refined(Case((("friction", "position", 1.0),), "sine", seed=2, seconds=24.0), "friction", start)
    idle = {full.fit.hypothesis.terms[i].name for i in np.flatnonzero(full.fit.fitted.idle)}
    assert "damping_s" in idle
    rested = _rested(bench, full)
    assert not idle & set(rested.freed["friction"])
    assert rested.fit.path.effects[-1].parameters["damping_s"] == 0.0
    assert rested.powers == full.powers
    assert np.array_equal(rested.fit.residual, full.fit.residual)
    assert np.allclose(rested.fit.hypothesis.start(), rested.fit.fitted.x)
    assert rested.fit.fitted.jacobian.shape == (full.fit.fitted.jacobian.shape[0], rested.fit.freedoms)
    assert not rested.fit.fitted.idle.any()


def test_what_is_simple_stays_what_it_was_wherever_it_was_looked_at() -> None:
    case = Case((("delay", "position", 1.0),), "sine", seed=2, seconds=24.0)
    bench, full = refined(case, "delay", {"delay_s": 0.03, "stretch_per_v": -0.03})
    (simple,) = simplified(bench, [full], take_measure(bench, [full]))
    (again,) = simplified(replace(bench, workers=FarWorkers()), [simple], take_measure(bench, [simple]))
    assert again is simple


def test_a_lower_minimum_that_foretells_worse_is_not_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    case = Case((("friction", "position", 1.0),), "sine", seed=2, seconds=24.0)
    bench, full = refined(case, "friction", {"coulomb_v": 0.2})
    taken = []
    for times in (0.5, 2.0):

        def around(_: Bench, found: Explanation, times: float = times) -> Explanation:
            return replace(found, powers=tuple(times * power for power in found.powers), held=True)

        monkeypatch.setattr(parsimony, "_around", around)
        (simple,) = simplified(bench, [full], take_measure(bench, [full]))
        taken.append(simple.held)
    assert taken == [True, False]


def test_the_foremost_are_judged_exactly_in_the_order_they_came() -> None:
    lag = Case((("extra_lag", "position", 1.0),), "sine", seed=3, seconds=12.0, noise_db=10.0)
    problem, check = (
        make_problem(make(case), PAPER, Channel.POSITION, DiscoverySettings())
        for case in (lag, replace(lag, shape="square", seed=4, seconds=24.0, noise_db=60.0))
    )
    path = PAPER.paths[Channel.POSITION]
    bench = Bench(problem, nominal_terms(path, problem.signal), check)

    def explained(name: str, start: dict[str, float], iterations: int) -> Explanation:
        freed = {name: Candidate(name).required}
        begin = hypothesis(problem, add_effect(path, Candidate(name), start), bench.nominal, freed)
        return bench.explained(fit_hypothesis(problem, begin, iterations=iterations), (name,), freed)

    known = [explained("bias", {"bias_v": 0.1}, 10), explained("extra_lag", {"time_constant_s": 0.2}, 2)]
    measure = take_measure(bench, known)
    told = told_exactly(bench, known, measure)
    assert [e.added for e in told] == [e.added for e in known]
    assert all(measure.score(after) <= measure.score(before) + 1e-9 for before, after in zip(known, told, strict=True))
    assert measure.score(told[1]) < measure.score(known[1]) - 1.0
    assert told_exactly(replace(bench, check=None), known, measure) == known


def test_what_the_run_does_not_tell_from_the_best_is_judged_exactly_however_far_behind() -> None:
    """Numbers that trade along a curve foretell nothing with the slopes at the fit: a true rate limit lost by 4000."""
    lag = (("extra_lag", "position", 1.0),)
    run, check = (
        make_problem(make(Case(lag, shape, seed=3, seconds=24.0)), PAPER, Channel.POSITION, DiscoverySettings())
        for shape in ("sine", "triangle")
    )
    path = PAPER.paths[Channel.POSITION]
    bench = Bench(run, nominal_terms(path, run.signal), check)
    freed = {"extra_lag": ("time_constant_s",)}
    begin = hypothesis(run, add_effect(path, Candidate("extra_lag"), {"time_constant_s": 0.03}), bench.nominal, freed)
    fit = fit_hypothesis(run, begin, iterations=15)
    best = bench.explained(fit, ("extra_lag",), freed)
    others = [replace(best, added=(name,), powers=tuple(2.0 * p for p in best.powers)) for name in ("bias", "delay")]
    # One of those with the same fit of the run, one with another.
    beside = [replace(best, added=(n,), powers=tuple(9.0 * p for p in best.powers)) for n in ("friction", "leakage")]
    worse = replace(fit, fitted=replace(fit.fitted, cost=1.5 * fit.fitted.cost))
    others, alike, unlike = [replace(e, fit=worse) for e in others], beside[0], replace(beside[1], fit=worse)
    known = [unlike, alike, *others, best]
    told = told_exactly(bench, known, take_measure(bench, known))
    assert told[0] is unlike
    assert max(told[1].powers) < 0.5 * max(alike.powers)


def test_refinements_that_undo_each_other_go_together() -> None:
    leak = Case((("leakage", "position", 1.0),), "sine", seed=3, seconds=24.0)
    problem, check = (
        make_problem(make(case), PAPER, Channel.POSITION, DiscoverySettings())
        for case in (leak, replace(leak, shape="square", seed=13))
    )
    path = PAPER.paths[Channel.POSITION]
    bench = Bench(problem, nominal_terms(path, problem.signal), check)
    candidate = Candidate("leakage")
    start = {"coefficient": 1e-9, "base": 0.9, "sag_per_s": 0.1, "sag_bend": 100.0, "lag_s": 0.04}
    freed = {"leakage": candidate.required + candidate.optional}
    begin = hypothesis(problem, add_effect(path, candidate, start), bench.nominal, freed)
    full = bench.explained(fit_hypothesis(problem, begin, iterations=15), ("leakage",), freed)
    (simple,) = simplified(bench, [full], take_measure(bench, [full]))
    assert simple.freed["leakage"] == ("coefficient",)


def leaking_above_rest() -> Bench:
    """A bench for a run whose piston loses what the pressure is above its rest."""
    plain = make(Case(shape="sine", seed=3, seconds=24.0, closed=False, noise_db=300.0))
    leak = PAPER.with_effect(Channel.POSITION, "leakage", {"coefficient": 3e-10, "base": 1.0})
    out = PlantModel(leak, plain.sample_time_s).simulate(*(plain.signals[c.voltage_signal] for c in Channel))
    rng = np.random.default_rng(4)
    noisy = {"pressure_pa": out.pressure_pa, "position_m": out.position_m}
    noisy = {name: v + 0.01 * np.std(v) * rng.standard_normal(v.size) for name, v in noisy.items()}
    run = Run(plain.sample_time_s, {**plain.signals, **noisy})
    problem = make_problem(run, PAPER, Channel.POSITION, DiscoverySettings())
    return Bench(problem, nominal_terms(PAPER.paths[Channel.POSITION], problem.signal))


@pytest.mark.parametrize(("iterations", "usual"), [(15, True), (0, False)])
def test_a_choice_of_form_costs_nothing_among_those_that_fit_alike(iterations: int, usual: bool) -> None:
    bench = leaking_above_rest()

    def form(refinement: str, value: float, most: int) -> Explanation:
        path = add_effect(
            PAPER.paths[Channel.POSITION], Candidate("leakage"), {"coefficient": 3e-10, refinement: value}
        )
        freed = {"leakage": ("coefficient", refinement)}
        fit = fit_hypothesis(bench.problem, hypothesis(bench.problem, path, bench.nominal, freed), iterations=most)
        return bench.explained(fit, ("leakage",), freed)

    forms = {"base": form("base", 0.8, iterations), "widening": form("widening", 3e-8, 15)}
    held = at_usual(bench, "leakage", forms)
    assert [e.fit.path.effects[-1].parameters["base"] for e in held] == ([1.0] if usual else [])
    assert [e.freed["leakage"] for e in held] == ([("coefficient",)] if usual else [])
    assert all(e.fit.fitted.cost < 1.01 * forms["base"].fit.fitted.cost for e in held)


def test_ends_that_the_run_does_not_tell_apart_are_left_to_the_validation_run() -> None:
    alone = leaking_above_rest()
    freed = {"leakage": ("coefficient",)}

    def end(coefficient: float) -> Explanation:
        numbers = {"coefficient": coefficient, "base": 1.0}
        path = add_effect(PAPER.paths[Channel.POSITION], Candidate("leakage"), numbers)
        fit = fit_hypothesis(alone.problem, hypothesis(alone.problem, path, alone.nominal, freed), iterations=0)
        return alone.explained(fit, ("leakage",), freed)

    best, near, far = end(3.0e-10), end(3.001e-10), end(2e-10)
    others = [near.fit, far.fit]
    assert as_near(alone, best, others) == ()
    checked = replace(alone, check=alone.problem)
    assert [e.fit for e in as_near(checked, best, others)] == [near.fit]
