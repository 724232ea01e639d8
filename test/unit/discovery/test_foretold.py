"""What the second run may settle: numbers that the first leaves open, and no others."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import signal

sys.path.insert(0, str(Path(__file__).parent))

from cases import Case, make

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import EffectSpec, ModelSpec, PathSimulator, PathSpec
from dt_station_nodes.core.run import Run
from dt_station_nodes.discovery.candidates import Candidate, add_effect, hypothesis
from dt_station_nodes.discovery.foretold import foretold
from dt_station_nodes.discovery.hypothesis_fit import Fit, fit_hypothesis
from dt_station_nodes.discovery.problem import Problem, make_problem
from dt_station_nodes.discovery.settings import DiscoverySettings
from dt_station_nodes.discovery.terms import nominal_terms
from dt_station_nodes.discovery.unseen import unseen_residual

MODEL = Path(__file__).parents[3] / "config" / "models" / "paper.yaml"
PAPER = ModelSpec.from_yaml(MODEL.read_text(encoding="utf-8"))
PATH = PAPER.paths[Channel.POSITION]
TIME_S = 0.02 * np.arange(1200)
SLOW = Case(shape="sine", seed=3, seconds=12.0, noise_db=10.0)
QUICK = Case(shape="square", seed=4, seconds=24.0, noise_db=60.0)


def problem(case: Case) -> Problem:
    return make_problem(make(case), PAPER, Channel.POSITION, DiscoverySettings())


def fitted(run: Problem, name: str, start: dict[str, float]) -> Fit:
    path = PAPER.paths[Channel.POSITION]
    candidate = Candidate(name)
    begin = hypothesis(
        run,
        add_effect(path, candidate, start),
        nominal_terms(path, run.signal),
        {name: candidate.required},
    )
    return fit_hypothesis(run, begin, iterations=15)


def measured(spec: ModelSpec, volts: np.ndarray, seed: int) -> Problem:
    simulator = PathSimulator(Channel.POSITION, 0.02, volts, np.zeros(0), 0.0, 0.0)
    position = simulator.simulate(spec.paths[Channel.POSITION])
    noise = 2e-4 * np.random.default_rng(seed).standard_normal(volts.size)
    run = Run(0.02, {"servo_voltage_v": volts, "position_m": position + noise})
    return make_problem(run, spec, Channel.POSITION, DiscoverySettings())


def cost(run: Problem, check: Problem, told: tuple[float, np.ndarray]) -> float:
    """Twice the negative log-likelihood, each run with a variance of its own."""
    powers = (told[0], run), (float(told[1] @ told[1]), check)
    return sum(len(p.measured) * float(np.log(power / len(p.measured))) for power, p in powers)


def rms(residual: np.ndarray) -> float:
    return float(np.sqrt(np.mean(residual**2)))


@pytest.fixture(scope="module")
def lagging() -> tuple[Problem, Problem, Fit]:
    """A lag that a slow noisy run holds loosely, and a run of square waves that shows it well."""
    effects = (("extra_lag", "position", 1.0),)
    run, check = (
        problem(Case(effects, case.shape, seed=case.seed, seconds=case.seconds, noise_db=case.noise_db))
        for case in (SLOW, QUICK)
    )
    return run, check, fitted(run, "extra_lag", {"time_constant_s": 0.02})


def test_what_the_run_leaves_open_is_not_held_against_an_effect(lagging: tuple[Problem, Problem, Fit]) -> None:
    run, check, fit = lagging
    power, left = foretold(run, check, fit)
    assert rms(left) < 0.5 * rms(unseen_residual(check, fit.path))
    assert rms(left) < 3.0 * check.noise
    # and the run goes along: the numbers moved within what its noise allows
    own = float(fit.residual @ fit.residual)
    assert power < own * (1.0 + 10.0 * fit.freedoms / len(run.measured))


def test_the_fit_itself_stays_as_it_is(lagging: tuple[Problem, Problem, Fit]) -> None:
    run, check, fit = lagging
    before = fit.fitted.x.copy(), fit.path
    foretold(run, check, fit)
    assert np.array_equal(fit.fitted.x, before[0])
    assert fit.path == before[1]


def test_what_the_run_holds_does_not_bend() -> None:
    """The run says that there is no bias to 1 mV or so; one in the other run stays a gap."""
    run = problem(Case(shape="sine", seed=5, seconds=24.0, noise_db=50.0))
    check = problem(Case((("bias", "position", 1.0),), "square", seed=6, seconds=24.0, noise_db=50.0))
    fit = fitted(run, "bias", {"bias_v": 0.0})
    _, left = foretold(run, check, fit)
    assert rms(left) > 0.7 * rms(unseen_residual(check, fit.path))
    assert rms(left) > 3.0 * check.noise


def test_two_numbers_that_trade_on_the_run_go_where_both_runs_lead() -> None:
    """How fast a soft amplifier slews and how softly lie on a curved line on steps: slopes at the fit lead off it."""
    effect = EffectSpec(name="rate_limit", parameters={"rate_v_per_s": 300.0, "softness_s": 0.004})
    spec = PAPER.model_copy(
        update={"paths": {Channel.POSITION: PATH.model_copy(update={"effects": (effect,), "disturbance": None})}}
    )
    steps, other = (3.0 * np.sign(signal.sawtooth(2.0 * np.pi * f * TIME_S, 0.5)) for f in (0.6, 0.9))
    run, check = (measured(spec, volts, seed) for seed, volts in enumerate((steps, 1.5 * other)))
    bare = spec.paths[Channel.POSITION].model_copy(update={"effects": ()})
    candidate = Candidate("rate_limit", also=("softness_s",))
    begin = hypothesis(
        run,
        add_effect(bare, candidate, {"rate_v_per_s": 600.0, "softness_s": 0.006}),
        nominal_terms(bare, run.signal),
        {"rate_limit": ("rate_v_per_s", "softness_s")},
    )
    fit = fit_hypothesis(run, begin, iterations=30)
    told = [cost(run, check, foretold(run, check, fit, exactly)) for exactly in (False, True)]
    assert told[1] <= told[0]
    truth = float(np.sum(run.residual(spec.paths[Channel.POSITION]) ** 2)), check.residual(spec.paths[Channel.POSITION])
    assert told[1] < cost(run, check, truth) + 1.0


def test_a_fit_without_free_numbers_is_taken_as_it_is(lagging: tuple[Problem, Problem, Fit]) -> None:
    run, check, _ = lagging
    path = PAPER.paths[Channel.POSITION]
    begin = hypothesis(run, path, (), {})
    fit = fit_hypothesis(run, begin, iterations=0)
    power, left = foretold(run, check, fit)
    assert power == float(fit.residual @ fit.residual)
    assert np.array_equal(left, unseen_residual(check, path))


def test_of_a_long_run_slopes_are_taken_coarsely_and_what_is_left_as_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    run, check = problem(SLOW), problem(replace(QUICK, seconds=60.0))
    fit = fitted(run, "leakage", {"coefficient": 1e-10})
    terms = len(fit.hypothesis.terms)
    simulated: list[int] = []
    simulate = PathSimulator._simulate

    def counted(self: PathSimulator, path: PathSpec, steps: int, *given: object) -> np.ndarray:
        if len(self.voltage_v) == len(check.measured):
            simulated.append(steps)
        return simulate(self, path, steps, *given)

    monkeypatch.setattr(PathSimulator, "_simulate", counted)
    left, unseen = foretold(run, check, fit)
    assert simulated.count(2) == terms + 1
    assert simulated.count(4) > 1
    monkeypatch.setattr(Problem, "coarse", lambda self, _path: self)
    exactly = foretold(run, check, fit)
    assert cost(run, check, (left, unseen)) == pytest.approx(cost(run, check, exactly), abs=1.0)
