"""A hypothesis fitted from groups of starts."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))

from cases import Case, make

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import ModelSpec, PathSimulator, PathSpec
from dt_station_nodes.discovery.candidates import Candidate, add_effect
from dt_station_nodes.discovery.candidates import hypothesis as freed_on
from dt_station_nodes.discovery.hypothesis_fit import Costs, Group, fit_groups, fit_hypothesis, prior_gaps
from dt_station_nodes.discovery.problem import Problem, make_problem
from dt_station_nodes.discovery.settings import DiscoverySettings
from dt_station_nodes.discovery.terms import Hypothesis, nominal_terms

MODEL = Path(__file__).parents[3] / "config" / "models" / "paper.yaml"
PAPER = ModelSpec.from_yaml(MODEL.read_text(encoding="utf-8"))
PATH = PAPER.paths[Channel.POSITION]


def nominal(effects: tuple[tuple[str, str, float], ...]) -> tuple[Problem, Hypothesis]:
    problem = make_problem(make(Case(effects, seconds=24.0)), PAPER, Channel.POSITION, DiscoverySettings())
    return problem, Hypothesis(PATH, nominal_terms(PATH, problem.signal))


def test_a_fit_as_good_as_noise_is_not_begun_anew() -> None:
    problem, hypothesis = nominal(())
    home = hypothesis.start()
    # Were it begun, a start of the wrong length would not get through.
    found, *_ = fit_groups(problem, hypothesis, [Group([home], 1)], [Group([np.zeros(1)], 1)], 6)
    assert found.full
    assert np.allclose(found.fitted.x, home, atol=0.02)


def test_what_leaves_more_than_noise_is_begun_anew_and_the_best_is_kept() -> None:
    problem, hypothesis = nominal((("dead_zone", "position", 1.0),))
    home = hypothesis.start()
    far = home + 1.0
    found, *_ = fit_groups(problem, hypothesis, [Group([], 1), Group([far], 1)], [Group([home], 1)], 6)
    alone, *_ = fit_groups(problem, hypothesis, [Group([home], 1)], [], 6)
    assert not found.full
    assert found.fitted.cost <= alone.fitted.cost * (1.0 + 1e-3)


def test_the_best_starts_are_passed_over_where_they_have_been_followed() -> None:
    problem, hypothesis = nominal(())
    home = hypothesis.start()
    starts = [home + 0.5, home, home + 0.2]
    first = fit_hypothesis(problem, hypothesis, starts, iterations=0, keep=1)
    second = fit_hypothesis(problem, hypothesis, starts, iterations=0, keep=1, passed=1)
    assert np.array_equal(first.fitted.x, starts[1])
    assert np.array_equal(second.fitted.x, starts[2])


def test_what_starts_cost_is_simulated_once(monkeypatch: pytest.MonkeyPatch) -> None:
    problem, hypothesis = nominal(())
    home = hypothesis.start()
    starts = [home + 0.5, home, home + 0.2]
    known: Costs = {}
    first = fit_groups(problem, hypothesis, [Group(starts, 1)], [], 0, known=known)
    assert len(known) == 3
    simulated: list[PathSpec] = []
    asked = Problem.residual

    def counted(own: Problem, path: PathSpec) -> np.ndarray:
        simulated.append(path)
        return asked(own, path)

    monkeypatch.setattr(Problem, "residual", counted)
    again = fit_groups(problem, hypothesis, [Group(starts, 1)], [], 0, known=known)
    assert np.array_equal(again[0].fitted.x, first[0].fitted.x)
    # The start that is followed, its slopes, and the end.
    assert len(simulated) == 2 + len(home)
    # What is said to be dear is not begun.
    dear = {**known, home.tobytes(): 1e12}
    assert np.array_equal(fit_groups(problem, hypothesis, [Group(starts, 1)], [], 0, known=dear)[0].fitted.x, starts[2])


def test_a_warm_up_that_settles_within_seconds_begins_steeply() -> None:
    problem, hypothesis = nominal(())
    truth = add_effect(PATH, Candidate("gain_drift"), {"rate_per_s": 0.084, "settling_s": 5.0})
    warm = replace(problem, measured=problem.simulate(truth))
    near = add_effect(PATH, Candidate("gain_drift"), {"rate_per_s": 0.03, "settling_s": 9.0})
    free = freed_on(warm, near, hypothesis.terms, {"gain_drift": ("rate_per_s", "settling_s")})
    (drift,) = fit_hypothesis(warm, free, iterations=20).path.effects
    assert drift.parameters["rate_per_s"] == pytest.approx(0.084, rel=0.02)
    assert drift.parameters["settling_s"] == pytest.approx(5.0, rel=0.02)


def steps_simulated(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Sub-steps a sample of each simulation from now on."""
    simulated: list[int] = []
    simulate = PathSimulator._simulate

    def counted(self: PathSimulator, path: PathSpec, steps: int, *given: object) -> np.ndarray:
        simulated.append(steps)
        return simulate(self, path, steps, *given)

    monkeypatch.setattr(PathSimulator, "_simulate", counted)
    return simulated


def test_of_a_long_run_starts_are_told_apart_and_slopes_taken_coarsely(monkeypatch: pytest.MonkeyPatch) -> None:
    run = make(Case((("cubic_stiffness", "position", 1.0),), seconds=60.0))
    problem = make_problem(run, PAPER, Channel.POSITION, DiscoverySettings())
    terms, candidate = nominal_terms(PATH, problem.signal), Candidate("cubic_stiffness")
    paths = [add_effect(PATH, candidate, {"coefficient": 500.0 * k}) for k in (1.0, 2.0, 4.0)]
    like = freed_on(problem, paths[0], terms, {"cubic_stiffness": ("coefficient",)})
    starts = [freed_on(problem, path, terms, {"cubic_stiffness": ("coefficient",)}).start() for path in paths]
    simulated = steps_simulated(monkeypatch)
    told = fit_hypothesis(problem, like, starts, iterations=0, keep=1)
    # Three starts; then the best as it is, with slopes as they are.
    assert simulated == [2, 2, 2, *(len(like.terms) + 1) * [4]]
    simulated.clear()
    found = fit_hypothesis(problem, like, starts, iterations=6, keep=1)
    assert simulated.count(2) > 2 * simulated.count(4) > 0
    assert np.array_equal(found.residual, problem.residual(found.path))
    assert found.fitted.cost < told.fitted.cost


@pytest.mark.parametrize(("asymmetry", "gain"), [(0.2, 1.25), (0.2, 1.0 / 1.2), (-0.2, 1.25), (0.2, 1.0)])
def test_a_gain_that_is_the_given_one_on_either_side_is_not_off(asymmetry: float, gain: float) -> None:
    path = add_effect(PATH, Candidate("asymmetric_gain"), {"asymmetry": asymmetry})
    known = nominal_terms(PATH)
    free = freed_on(nominal(())[0], path, known, {"asymmetric_gain": ("asymmetry",)})
    either, mean = (replace(free, path=p).start() for p in (path.model_copy(update={"gain": gain}), path))
    assert prior_gaps(free, either) == pytest.approx(prior_gaps(free, mean), abs=1e-9)
    further = replace(free, path=path.model_copy(update={"gain": 1.1 * gain})).start()
    assert np.abs(prior_gaps(free, further)).max() > 1.0
