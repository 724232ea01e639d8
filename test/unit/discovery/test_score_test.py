"""What a refinement could take off a form's cost, told before it is fitted."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import signal

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import ModelSpec, PathSimulator
from dt_station_nodes.core.run import Run
from dt_station_nodes.discovery import DiscoverySettings, search
from dt_station_nodes.discovery.candidates import Candidate, hypothesis
from dt_station_nodes.discovery.fit import Fitted
from dt_station_nodes.discovery.hypothesis_fit import Fit, fit_hypothesis
from dt_station_nodes.discovery.problem import make_problem
from dt_station_nodes.discovery.refinements import refinements, step_starts
from dt_station_nodes.discovery.score_test import effects_of, far_behind, least_cost
from dt_station_nodes.discovery.selection import Bench, Explanation, fit_null
from dt_station_nodes.discovery.tasks import Task
from dt_station_nodes.discovery.terms import Hypothesis, nominal_terms

MODEL = Path(__file__).parents[3] / "config" / "models" / "paper.yaml"
PAPER = ModelSpec.from_yaml(MODEL.read_text(encoding="utf-8"))
PATH = PAPER.paths[Channel.PRESSURE]
NOISE_PA = 6e3


def bench_of(effect: str, numbers: dict[str, float]) -> Bench:
    """A pressure under a triangle wave with one effect more than the model has, and noise."""
    time_s = 0.02 * np.arange(1200)
    voltage = 2.3 + 1.3 * signal.sawtooth(2.1 * time_s, 0.5)
    path = PAPER.with_effect(Channel.PRESSURE, effect, numbers).paths[Channel.PRESSURE]
    pressure = PathSimulator(Channel.PRESSURE, 0.02, voltage, np.zeros(0), 1e6, 1e6).simulate(path)
    pressure += NOISE_PA * np.random.default_rng(8).standard_normal(time_s.size)
    run = Run(0.02, {"load_voltage_v": voltage, "pressure_pa": pressure})
    problem = make_problem(run, PAPER, Channel.PRESSURE, DiscoverySettings())
    return Bench(problem, nominal_terms(PATH, problem.signal))


def told(bench: Bench, form: Explanation, name: str) -> dict[str, tuple[float, float]]:
    """Of each number that refines a form alone: the cost that the test promises, and the one that its fit comes to."""
    candidate, path = Candidate(name), form.fit.path
    forms = refinements(bench.problem, path, candidate, bench.problem.residual(PATH), True, bench.nominal)
    found = {}
    for names in forms.steps:
        if len(names) == 1 and names[0] in forms.grids:
            starts = step_starts(path, forms, names)
            changes = effects_of(bench, form.fit, name, names, starts)
            freed = {name: (*candidate.required, *names)}
            begun = [hypothesis(bench.problem, start, bench.nominal, freed) for start in starts]
            fit = fit_hypothesis(bench.problem, begun[0], [h.start() for h in begun], keep=2)
            found[names[0]] = least_cost(form.fit, changes), fit.fitted.cost
    return found


def plain(bench: Bench, name: str) -> Explanation:
    """An effect's plain form."""
    found = search._plain(bench, Task(fit_null(bench, PATH), Candidate(name))).seen
    assert found is not None
    return found


def test_of_what_is_linear_the_test_foretells_the_cost_to_the_last_digit() -> None:
    rng = np.random.default_rng(2)
    slopes, more, left = rng.standard_normal((60, 3)), rng.standard_normal((50, 2)), rng.standard_normal(60)
    fitted = Fitted(np.zeros(3), left, slopes, float(left @ left), 1)
    fit = Fit(Hypothesis(PATH, ()), PATH, fitted, left[:50], fitted.cost, 0.0)
    # the last ten are what the nominal parameters' priors leave, which no effect changes
    both = np.column_stack([slopes, np.vstack([more, np.zeros((10, 2))])])
    (wanted,) = np.linalg.lstsq(both, left, rcond=None)[1]
    assert least_cost(fit, more) == pytest.approx(wanted)
    assert least_cost(fit, more[:, :0]) == pytest.approx(float(np.linalg.lstsq(slopes, left, rcond=None)[1][0]))


@pytest.mark.parametrize(
    ("effect", "numbers", "name"),
    [
        ("hysteresis", {"half_width_v": 0.15, "spread": 1.0}, "hysteresis"),
        ("hysteresis", {"half_width_v": 0.15, "spread": 1.0}, "backlash"),
        ("dead_zone", {"half_width_v": 0.3, "centre_v": 2.3, "rounding_v": 0.3}, "dead_zone"),
        ("gain_drift", {"rate_per_s": 0.01, "settling_s": 8.0}, "gain_drift"),
    ],
)
def test_what_a_fit_reaches_was_promised(effect: str, numbers: dict[str, float], name: str) -> None:
    bench = bench_of(effect, numbers)
    form = plain(bench, name)
    cost, worth = form.fit.fitted.cost, bench.worth(form)
    costs = told(bench, form, name)
    assert min(reached for _, reached in costs.values()) < 0.7 * cost
    for promised, reached in costs.values():
        assert worth * np.log(cost / reached) < 6.0 * worth * np.log(cost / promised) + 1.0


def test_a_number_whose_only_start_changes_nothing_is_seen_by_its_slope() -> None:
    bench = bench_of(
        "periodic_disturbance", {"amplitude": 5e4, "frequency_hz": 1.3, "phase_rad": 0.4, "third_cosine": 0.4}
    )
    form = plain(bench, "periodic_disturbance")
    forms = refinements(bench.problem, form.fit.path, Candidate("periodic_disturbance"), bench.problem.residual(PATH))
    starts = step_starts(form.fit.path, forms, ("third_cosine",))
    assert all(start == form.fit.path for start in starts)
    changes = effects_of(bench, form.fit, "periodic_disturbance", ("third_cosine",), starts)
    assert changes.shape == (1200, 1)
    assert least_cost(form.fit, changes) < 0.9 * form.fit.fitted.cost


def test_only_what_is_far_behind_a_form_that_leaves_noise_is_asked() -> None:
    bench = bench_of("dead_zone", {"half_width_v": 0.4, "centre_v": 2.3})
    form = plain(bench, "dead_zone")
    cost = form.fit.fitted.cost
    assert far_behind(bench, form, np.inf) == 0.0
    assert far_behind(bench, form, 0.99 * cost) == 0.0
    assert far_behind(replace(bench, problem=replace(bench.problem, rough=True)), form, 0.1 * cost) == 0.0
    near, far = (far_behind(bench, form, share * cost) for share in (0.3, 0.03))
    assert 0.0 < near < far


def tried(monkeypatch: pytest.MonkeyPatch, bench: Bench, task: Task) -> tuple[list[tuple[str, ...]], Task]:
    """Refinements that were fitted, and what came of them."""
    fitted: list[tuple[str, ...]] = []

    def watched(bench: Bench, task: Task, optional: tuple[str, ...], *given: object) -> Explanation:
        fitted.append(optional)
        return form(bench, task, optional, *given)

    form: Callable[..., Explanation] = search._form
    with monkeypatch.context() as patch:
        patch.setattr(search, "_form", watched)
        return fitted, search._refined(bench, task)


def test_what_no_refinement_brings_near_is_not_refined(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = bench_of("dead_zone", {"half_width_v": 0.4, "centre_v": 2.3})
    base, form, ahead = fit_null(bench, PATH), plain(bench, "gain_drift"), plain(bench, "dead_zone")
    assert ahead.fit.full
    assert far_behind(bench, form, ahead.fit.fitted.cost) > 0.0
    task = Task(base, Candidate("gain_drift"), seen=form)
    all_of_them, refined = tried(monkeypatch, bench, task)
    few, spared = tried(monkeypatch, bench, replace(task, ahead=ahead.fit.fitted.cost))
    assert len(all_of_them) > len(few) + 3
    # the last one is of all numbers together
    assert len(all_of_them[-1]) > 3
    assert all_of_them[-1] not in few
    assert min(e.fit.fitted.cost for e in refined.finer) > 3.0 * ahead.fit.fitted.cost
    assert spared.seen is form


def test_what_a_refinement_brings_near_is_refined_however_far_behind(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = bench_of("hysteresis", {"half_width_v": 0.15, "spread": 1.0})
    form, noise = plain(bench, "hysteresis"), float(len(bench.problem.measured))
    assert far_behind(bench, form, noise) > 0.0
    task = Task(fit_null(bench, PATH), Candidate("hysteresis"), seen=form, ahead=noise)
    fitted, refined = tried(monkeypatch, bench, task)
    assert ("spread",) in fitted
    assert max(fitted, key=len) == fitted[-1]
    assert min(e.fit.rss for e in refined.finer) < 1.1 * noise
