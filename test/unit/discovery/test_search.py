"""The search for single effects, and what it does where no plain form explains anything."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import signal

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import ModelSpec, PathSimulator
from dt_station_nodes.core.models.effects import Attachment
from dt_station_nodes.core.run import Run
from dt_station_nodes.discovery import DiscoverySettings, search
from dt_station_nodes.discovery.candidates import Candidate, add_effect, all_starts, grid, hypothesis, library
from dt_station_nodes.discovery.further_forms import GRIPPING_BRISTLES, HEAVY
from dt_station_nodes.discovery.glance import glance, starts_of
from dt_station_nodes.discovery.hypothesis_fit import fit_hypothesis
from dt_station_nodes.discovery.measure import take_measure
from dt_station_nodes.discovery.parsimony import simplified
from dt_station_nodes.discovery.problem import Problem, make_problem
from dt_station_nodes.discovery.refinements import GRIP, refinements
from dt_station_nodes.discovery.search import scan, scan_whole
from dt_station_nodes.discovery.selection import Bench, Explanation, as_given, fit_null
from dt_station_nodes.discovery.tasks import HOPELESS, SETTLED, StoppedError, Task, each, forms_of
from dt_station_nodes.discovery.terms import nominal_terms

MODEL = Path(__file__).parents[3] / "config" / "models" / "paper.yaml"
PAPER = ModelSpec.from_yaml(MODEL.read_text(encoding="utf-8"))
NOISE_M = 2e-4
Stage = Callable[[Bench, Task], Task]
# Several plays side by side that only part of the voltage passes through.
LOOPS = {"half_width_v": 0.5, "spread": 1.0, "depth": 0.7}


@pytest.fixture(scope="module")
def problem() -> Problem:
    """A servo valve with wide loops under a small noisy voltage."""
    rng = np.random.default_rng(5)
    time_s = np.arange(900) * 0.02
    voltage = 0.7 * np.sign(np.sin(1.3 * time_s)) + 0.25 * rng.standard_normal(time_s.size)
    path = PAPER.with_effect(Channel.POSITION, "hysteresis", LOOPS).paths[Channel.POSITION]
    position = PathSimulator(Channel.POSITION, 0.02, voltage, np.zeros(0), 1e6, 0.0).simulate(path)
    position += NOISE_M * rng.standard_normal(time_s.size)
    run = Run(0.02, {"servo_voltage_v": voltage, "position_m": position})
    return make_problem(run, PAPER, Channel.POSITION, DiscoverySettings())


def test_all_starts_try_every_value_of_every_parameter(problem: Problem) -> None:
    for candidate in library(Channel.POSITION, apart=False):
        paths = all_starts(problem, PAPER.paths[Channel.POSITION], candidate, problem.measured)
        assert 0 < len(paths) <= 150
        given = [path.effects[-1].parameters for path in paths]
        own = {*candidate.required, *candidate.refining(Channel.POSITION)}
        for parameter in (p for p in candidate.effect.parameters if Channel.POSITION in p.channels and p.name in own):
            tried = {round(values[parameter.name], 12) for values in given}
            assert len(tried) >= min(len(set(parameter.starts)), 2)
            assert not parameter.optional or parameter.tried_first or round(parameter.neutral, 12) in tried


def test_an_effect_of_many_parameters_is_found_where_its_plain_form_explains_nothing(problem: Problem) -> None:
    path = PAPER.paths[Channel.POSITION]
    bench = Bench(problem, nominal_terms(path, problem.signal))
    whole = scan_whole(bench, [fit_null(bench, path)], 2)[:1]
    (best,) = simplified(bench, whole, take_measure(bench, whole))
    assert best.added == ("hysteresis",)
    found = best.fit.path.effect("hysteresis").parameters
    assert {name: found[name] for name in LOOPS} == pytest.approx(LOOPS, rel=0.05)
    assert float(np.std(best.fit.residual)) < 1.2 * NOISE_M


def plays(voltage: np.ndarray) -> np.ndarray:
    """Five plays side by side, each from its middle."""
    halves = np.linspace(0.05, 0.25, 5)
    held, out = np.full(5, voltage[0]), np.empty_like(voltage)
    for k, volts in enumerate(voltage):
        held = np.clip(held, volts - halves, volts + halves)
        out[k] = held.mean()
    return out


def test_a_gain_that_past_peaks_weaken_is_explained_by_a_form_that_is_never_named() -> None:
    path = PAPER.paths[Channel.PRESSURE]
    time_s = 0.02 * np.arange(1500)
    voltage = 2.2 + 1.6 * signal.sawtooth(1.9 * time_s)
    peak, weak = 0.0, np.empty_like(voltage)
    for k, volts in enumerate(voltage):
        peak = max(peak * np.exp(-0.02 / 1.3), volts)
        weak[k] = volts * (1.0 - 0.02 * peak)
    pressure = PathSimulator(Channel.PRESSURE, 0.02, weak, np.zeros(0), 1e6, 1e6).simulate(path)
    pressure += 8e3 * np.random.default_rng(4).standard_normal(time_s.size)
    run = Run(0.02, {"load_voltage_v": voltage, "pressure_pa": pressure})
    problem = make_problem(run, PAPER, Channel.PRESSURE, DiscoverySettings())
    bench = Bench(problem, nominal_terms(path, problem.signal))
    null = fit_null(bench, path)
    peaks = next(c for c in library(Channel.PRESSURE) if c.name == "fatigue" and c.apart)
    seen = search._plain(bench, Task(null, peaks)).seen
    assert seen is not None
    assert not seen.inside
    assert float(np.std(null.fit.residual)) > 1.5 * 8e3
    assert float(np.std(seen.fit.residual)) < 1.05 * 8e3


@pytest.mark.parametrize("begins", [0.0, 1.0])
def test_plays_that_two_levels_do_not_tell_from_one_are_told_by_another_waveform(begins: float) -> None:
    path = PAPER.paths[Channel.PRESSURE]
    time_s = 0.02 * np.arange(1200)
    square = 2.2 + 1.2 * signal.square(1.95 * time_s)
    square[0] = 2.2 + 1.2 * begins
    other = 1.9 + 1.1 * signal.sawtooth(1.45 * time_s, 0.5) + 0.35 * np.sin(5.65 * time_s)

    def seen(voltage: np.ndarray, seed: int) -> Problem:
        pressure = PathSimulator(Channel.PRESSURE, 0.02, plays(voltage), np.zeros(0), 1e6, 1e6).simulate(path)
        pressure += 1.5e4 * np.random.default_rng(seed).standard_normal(time_s.size)
        run = Run(0.02, {"load_voltage_v": voltage, "pressure_pa": pressure})
        return make_problem(run, PAPER, Channel.PRESSURE, DiscoverySettings())

    problem, check = seen(square, 1), seen(other, 2)
    bench = Bench(problem, nominal_terms(path, problem.signal), check)
    loop = next(c for c in library(Channel.PRESSURE) if c.name == "hysteresis" and not c.apart)
    found = search._settled(bench, search._refined(bench, search._plain(bench, Task(fit_null(bench, path), loop)))).seen
    assert found is not None
    numbers = found.fit.path.effect("hysteresis").parameters
    assert (numbers["half_width_v"], numbers["spread"]) == pytest.approx((0.15, 1.0), rel=0.02)
    assert found.powers[1] < 1.05 * len(check.measured) * 1.5e4**2


def run_with(
    effect: str, parameters: dict[str, float], voltage: np.ndarray, first_m: float = 0.0, rig: ModelSpec = PAPER
) -> Problem:
    """A rig's position path with one more effect, and a little noise."""
    path = rig.with_effect(Channel.POSITION, effect, parameters).paths[Channel.POSITION]
    position = PathSimulator(Channel.POSITION, 0.02, voltage, np.zeros(0), 1e6, first_m).simulate(path)
    position += NOISE_M * np.random.default_rng(3).standard_normal(voltage.size)
    run = Run(0.02, {"servo_voltage_v": voltage, "position_m": position})
    return make_problem(run, PAPER, Channel.POSITION, DiscoverySettings())


def best_single(problem: Problem) -> dict[str, float]:
    path = PAPER.paths[Channel.POSITION]
    bench = Bench(problem, nominal_terms(path, problem.signal))
    best = scan(bench, [fit_null(bench, path)], 6, 2)[0]
    return {best.added[0]: 1.0, **best.fit.path.effects[-1].parameters}


@pytest.mark.parametrize("half_width_v", [0.11, 0.17, 0.29])
def test_a_valve_that_jumps_open_is_found_although_its_band_acts_in_stairs(half_width_v: float) -> None:
    time_s = np.arange(900) * 0.02
    voltage = 0.6 * np.sin(2.1 * time_s) + 0.2 * np.sin(5.3 * time_s)
    jumping = {"half_width_v": half_width_v, "restored": 1.0}
    found = best_single(run_with("dead_zone", jumping, voltage))
    assert found["half_width_v"] == pytest.approx(half_width_v, rel=0.02)
    assert found["restored"] == pytest.approx(1.0, abs=0.05)


def test_a_spring_is_found_that_is_at_rest_far_from_where_the_run_goes() -> None:
    coefficient, first_m = 4.3, 0.25
    voltage = coefficient * first_m**3 + 0.15 * np.cos(1.3 * np.arange(900) * 0.02)
    found = best_single(run_with("cubic_stiffness", {"coefficient": coefficient}, voltage, first_m))
    assert "cubic_stiffness" in found
    assert found["coefficient"] == pytest.approx(coefficient, rel=0.05)
    assert found["centre"] == pytest.approx(0.0, abs=0.01)


def test_a_strong_spring_of_a_spool_is_found_about_a_working_pressure() -> None:
    """With its null set at rest a spring that strong would leave a pressure far from where the run goes."""
    time_s = 0.01 * np.arange(2500)
    swing = 1.1 * signal.sawtooth(0.8 * time_s, 0.5)
    voltage = 1.6 + swing + 0.7 * swing**3
    given = {"coefficient": 7e-19, "centre": 1.6e6, "of_spool": 1.0}
    path = PAPER.with_effect(Channel.PRESSURE, "cubic_stiffness", given).paths[Channel.PRESSURE]
    pressure = PathSimulator(Channel.PRESSURE, 0.01, voltage, np.zeros(0), 1e6, 1e6).simulate(path)
    pressure += 1e4 * np.random.default_rng(6).standard_normal(time_s.size)
    run = Run(0.01, {"load_voltage_v": voltage, "pressure_pa": pressure})
    problem = make_problem(run, PAPER, Channel.PRESSURE, DiscoverySettings())
    bench = Bench(problem, nominal_terms(PAPER.paths[Channel.PRESSURE], problem.signal))
    null = fit_null(bench, PAPER.paths[Channel.PRESSURE])
    spring = next(c for c in library(Channel.PRESSURE) if c.name == "cubic_stiffness" and c.at is None)
    found = search._settled(bench, search._refined(bench, search._plain(bench, Task(null, spring)))).seen
    assert found is not None
    numbers = found.fit.path.effect("cubic_stiffness").parameters
    assert numbers["of_spool"] == 1.0
    assert numbers["coefficient"] == pytest.approx(7e-19, rel=0.05)
    assert numbers["centre"] == pytest.approx(given["centre"], abs=3e4)
    assert numbers["trimmed"] == pytest.approx(0.0, abs=0.02)


@pytest.mark.parametrize(
    ("wave", "peak_v", "force_pa", "scale_pa", "noise_pa"),
    [(signal.sawtooth, 4.6, 9e5, 2.5e6, 5e3), (np.sin, 6.8, 2.5e6, 1.2e6, 3e4)],
)
def test_a_spring_behind_the_pressure_that_answers_late_is_found(
    wave: Callable[[np.ndarray], np.ndarray], peak_v: float, force_pa: float, scale_pa: float, noise_pa: float
) -> None:
    """tau dz/dt = a (sinh(w / p0) - w / p0) - z of what it has left, w = y - z."""
    path = PAPER.paths[Channel.PRESSURE]
    time_s = 0.02 * np.arange(1500)
    swing_v = 0.5 * peak_v - 0.2
    voltage = peak_v - swing_v + swing_v * wave(1.95 * time_s)
    whole = PathSimulator(Channel.PRESSURE, 1e-3, np.repeat(voltage, 20), np.zeros(0), 1e6, 1e6).simulate(path)
    back, left = 0.0, np.empty_like(whole)
    for k, pressure in enumerate(whole):
        left[k] = pressure - back
        for _ in range(10):
            pressed = (pressure - back) / scale_pa
            back += 1e-4 / 0.03 * (force_pa * (np.sinh(pressed) - pressed) - back)
    shown = left[::20]
    shown = shown + noise_pa * np.random.default_rng(6).standard_normal(time_s.size)
    run = Run(0.02, {"load_voltage_v": voltage, "pressure_pa": shown})
    problem = make_problem(run, PAPER, Channel.PRESSURE, DiscoverySettings())
    bench = Bench(problem, nominal_terms(path, problem.signal))
    spring = next(c for c in library(Channel.PRESSURE) if c.name == "cubic_stiffness" and c.at is Attachment.OUTPUT)
    found = search._settled(
        bench, search._refined(bench, search._plain(bench, Task(fit_null(bench, path), spring)))
    ).seen
    assert found is not None
    assert float(np.std(found.fit.residual)) < 1.05 * noise_pa
    assert found.fit.path.effect("cubic_stiffness").parameters["answer_s"] == pytest.approx(0.03, rel=0.2)


def test_a_valve_far_slower_than_its_voltage_jumps_is_found() -> None:
    rate_v_per_s = 0.03
    voltage = 1.5 * np.sign(np.sin(2.3 * np.arange(900) * 0.02))
    found = best_single(run_with("rate_limit", {"rate_v_per_s": rate_v_per_s}, voltage))
    assert "rate_limit" in found
    assert found["rate_v_per_s"] == pytest.approx(rate_v_per_s, rel=0.1)


@pytest.mark.parametrize("asymmetry", [0.3, -0.2])
def test_a_piston_that_its_seals_hold_back_one_way_more_is_found(asymmetry: float) -> None:
    """Its lag is unequal with its gain, which a gain by direction alone does not explain."""
    gain, rate, step_s, speed = 0.01 * 206.4 / 23.34, 23.34, 0.02 / 50, 0.0
    voltage = 1.5 * np.sin(2.3 * np.arange(900) * 0.02) + 0.8 * np.sign(np.sin(3.1 * np.arange(900) * 0.02))
    way = [0.0]
    for volts in voltage[:-1]:
        speeds = [speed]
        for _ in range(50):
            speed += rate * step_s * (gain * volts - speed + asymmetry * abs(speed))
            speeds.append(speed)
        way.append(way[-1] + step_s * float(np.sum(speeds[:-1])))
    position = np.array(way) + NOISE_M * np.random.default_rng(3).standard_normal(voltage.size)
    run = Run(0.02, {"servo_voltage_v": voltage, "position_m": position})
    found = best_single(make_problem(run, PAPER, Channel.POSITION, DiscoverySettings()))
    assert "asymmetric_gain" in found
    assert found["of_drag"] == 1.0
    assert found["asymmetry"] == pytest.approx(asymmetry, abs=0.02)


def test_the_two_ends_of_a_pistons_way_are_found() -> None:
    ends = {"limit": 0.021, "lower_limit": -0.013, "standing": 1.0}
    found = best_single(run_with("overflow", ends, 1.5 * np.sin(2.3 * np.arange(900) * 0.02)))
    assert "overflow" in found
    # An end that gives a little lies so much further in.
    assert found["limit"] == pytest.approx(0.021, abs=1e-3)
    assert found["lower_limit"] == pytest.approx(-0.013, abs=1e-3)


def test_a_port_that_closes_past_either_end_of_a_pistons_way_is_found() -> None:
    ends = {"limit": 0.016, "lower_limit": -0.013, "throttling": 0.003}
    found = best_single(run_with("overflow", ends, 1.5 * np.sin(2.3 * np.arange(900) * 0.02)))
    assert "overflow" in found
    assert {name: found[name] for name in ends} == pytest.approx(ends, rel=0.05)


def test_a_pistons_stop_may_be_out_of_reach_and_is_no_relief_valve(problem: Problem) -> None:
    path = PAPER.paths[Channel.POSITION]
    stop = Candidate("overflow", apart=True)
    residual = problem.residual(path)
    low, high = float(problem.measured.min()), float(problem.measured.max())
    upper, lower = (grid(problem, path, stop, name, residual) for name in ("limit", "lower_limit"))
    assert max(upper) > high
    assert min(lower) < low
    assert set(refinements(problem, path, stop, residual).names).isdisjoint(
        {"inlet_limit", "spill", "opening_s", "reseat"}
    )


def test_a_limit_behind_the_path_that_gives_a_little_is_left_to_the_relief_valve() -> None:
    refining = {(c.name, c.at): set(c.refining(Channel.PRESSURE)) for c in library(Channel.PRESSURE, apart=False)}
    assert {"rounding_v", "passing"} <= refining["saturation", None]
    assert not {"rounding_v", "passing"} & refining["saturation", Attachment.OUTPUT]
    assert {"rounding", "override"} <= refining["overflow", Attachment.OUTPUT]


def test_a_spring_is_also_tried_on_a_pressure_valves_spool_and_on_no_other() -> None:
    for channel, there in ((Channel.PRESSURE, True), (Channel.POSITION, False)):
        spring = next(c for c in library(channel) if c.name == "cubic_stiffness" and c.at is None)
        assert ("of_spool" in spring.refining(channel)) is there


def test_candidates_are_the_effects_that_can_act_there() -> None:
    assert Candidate("friction") in library(Channel.POSITION)
    # A spool's friction is a form of its own.
    # A spool on an oil film never sticks, nor does one on bristles, so that they are tried apart; so is one with mass.
    slips = Candidate("friction", apart=True)
    creeps, bends = (Candidate("friction", also=(name,)) for name in ("creep_velocity", "presliding"))
    grips, swings = (Candidate("friction", also=form) for form in (GRIPPING_BRISTLES, HEAVY))
    assert [c for c in library(Channel.PRESSURE) if c.name == "friction"] == [slips, creeps, bends, grips, swings]
    assert Candidate("leakage") in library(Channel.PRESSURE)
    apart = [c for c in library(Channel.POSITION) if c.apart]
    assert [(c.name, c.at, c.required) for c in apart] == [
        ("asymmetric_gain", None, ("asymmetry", "centre_v", "through_zero")),
        ("delay", None, ("delay_s", "dispersion")),
        ("fatigue", None, ("loss_per_v", "recovery_s", "of_peaks")),
        ("gain_drift", None, ("rate_per_s", "swing", "swing_cosine", "period_s")),
        ("hysteresis", None, ("half_width_v", "bouc_wen", "depth")),
        ("overflow", None, ("limit", "lower_limit", "standing")),
        ("periodic_disturbance", Attachment.INPUT, ("amplitude", "frequency_hz", "phase_rad", "push_share")),
        ("rate_limit", None, ("rate_v_per_s", "asymmetry")),
        ("resonance", Attachment.OUTPUT, ("frequency_hz", "damping", "beside", "beside_rate")),
        ("saturation", None, ("upper_v", "lower_v", "knee")),
    ]
    # A cylinder stands still at 0 V, a pressure valve works about any voltage.
    assert Candidate("dead_zone", apart=True) in library(Channel.PRESSURE)
    plain = Candidate("saturation")
    assert "knee" in plain.optional
    assert "knee" not in plain.required
    # A mode beside the path shows on the output only.
    assert "beside" in Candidate("resonance", Attachment.OUTPUT).optional
    assert "beside" not in Candidate("resonance").optional
    # The edges of a spool's lands seldom lie alike about 0 V.
    lands = next(c for c in library(Channel.POSITION) if c.name == "dead_zone")
    assert lands.required == ("half_width_v", "centre_v", "restored")
    assert "centre_v" not in lands.optional


def test_a_load_that_comes_of_the_motion_is_tried_where_one_is_measured_that_moves() -> None:
    def leak(loaded: bool) -> Candidate:
        return next(c for c in library(Channel.POSITION, loaded=loaded) if c.name == "leakage")

    assert "against" in leak(True).required
    assert "against" not in leak(False).required
    assert all("against" not in leak(loaded).refining(Channel.POSITION) for loaded in (True, False))


@pytest.mark.parametrize(("grip_costs", "kept"), [(1.0, {"presliding", "grip"}), (3.0, {"presliding"})])
def test_a_contact_that_grips_takes_no_other_refinements_place(
    problem: Problem, monkeypatch: pytest.MonkeyPatch, grip_costs: float, kept: set[str]
) -> None:
    path, friction = PAPER.paths[Channel.POSITION], Candidate("friction")
    plain = add_effect(path, friction, {"coulomb_v": 0.3})
    bench = Bench(problem, nominal_terms(path, problem.signal))
    null = fit_null(bench, path)
    asked: dict[str, Explanation] = {}

    def form(_: Bench, __: object, optional: tuple[str, ...], *___: object) -> Explanation:
        cost = {("presliding",): 2.0, GRIP: grip_costs}.get(optional, 4.0)
        found = replace(null, fit=replace(null.fit, path=plain, fitted=replace(null.fit.fitted, cost=cost)))
        asked[{("presliding",): "presliding", GRIP: "grip"}.get(optional, ", ".join(optional))] = found
        return found

    monkeypatch.setattr(search, "_form", form)
    task = Task(null, friction, seen=replace(null, fit=replace(null.fit, path=plain)))
    *ones, _ = search._refined(bench, task).finer
    assert {name for name, found in asked.items() if any(found is one for one in ones)} == kept


def test_edges_that_differ_are_one_dead_zone_however_small_it_is_beside_the_jumps() -> None:
    """On an integrating path the mean of the edges drifts like a bias, which hides the band between them."""
    voltage = 9.0 * signal.sawtooth(2.0 * np.pi * 0.3 * np.arange(900) * 0.02)
    found = best_single(run_with("dead_zone", {"half_width_v": 0.12, "centre_v": -0.05}, voltage))
    assert "dead_zone" in found
    assert found["half_width_v"] == pytest.approx(0.12, rel=0.1)
    assert found["centre_v"] == pytest.approx(-0.05, rel=0.1)


@pytest.mark.parametrize(("channel", "shift"), [(Channel.POSITION, 0.011), (Channel.PRESSURE, 2e5)])
def test_a_sensor_whose_zero_shifts_in_the_run_is_no_valves_null(channel: Channel, shift: float) -> None:
    time_s = np.arange(900) * 0.02
    voltage = 1.5 * np.sin(2.3 * time_s) + 2.0 * (channel is Channel.PRESSURE)
    path = PAPER.paths[channel]
    output = PathSimulator(channel, 0.02, voltage, np.zeros(0), 1e6, path.rest).simulate(path)
    output += shift * (time_s > 11.0) + 0.03 * shift * np.random.default_rng(3).standard_normal(voltage.size)
    run = Run(0.02, {channel.voltage_signal: voltage, channel.signal: output})
    problem = make_problem(run, PAPER, channel, DiscoverySettings())
    bench = Bench(problem, nominal_terms(path, problem.signal))
    bare = fit_null(bench, path)
    tasks = (Task(bare, candidate) for candidate in library(channel) if candidate.name == "bias")
    null, sensor = (search._settled(bench, search._refined(bench, search._plain(bench, task))).seen for task in tasks)
    assert null is not None
    assert sensor is not None
    assert sensor.fit.fitted.cost < min(0.8 * null.fit.fitted.cost, 1.2 * len(voltage))
    found = sensor.fit.path.effect("bias").parameters
    assert (found["jump_v"], found["jump_s"]) == pytest.approx((shift, 11.0), rel=0.03)


@pytest.mark.parametrize("numbers", [{"rate_v_per_s": 25.0}, {"rate_v_per_s": 25.0, "asymmetry": -0.6}])
def test_a_pressure_that_fills_no_faster_is_no_valve_that_slews(numbers: dict[str, float]) -> None:
    """Behind the valve's lags the slope breaks off at once, which a limit before them rounds."""
    time_s = np.arange(900) * 0.02
    voltage = 4.0 + 3.0 * np.sign(np.sin(2.3 * time_s))
    path = PAPER.with_effect(Channel.PRESSURE, "rate_limit", numbers, Attachment.OUTPUT).paths[Channel.PRESSURE]
    output = PathSimulator(Channel.PRESSURE, 0.02, voltage, np.zeros(0), 1e6, path.rest).simulate(path)
    output += 1e4 * np.random.default_rng(3).standard_normal(voltage.size)
    run = Run(0.02, {"load_voltage_v": voltage, "pressure_pa": output})
    problem = make_problem(run, PAPER, Channel.PRESSURE, DiscoverySettings())
    bench = Bench(problem, nominal_terms(path, problem.signal))
    bare = fit_null(bench, PAPER.paths[Channel.PRESSURE])
    tried = [c for c in library(Channel.PRESSURE) if c.name == "rate_limit"]
    found = [search._refined(bench, search._plain(bench, Task(bare, candidate))) for candidate in tried]
    costs = {(t.candidate.at, t.candidate.apart): min(e.fit.fitted.cost for e in forms_of(t)) for t in found}
    behind = costs.pop((Attachment.OUTPUT, False))
    assert behind < 1.2 * len(voltage)
    assert min(costs.values()) > 1.5 * behind


@pytest.mark.parametrize(
    ("effect", "numbers"),
    [
        ("bias", {"bias_v": 0.0, "jump_v": -0.9, "jump_s": 11.0}),
        ("gain_drift", {"rate_per_s": 0.0, "jump": -0.6, "jump_s": 11.0}),
    ],
)
def test_a_glance_sees_what_comes_in_the_run(effect: str, numbers: dict[str, float]) -> None:
    """Beside another effect, what it would be if it were there from the start is not worth a second look."""
    voltage = 1.5 * np.sign(np.sin(2.3 * np.arange(900) * 0.02))
    late = PAPER.with_effect(Channel.POSITION, effect, numbers)
    problem = run_with("dead_zone", {"half_width_v": 0.16}, voltage, rig=late)
    bench = Bench(problem, nominal_terms(PAPER.paths[Channel.POSITION], problem.signal))
    null = fit_null(bench, PAPER.paths[Channel.POSITION])
    seen = glance(bench, Task(null, Candidate(effect))).seen
    assert seen is not None
    assert seen.fit.path.effect(effect).parameters["jump_s"] == pytest.approx(11.0, abs=0.2)
    assert seen.fit.fitted.cost < 0.1 * null.fit.fitted.cost


@pytest.mark.parametrize(("between_v", "starts"), [(0.2, 6), (5.0, 3)])
def test_friction_begins_on_what_holds_on_between_jumps_too(between_v: float, starts: int) -> None:
    time_s = np.arange(900) * 0.02
    voltage = np.where(np.mod(time_s, 3.0) < 0.3, 8.0, between_v * np.sin(2.1 * time_s))
    problem = run_with("friction", {"coulomb_v": 0.05}, voltage)
    path = PAPER.paths[Channel.POSITION]
    begun = grid(problem, path, Candidate("friction"), "coulomb_v", problem.residual(path))
    assert len(begun) == starts
    assert min(begun) < 0.1 * between_v


def test_far_outside_the_start_that_leaves_least_is_not_the_only_one_looked_at() -> None:
    """A friction that holds between jumps is nearer to none at all than one half as large, but leads nowhere."""
    jumps = np.arange(900) % 120 < 4
    held = run_with("friction", {"coulomb_v": 0.6}, np.sign(np.sin(0.026 * np.arange(900))) * np.where(jumps, 3.0, 0.7))
    path = PAPER.paths[Channel.POSITION]
    bench = Bench(held, nominal_terms(path, held.signal))
    task = Task(as_given(bench, path), Candidate("friction"))
    starts, _, like = starts_of(bench, task, {})
    alone = [fit_hypothesis(held, like, [x], 0) for x in starts]
    nearest = min(range(len(starts)), key=lambda i: alone[i].fitted.cost)
    assert fit_hypothesis(held, like, [starts[nearest]], 3).rss > 100.0 * len(held.measured)
    seen = glance(bench, task).seen
    assert seen is not None
    assert seen.fit.rss < 2.0 * len(held.measured)


@pytest.mark.parametrize("share", [-0.4, -1.8, -3.0])
def test_a_mass_that_rides_on_the_path_is_a_mode_with_a_negative_share(share: float) -> None:
    numbers = {"frequency_hz": 3.0, "damping": 0.08, "share": share, "riding": 0.16 * share}
    found = best_single(run_with("resonance", numbers, 1.5 * np.sign(np.sin(2.3 * np.arange(900) * 0.02))))
    assert "resonance" in found
    assert found["share"] == pytest.approx(share, abs=0.05)


@pytest.mark.parametrize("further", [False, True])
def test_a_further_effect_is_followed_only_as_far_as_the_best_glance_promises(
    problem: Problem, monkeypatch: pytest.MonkeyPatch, further: bool
) -> None:
    """A single one is followed all its way: it has to be told from every other."""
    path = PAPER.paths[Channel.POSITION]
    bench = Bench(problem, nominal_terms(path, problem.signal))
    base = fit_null(bench, path)
    if further:
        bias = add_effect(path, Candidate("bias"), {"bias_v": 0.01})
        fit = fit_hypothesis(problem, hypothesis(problem, bias, bench.nominal, {"bias": ("bias_v",)}), iterations=2)
        base = bench.explained(fit, ("bias",), {"bias": ("bias_v",)})
    stages: list[list[Task]] = []

    def noted(
        bench: Bench, work: Stage, tasks: Sequence[Task], told: bool = True, **before: Sequence[Task]
    ) -> list[Task]:
        stages.append(list(tasks))
        if len(stages) == 2:
            raise StoppedError([])
        return each(bench, work, tasks, told, **before)

    monkeypatch.setattr(search, "each", noted)
    with pytest.raises(StoppedError):
        scan(bench, [base], 3, 1)
    followed = stages[1]
    best = min(t.seen.fit.fitted.cost for t in followed if t.seen is not None)
    assert 3 <= len(followed) < len(stages[0])
    assert {t.rival for t in followed} == {search.SEEN * best if further else np.inf}


def test_a_further_effect_is_settled_though_it_was_not_followed_to_its_end(
    problem: Problem, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = PAPER.paths[Channel.POSITION]
    bench = Bench(problem, nominal_terms(path, problem.signal))
    bias = add_effect(path, Candidate("bias"), {"bias_v": 0.01})
    fit = fit_hypothesis(problem, hypothesis(problem, bias, bench.nominal, {"bias": ("bias_v",)}), iterations=2)
    settled: list[Task] = []

    def noted(
        bench: Bench, work: Stage, tasks: Sequence[Task], told: bool = True, **before: Sequence[Task]
    ) -> list[Task]:
        if work is search._settled:
            settled.extend(tasks)
        return each(bench, work, tasks, told, **before)

    monkeypatch.setattr(search, "each", noted)
    monkeypatch.setattr(search, "SEEN", 0.5)
    scan(bench, [bench.explained(fit, ("bias",), {"bias": ("bias_v",)})], 3, 1)
    best = min(form.fit.fitted.cost for task in settled for form in forms_of(task))
    assert len(settled) >= 3
    assert {task.rival for task in settled} == {SETTLED * best}


def test_what_is_far_behind_one_that_leaves_noise_is_not_refined(monkeypatch: pytest.MonkeyPatch) -> None:
    """It stays among what was found, in its plain form."""
    time_s = 0.02 * np.arange(900)
    shut = run_with("dead_zone", {"half_width_v": 0.5}, 2.0 * np.sin(1.7 * time_s))
    path = PAPER.paths[Channel.POSITION]
    bench = Bench(shut, nominal_terms(path, shut.signal))
    refined: set[str] = set()
    own = search._refined

    def noted(bench: Bench, task: Task) -> Task:
        refined.add(task.candidate.name)
        return own(bench, task)

    monkeypatch.setattr(search, "_refined", noted)
    found = scan(bench, [fit_null(bench, path)], 8, 8)
    names = {e.added[0] for e in found}
    assert found[0].added == ("dead_zone",)
    assert "dead_zone" in refined
    assert names > refined
    costs = {e.added[0]: e.fit.fitted.cost for e in found}
    assert all(costs[name] > HOPELESS * found[0].fit.fitted.cost for name in names - refined)


@pytest.mark.parametrize("stage", ["_plain", "_refined", "_settled"])
def test_what_a_stage_before_found_is_known_when_the_next_is_stopped(
    monkeypatch: pytest.MonkeyPatch, stage: str
) -> None:
    shut = run_with("dead_zone", {"half_width_v": 0.5}, 2.0 * np.sin(1.7 * 0.02 * np.arange(900)))
    path = PAPER.paths[Channel.POSITION]
    bench = Bench(shut, nominal_terms(path, shut.signal))

    def stopped_at_once(_: Bench, __: Task) -> Task:
        raise KeyboardInterrupt

    monkeypatch.setattr(search, stage, stopped_at_once)
    null = fit_null(bench, path)
    with pytest.raises(StoppedError) as stopped:
        scan(bench, [null], 3, 3)
    best = min(stopped.value.found, key=lambda e: e.fit.fitted.cost)
    assert best.added == ("dead_zone",)
    assert best.fit.fitted.cost < 0.1 * null.fit.fitted.cost


@pytest.mark.parametrize(("rival", "whole"), [(np.inf, True), (1e-9, False)])
def test_all_refinements_at_once_are_fitted_only_where_one_comes_near(
    problem: Problem, monkeypatch: pytest.MonkeyPatch, rival: float, whole: bool
) -> None:
    path = PAPER.paths[Channel.POSITION]
    bench = Bench(problem, nominal_terms(path, problem.signal))
    task = search._plain(bench, Task(fit_null(bench, path), Candidate("bias")))
    free: list[tuple[str, ...]] = []
    own = search._form

    def noted(bench: Bench, task: Task, optional: tuple[str, ...], *others: object) -> Explanation:
        free.append(optional)
        return own(bench, task, optional, *others)  # type: ignore[arg-type]

    monkeypatch.setattr(search, "_form", noted)
    search._refined(bench, replace(task, rival=rival))
    assert task.seen is not None
    left = task.base.fit.residual
    names = refinements(problem, task.seen.fit.path, task.candidate, left, True, bench.nominal).names
    assert len(names) > 1
    assert (names in free) is whole


def test_what_two_bases_make_the_same_is_followed_on_one(problem: Problem, monkeypatch: pytest.MonkeyPatch) -> None:
    """The second has an effect of the model's own that the run does not come to."""
    path = PAPER.paths[Channel.POSITION]
    bench = Bench(problem, nominal_terms(path, problem.signal))
    limited = add_effect(path, Candidate("saturation"), {"upper_v": 1e3, "lower_v": -1e3})
    stages: list[list[Task]] = []

    def noted(bench: Bench, work: Stage, tasks: Sequence[Task], **how: object) -> list[Task]:
        stages.append(list(tasks))
        if len(stages) == 2:
            raise StoppedError([])
        return each(bench, work, tasks)

    monkeypatch.setattr(search, "each", noted)
    monkeypatch.setattr(search, "library", lambda *_: (Candidate("bias"), Candidate("delay")))
    with pytest.raises(StoppedError):
        scan(bench, [fit_null(bench, limited), fit_null(bench, path)], 9, 9)
    assert [len(stage) for stage in stages] == [4, 2]
    assert all(task.base.fit.path.effects for task in stages[1])
