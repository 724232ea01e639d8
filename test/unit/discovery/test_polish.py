"""Parameters of a densely sampled axis: forces in short windows, and the drift of its free run."""

from dataclasses import replace

import numpy as np
import pytest

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import ModelSpec
from dt_station_nodes.core.run import Run
from dt_station_nodes.discovery import DiscoverySettings, Verdict, polish
from dt_station_nodes.discovery.candidates import Candidate, add_effect, hypothesis
from dt_station_nodes.discovery.channel import Finding
from dt_station_nodes.discovery.hypothesis_fit import Fit, fit_hypothesis
from dt_station_nodes.discovery.polish import carried_over, polished
from dt_station_nodes.discovery.problem import Problem, make_problem
from dt_station_nodes.discovery.selection import Bench, fit_null
from dt_station_nodes.discovery.terms import nominal_terms

STEP_S = 1e-3
SECONDS = 8.0
COULOMB_V = 0.6
AXIS = ModelSpec.model_validate(
    {
        "name": "axis",
        "source": "made up",
        "paths": {"position": {"numerator": [0.4], "denominator": [1.0, 4.0, 0.0]}},
    }
)


def axis_run(wander_v: float, seed: int = 3) -> Run:
    """An axis of 0.4 m/s2 per volt with smooth friction, held back by a force that slowly wanders."""
    rng = np.random.default_rng(seed)
    time = np.arange(round(SECONDS / STEP_S)) * STEP_S
    voltage = 4.0 * np.sin(2.1 * time) + 1.5 * np.sin(6.7 * time + 1.0)
    wander = np.convolve(rng.standard_normal(len(time) + 999), np.ones(1000) / 1000.0**0.5, "valid")
    speed, place, places = 0.0, 0.1, []
    for v, force in zip(voltage, wander_v * wander, strict=True):
        places.append(place)
        speed += STEP_S * (0.4 * (v + force - COULOMB_V * np.tanh(speed / 0.004)) - 4.0 * speed)
        place += STEP_S * speed
    position = np.array(places) + 1e-7 * rng.standard_normal(len(time))
    return Run(STEP_S, {"servo_voltage_v": voltage, "position_m": position})


@pytest.fixture(scope="module")
def found() -> Finding:
    """The finding as it comes to be polished."""
    path = AXIS.paths[Channel.POSITION]
    problem = make_problem(axis_run(0.05), AXIS, Channel.POSITION, DiscoverySettings())
    bench = Bench(problem, nominal_terms(path, problem.signal))
    null = fit_null(bench, path)
    freed = {"friction": ("coulomb_v", "asymmetry")}
    rough = hypothesis(problem, add_effect(path, Candidate("friction"), {"coulomb_v": 0.4}), bench.nominal, freed)
    best = bench.explained(fit_hypothesis(problem, rough), ("friction",), freed)
    given = problem.residual(path)
    return Finding(problem, Verdict.NAMED, given, null, best, (best, null), (0.0, 1e3), ((),), 1e3, 1e3, 0.0, 1e-7)


def drift_m(finding: Finding, problem: Problem | None = None) -> float:
    """Root mean square of a whole run simulated from its start, against what was measured; the finding's own run."""
    problem = problem or finding.problem
    return float(np.sqrt(np.mean(np.square(problem.measured - problem.simulator.simulate(finding.best.fit.path)))))


def test_the_free_run_decides_what_short_windows_leave_open(found: Finding, monkeypatch: pytest.MonkeyPatch) -> None:
    by_both = polished(found)
    monkeypatch.setattr(polish, "_less_adrift", lambda near, fit, check: fit)
    by_windows = polished(found)
    assert drift_m(by_both) < 0.8 * drift_m(by_windows)
    assert np.linalg.norm(by_both.best.fit.residual) < 1.2 * np.linalg.norm(by_windows.best.fit.residual)
    (friction,) = by_both.best.fit.path.effects
    assert friction.parameters["coulomb_v"] == pytest.approx(COULOMB_V, rel=0.1)


def test_the_free_run_of_the_validation_run_counts_as_much(found: Finding) -> None:
    check = make_problem(axis_run(0.05, seed=9), AXIS, Channel.POSITION, DiscoverySettings())
    alone, both = polished(found), polished(found, check)
    assert drift_m(both, check) < 0.8 * drift_m(alone, check)
    assert drift_m(both) * drift_m(both, check) < drift_m(alone) * drift_m(alone, check)
    (friction,) = both.best.fit.path.effects
    assert friction.parameters["coulomb_v"] == pytest.approx(COULOMB_V, rel=0.1)


def test_the_whole_run_keeps_only_the_effects_it_needs(found: Finding) -> None:
    """A standing force that a stretch of the run asked for, and the whole of it does not."""
    path = AXIS.paths[Channel.POSITION]
    problem = make_problem(axis_run(0.0), AXIS, Channel.POSITION, DiscoverySettings())
    bench = Bench(problem, nominal_terms(path, problem.signal))
    freed = {"friction": ("coulomb_v",), "bias": ("bias_v",)}
    friction = add_effect(path, Candidate("friction"), {"coulomb_v": COULOMB_V})
    both = hypothesis(problem, add_effect(friction, Candidate("bias"), {"bias_v": 1e-4}), bench.nominal, freed)
    best = bench.explained(fit_hypothesis(problem, both, iterations=0), ("friction", "bias"), freed)
    stretch = replace(found, best=best, alternatives=((), ("leakage",)))
    whole = carried_over(stretch, problem, path)
    assert whole.best.added == ("friction",)
    assert whole.alternatives == ((),)
    (effect,) = whole.best.fit.path.effects
    assert effect.name == "friction"
    assert len(whole.best.fit.hypothesis.terms) == len(both.terms) - 1


def test_what_explains_less_than_the_set_leaves_may_be_part_of_that() -> None:
    """A standing force that short windows gain a little by, under a force that wanders and no name explains."""
    problem = make_problem(axis_run(0.05), AXIS, Channel.POSITION, DiscoverySettings())
    path = AXIS.paths[Channel.POSITION]
    bench = Bench(problem, nominal_terms(path, problem.signal))
    freed = {"friction": ("coulomb_v",), "bias": ("bias_v",)}
    friction = add_effect(path, Candidate("friction"), {"coulomb_v": COULOMB_V})
    both = hypothesis(problem, add_effect(friction, Candidate("bias"), {"bias_v": 0.1}), bench.nominal, freed)
    whole = fit_hypothesis(problem, both, iterations=0)

    def refit(bare: Fit) -> Fit:
        cost = (1.3 if "friction" in bare.names else 9.0) * whole.fitted.cost
        return replace(bare, fitted=replace(whole.fitted, cost=cost))

    needed = polish._needed
    assert needed(whole, ("friction", "bias"), refit, 0.0)[1] == ("friction",)
    assert needed(whole, ("bias", "friction"), refit, 0.0)[1] == ("friction",)
    # Where all but noise is explained, three tenths of it are not left to chance.
    assert needed(whole, ("friction", "bias"), refit, whole.fitted.cost)[1] == ("friction", "bias")


def test_without_a_standing_force_friction_may_differ_with_direction() -> None:
    """An offset beside friction of one level is friction of two: it is left out for that, not kept."""
    path = AXIS.paths[Channel.POSITION]
    problem = make_problem(axis_run(0.0), AXIS, Channel.POSITION, DiscoverySettings())
    freed = {"friction": ("coulomb_v",), "bias": ("bias_v",)}
    friction = add_effect(path, Candidate("friction"), {"coulomb_v": COULOMB_V})
    both = hypothesis(problem, add_effect(friction, Candidate("bias"), {"bias_v": 0.1}), (), freed)
    fit = fit_hypothesis(problem, both, iterations=0)
    alone = polish._less_or_leaning(problem, fit, "bias")
    assert [effect.name for effect in alone.path.effects] == ["friction"]
    assert [term.name for term in alone.terms] == ["coulomb_v", "asymmetry"]
    starts = polish._leaning(alone)
    levels, leans = np.array(starts).T
    assert np.all(levels == alone.start()[0])
    assert min(leans) < -0.1 < 0.1 < max(leans)
    assert not polish._leaning(polish._less(fit, "bias"))
