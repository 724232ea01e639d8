"""A spool that sticks and slips is found by where it breaks away, and told from a loop that does not jump."""

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))

from far_workers import FarWorkers
from valves import BARE, PAPER, SPEC, TIME_S, WAVES, answered

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import PathSimulator
from dt_station_nodes.core.run import Run
from dt_station_nodes.discovery import DiscoverySettings, Verdict, discover, search, stick_slip
from dt_station_nodes.discovery.candidates import Candidate, add_effect, hypothesis
from dt_station_nodes.discovery.hypothesis_fit import Fit, fit_hypothesis
from dt_station_nodes.discovery.problem import Problem, make_problem
from dt_station_nodes.discovery.selection import Bench, fit_null
from dt_station_nodes.discovery.stick_slip import breakaways_v, climbed, far_from_top, stepped
from dt_station_nodes.discovery.terms import nominal_terms
from dt_station_nodes.workers import Workers

PISTON = PAPER.paths[Channel.POSITION].model_copy(update={"effects": (), "disturbance": None})


def run(stuck_v: float, slid_v: float, wave: int) -> Run:
    """Pressure of a valve whose spool stays until `stuck_v` behind, then is `slid_v` behind, after He's flow chart."""
    given = 2.0 + 1.2 * WAVES[wave]
    acts, spool = [], 0.0
    for voltage in given:
        behind = float(voltage) - spool
        if abs(behind) > stuck_v:
            spool = float(voltage) - float(np.sign(behind)) * slid_v
        acts.append(spool)
    return answered(given, np.array(acts), wave)


def test_a_spool_that_jumps_is_friction_with_its_numbers() -> None:
    result = discover(run(0.3, 0.1, 0), SPEC, run(0.3, 0.1, 1))
    assert result.verdict is Verdict.NAMED
    (effect,) = result.effects
    assert (effect.name, effect.alternatives) == ("friction", ())
    assert effect.parameters["coulomb_v"].value == pytest.approx(0.3, rel=0.03)
    assert effect.parameters["slip"].value == pytest.approx(2.0 / 3.0, abs=0.02)


def sliding(stuck_v: float, slid_v: float, wave: int) -> Run:
    """Pressure of a valve whose spool, once `stuck_v` behind, slides on `slid_v` behind until the voltage turns."""
    given = 2.0 + 1.2 * WAVES[wave]
    acts, spool, side = [], 0.0, 0.0
    for voltage in map(float, given):
        if side == 0.0 and abs(voltage - spool) > stuck_v:
            side = float(np.sign(voltage - spool))
        if side * (voltage - spool) < slid_v:
            side = 0.0
        spool = voltage - side * slid_v if side else spool
        acts.append(spool)
    return answered(given, np.array(acts), wave)


def test_a_spool_that_slides_on_is_friction_with_its_numbers() -> None:
    result = discover(sliding(0.4, 0.15, 0), SPEC, sliding(0.4, 0.15, 1))
    (effect,) = result.effects
    assert (effect.name, effect.alternatives) == ("friction", ())
    assert result.model.paths[Channel.PRESSURE].effect("friction").parameters["slides_on"] == 1.0
    level = effect.parameters["coulomb_v"].value
    assert level == pytest.approx(0.4, rel=0.05)
    assert level * (1.0 - effect.parameters["slip"].value) == pytest.approx(0.15, rel=0.1)


def gripping(level_v: float, excess_v: float, way_v: float, share: float, wave: int) -> Run:
    """Pressure of a valve whose spool bristles hold, elastic up to a share, and by more below 2 V/s or so (Lorentz)."""
    # In swings of one size it is a loop like any other.
    given = 2.0 + 1.2 * WAVES[wave] * (0.3 + 0.7 * np.abs(np.sin(0.3 * TIME_S)))
    acts, spool, held = [], 0.0, 0.0
    for change in np.diff(given, prepend=0.0):
        most = level_v + excess_v / (1.0 + (change / 0.02 / 2.0) ** 2)
        for part in np.full(100, change / 100.0):
            side = float(np.sign(part))
            gives = min(max(0.0, (side * held / most - share) / (1.0 - share)), 1.0)
            slope = level_v / way_v * (1.0 - gives)
            spool, held = spool + part / (1.0 + slope), held + part * slope / (1.0 + slope)
        acts.append(spool)
    return answered(given, np.array(acts), wave)


def test_a_spool_that_bristles_grip_is_friction_with_its_numbers() -> None:
    result = discover(gripping(0.15, 0.08, 0.1, 0.6, 0), SPEC, gripping(0.15, 0.08, 0.1, 0.6, 1))
    (effect,) = result.effects
    assert (effect.name, effect.alternatives) == ("friction", ())
    numbers = {name: parameter.value for name, parameter in effect.parameters.items()}
    assert 0.15 < numbers["coulomb_v"] + numbers.get("static_excess_v", 0.0) < 0.15 + 1.2 * 0.08
    assert numbers["elastic"] == pytest.approx(0.6, abs=0.1)


def test_one_that_does_not_jump_is_play() -> None:
    result = discover(run(0.2, 0.2, 0), SPEC, run(0.2, 0.2, 1))
    (effect,) = result.effects
    # Then the three are one thing.
    assert (effect.name, effect.alternatives) == ("backlash", ("hysteresis", "friction"))


@pytest.mark.parametrize("wave", [0, 1])
@pytest.mark.parametrize(("stuck_v", "slid_v"), [(0.15, 0.03), (0.3, 0.1), (0.6, 0.3)])
def test_how_far_the_spool_stays_behind_says_where_it_breaks_away(stuck_v: float, slid_v: float, wave: int) -> None:
    problem = make_problem(run(stuck_v, slid_v, wave), SPEC, Channel.PRESSURE, DiscoverySettings())
    starts = np.array(breakaways_v(problem, BARE, problem.residual(BARE)))
    assert np.min(np.abs(starts / stuck_v - 1.0)) < 0.02


def test_a_fit_beside_the_stairs_steps_onto_them() -> None:
    problem = make_problem(run(0.3, 0.1, 0), SPEC, Channel.PRESSURE, DiscoverySettings())
    near = add_effect(BARE, Candidate("friction", apart=True), {"coulomb_v": 0.305, "slip": 0.68})
    begin = hypothesis(problem, near, nominal_terms(BARE, problem.signal), {"friction": ("coulomb_v", "slip")})
    fit = fit_hypothesis(problem, begin, iterations=10)
    better = stepped(problem, fit)
    assert better.fitted.cost < 0.5 * fit.fitted.cost
    assert float(np.std(better.residual)) < 1.2 * problem.noise


@pytest.mark.parametrize("wave", [0, 1])
@pytest.mark.parametrize(
    ("stuck_v", "slid_v", "from_v", "from_slip"),
    [(0.45, 0.344, 0.425, 0.13), (0.35, 0.163, 0.26, 0.3), (0.28, 0.12, 0.244, 0.37), (0.64, 0.17, 0.58, 0.57)],
)
def test_stairs_with_many_steps_are_found_from_far(
    stuck_v: float, slid_v: float, from_v: float, from_slip: float, wave: int
) -> None:
    problem = make_problem(run(stuck_v, slid_v, wave), SPEC, Channel.PRESSURE, DiscoverySettings())
    far = add_effect(BARE, Candidate("friction", apart=True), {"coulomb_v": from_v, "slip": from_slip})
    begin = hypothesis(problem, far, nominal_terms(BARE, problem.signal), {"friction": ("coulomb_v", "slip")})
    fit = stepped(problem, fit_hypothesis(problem, begin, iterations=10), far=True)
    assert float(np.std(fit.residual)) < 1.1 * problem.noise
    spool = fit.path.effect("friction").parameters
    assert spool["coulomb_v"] == pytest.approx(stuck_v, rel=0.02)
    assert spool["slip"] == pytest.approx(1.0 - slid_v / stuck_v, abs=0.01)


@pytest.mark.parametrize("slides", [False, True])
def test_stairs_are_found_from_a_fit_that_slides_on_where_it_does_not_and_the_other_way(slides: bool) -> None:
    recorded = sliding(0.4, 0.15, 0) if slides else run(0.64, 0.17, 0)
    problem = make_problem(recorded, SPEC, Channel.PRESSURE, DiscoverySettings())
    other = {"coulomb_v": 0.38 if slides else 0.58, "slip": 0.57, "slides_on": float(not slides)}
    far = add_effect(BARE, Candidate("friction", apart=True), other)
    free = {"friction": ("coulomb_v", "slip", "slides_on")}
    begin = hypothesis(problem, far, nominal_terms(BARE, problem.signal), free)
    fit = stepped(problem, fit_hypothesis(problem, begin, iterations=10), far=True)
    assert float(np.std(fit.residual)) < 1.1 * problem.noise
    assert fit.path.effect("friction").parameters["slides_on"] == float(slides)


@pytest.mark.parametrize(
    ("of", "stuck_v", "slid_v", "from_v", "from_slip"),
    [(run, 0.808, 0.341, 0.686, 0.59), (sliding, 0.764, 0.241, 0.671, 0.56)],
)
def test_stairs_are_found_where_nominal_numbers_are_off(
    of: Callable[[float, float, int], Run], stuck_v: float, slid_v: float, from_v: float, from_slip: float
) -> None:
    """There one well has many deeper ones beside it, which are not to be all that is followed."""
    off = BARE.model_copy(update={"gain": 0.98 * BARE.gain, "time_scale": 0.96 * BARE.time_scale})
    spec = SPEC.model_copy(update={"paths": {Channel.PRESSURE: off}})
    problem = make_problem(of(stuck_v, slid_v, 0), spec, Channel.PRESSURE, DiscoverySettings())
    other = {"coulomb_v": from_v, "slip": from_slip, "slides_on": float(of is run)}
    far = add_effect(off, Candidate("friction", apart=True), other)
    free = {"friction": ("coulomb_v", "slip", "slides_on")}
    begin = hypothesis(problem, far, nominal_terms(off, problem.signal), free)
    fit = stepped(problem, fit_hypothesis(problem, begin, iterations=10), far=True)
    assert float(np.std(fit.residual)) < 1.1 * problem.noise
    assert fit.path.effect("friction").parameters["coulomb_v"] == pytest.approx(stuck_v, rel=0.02)


def test_only_a_single_spool_that_explains_much_and_not_all_may_be_on_wrong_stairs() -> None:
    problem = make_problem(run(0.3, 0.1, 0), SPEC, Channel.PRESSURE, DiscoverySettings())
    nominal = nominal_terms(BARE, problem.signal)
    base = fit_hypothesis(problem, hypothesis(problem, BARE, nominal, {}))

    def spool(level_v: float, *free: str) -> Fit:
        path = add_effect(BARE, Candidate("friction", apart=True), {"coulomb_v": level_v, "slip": 2.0 / 3.0})
        like = hypothesis(problem, path, nominal, {"friction": free})
        return fit_hypothesis(problem, like, [like.start()], 0)

    both = ("coulomb_v", "slip")
    beside, upon, trifling = spool(0.305, *both), spool(0.3, *both), spool(0.02, *both)
    assert [fit.full for fit in (beside, upon)] == [False, True]
    assert far_from_top(problem, ("friction",), beside, base)
    assert not far_from_top(problem, ("friction",), upon, base)
    assert not far_from_top(problem, ("friction",), trifling, base)
    assert not far_from_top(problem, ("friction", "bias"), beside, base)
    assert not far_from_top(problem, ("friction",), spool(0.305, "coulomb_v"), base)
    assert not far_from_top(problem, ("backlash",), beside, base)


@pytest.mark.parametrize(("low_v", "high_v"), [(-0.65, 0.65), (-0.3, 0.9)])
def test_the_edges_of_a_band_that_jumps_open_are_found_between_a_runs_voltages(low_v: float, high_v: float) -> None:
    servo = 1.6 * np.sin(2.0 * np.pi * 0.23 * TIME_S)
    acts = np.where((servo > low_v) & (servo < high_v), 0.0, servo - 0.5 * (low_v + high_v))
    position = PathSimulator(Channel.POSITION, 0.02, acts, np.zeros(0), 1e6, 0.0).simulate(PISTON)
    position = position + 3e-4 * np.random.default_rng(2).standard_normal(len(position))
    problem = make_problem(
        Run(0.02, {"servo_voltage_v": servo, "position_m": position}), PAPER, Channel.POSITION, DiscoverySettings()
    )
    band = Candidate("dead_zone", also=("centre_v",))
    free = {band.name: band.required}
    begun = {"half_width_v": 0.93 * 0.5 * (high_v - low_v), "centre_v": 0.5 * (high_v + low_v) + 0.03, "restored": 0.95}
    nominal = nominal_terms(PISTON, problem.signal)
    like = hypothesis(problem, add_effect(PISTON, band, begun), nominal, free)
    fit = fit_hypothesis(problem, like, [like.start()], 20)
    base = fit_hypothesis(problem, hypothesis(problem, PISTON, nominal, {}))
    moved = climbed(problem, (band.name,), fit, base)
    assert moved.rss < min(0.8 * fit.rss, 1.1 * len(servo))
    found = moved.path.effect("dead_zone").parameters
    between = servo.max() * 2.0 * np.pi * 0.23 * 0.02
    for sign, edge in ((-1.0, low_v), (1.0, high_v)):
        assert found["centre_v"] + sign * found["half_width_v"] == pytest.approx(edge, abs=between)


def test_a_search_looks_among_all_stairs_where_its_first_are_wrong(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = make_problem(run(0.3, 0.1, 0), SPEC, Channel.PRESSURE, DiscoverySettings())
    shared = FarWorkers()
    bench = Bench(problem, nominal_terms(BARE, problem.signal), workers=shared)
    asked: list[tuple[bool, Workers]] = []
    own = stick_slip.stepped

    def wrong(problem: Problem, fit: Fit, far: bool, workers: Workers) -> Fit:
        asked.append((far, workers))
        beside = fit.hypothesis.scaled(fit.fitted.x, 1.02)
        return own(problem, fit, far, workers) if far else fit_hypothesis(problem, fit.hypothesis, [beside], 0)

    monkeypatch.setattr(stick_slip, "stepped", wrong)
    monkeypatch.setattr(search, "library", lambda *_: (Candidate("friction", apart=True),))
    found = search.scan(bench, [fit_null(bench, BARE)], 1, 1)
    assert asked[:2] == [(False, shared), (True, shared)]
    assert found[0].fit.full
    assert sum(shared.asked) > 100
