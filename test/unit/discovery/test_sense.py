"""An effect at the end of its range is another one under its name."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))

from cases import Case, make

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import EffectSpec, ModelSpec
from dt_station_nodes.core.models.effects import Attachment, Quantity
from dt_station_nodes.core.run import Run
from dt_station_nodes.discovery.candidates import Candidate, add_effect, hypothesis
from dt_station_nodes.discovery.hypothesis_fit import fit_hypothesis
from dt_station_nodes.discovery.problem import Problem, make_problem
from dt_station_nodes.discovery.selection import Bench, Explanation
from dt_station_nodes.discovery.sense import sensible
from dt_station_nodes.discovery.settings import DiscoverySettings
from dt_station_nodes.discovery.terms import nominal_terms

MODEL = Path(__file__).parents[3] / "config" / "models" / "paper.yaml"
PAPER = ModelSpec.from_yaml(MODEL.read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def run() -> Run:
    return make(Case(seconds=12.0))


@pytest.fixture(scope="module")
def problem(run: Run) -> Problem:
    return make_problem(run, PAPER, Channel.POSITION, DiscoverySettings())


def as_it_is(
    problem: Problem, name: str, parameters: dict[str, float], at: Attachment | None = None, **nominal: object
) -> Explanation:
    """An effect at given parameters and a place (None: its usual one), nothing fitted."""
    path = PAPER.paths[problem.channel].model_copy(update=nominal)
    bench = Bench(problem, nominal_terms(PAPER.paths[problem.channel], problem.signal))
    freed = {name: Candidate(name).required}
    begin = hypothesis(problem, add_effect(path, Candidate(name, at), parameters), bench.nominal, freed)
    return bench.explained(fit_hypothesis(problem, begin, iterations=0), (name,), freed)


@pytest.mark.parametrize(
    ("name", "is_one", "is_none"),
    [
        ("dead_zone", {"half_width_v": 0.3, "centre_v": 0.2}, {"half_width_v": 0.3, "centre_v": 0.9}),
        ("dead_zone", {"half_width_v": 0.3, "leak": 0.8}, {"half_width_v": 30.0, "leak": 0.8}),
        ("hysteresis", {"half_width_v": 0.3}, {"half_width_v": 40.0}),
        ("hysteresis", {"half_width_v": 40.0, "depth": 0.3}, {"half_width_v": 40.0, "depth": 0.9}),
        ("hysteresis", {"half_width_v": 0.1, "depth": 1.1}, {"half_width_v": 0.1, "depth": 1.3}),
        (
            "hysteresis",
            {"half_width_v": 0.1, "bouc_wen": 1.0, "uneven": -0.3},
            {"half_width_v": 0.1, "bouc_wen": 1.0, "uneven": -0.8},
        ),
        ("backlash", {"half_width": 0.002, "lag_s": 0.02}, {"half_width": 0.0, "lag_s": 0.26}),
        ("saturation", {"upper_v": 1.0, "lower_v": -1.0}, {"upper_v": -1.0, "lower_v": 1.0}),
        ("resonance", {"frequency_hz": 4.0, "damping": 0.1}, {"frequency_hz": 4.0, "damping": 0.45}),
        ("resonance", {"frequency_hz": 4.0, "damping": 0.1}, {"frequency_hz": 23.0, "damping": 0.1}),
        (
            "resonance",
            {"frequency_hz": 4.0, "damping": 0.1, "share": 0.1},
            {"frequency_hz": 4.0, "damping": 0.4, "share": 0.2, "riding": 0.4},
        ),
        ("extra_lag", {"time_constant_s": 0.06, "inertia_s": 0.06}, {"time_constant_s": 0.06, "inertia_s": 0.12}),
        (
            "extra_lag",
            {"time_constant_s": 0.05, "inertia_s": 0.08, "second_s": 0.3},
            {"time_constant_s": 0.05, "inertia_s": 0.08, "second_s": 0.01},
        ),
        (
            "extra_lag",
            {"time_constant_s": 0.05, "inertia_s": 0.08, "second_s": 0.3},
            {"time_constant_s": 0.05, "inertia_s": 0.25, "second_s": 0.9},
        ),
        ("asymmetric_gain", {"asymmetry": -0.3}, {"asymmetry": -0.9}),
        ("asymmetric_gain", {"asymmetry": 0.3, "centre_v": 0.1}, {"asymmetry": 0.3, "centre_v": 30.0}),
        ("asymmetric_gain", {"asymmetry": -0.7}, {"asymmetry": -0.7, "centre_v": 0.1}),
        ("cubic_stiffness", {"coefficient": 400.0, "linear": 0.1}, {"coefficient": 0.1, "linear": 3.0}),
        ("overflow", {"limit": 0.01, "weir_s": 0.5}, {"limit": -0.05, "weir_s": 0.5}),
        ("overflow", {"limit": 0.01}, {"limit": 0.01, "opening_s": 0.4}),
        (
            "gain_drift",
            {"rate_per_s": 0.0, "heat_per_v2": -0.01, "heat_s": 8.0},
            {"rate_per_s": 0.0, "heat_per_v2": -0.01, "heat_s": 4.5},
        ),
        ("cubic_stiffness", {"coefficient": -400.0, "linear": 1.0}, {"coefficient": -400.0, "linear": 0.1}),
        ("cubic_stiffness", {"coefficient": 4.0}, {"coefficient": -4.0, "centre": 0.06}),
        ("cubic_stiffness", {"coefficient": -400.0, "linear": 1.0}, {"coefficient": -0.1, "linear": 3.0}),
        (
            "cubic_stiffness",
            {"coefficient": 400.0, "linear": 3.0, "centre": -0.06},
            {"coefficient": 400.0, "linear": 3.0},
        ),
    ],
)
def test_an_effect_is_what_its_name_says(
    problem: Problem, name: str, is_one: dict[str, float], is_none: dict[str, float]
) -> None:
    assert sensible(as_it_is(problem, name, is_one), problem)
    assert not sensible(as_it_is(problem, name, is_none), problem)


def test_an_effect_beside_a_nominal_parameter_at_its_bound_explains_nothing(problem: Problem) -> None:
    assert sensible(as_it_is(problem, "bias", {"bias_v": 0.1}, time_scale=1.2), problem)
    assert not sensible(as_it_is(problem, "bias", {"bias_v": 0.1}, time_scale=20.0), problem)


@pytest.mark.parametrize(("place", "is_one"), [(0.0, True), (0.6, True), (-0.1, True), (-0.3, False), (1.3, False)])
def test_a_cube_of_a_pressure_lies_about_where_the_run_comes(run: Run, place: float, is_one: bool) -> None:
    pressure = make_problem(run, PAPER, Channel.PRESSURE, DiscoverySettings())
    low, high = float(pressure.measured.min()), float(pressure.measured.max())
    centre = low + place * (high - low) - PAPER.paths[Channel.PRESSURE].rest
    cube = {"coefficient": 1e-21, "centre": centre}
    assert sensible(as_it_is(pressure, "cubic_stiffness", cube), pressure) is is_one
    # Play has to be taken up on either side of it.
    for play, both in ((0.3, place == 0.6), (0.6, False)):
        gap = {**cube, "play": play * (high - low)}
        assert sensible(as_it_is(pressure, "cubic_stiffness", gap), pressure) is both


def test_a_leak_loses_pressure(run: Run) -> None:
    pressure = make_problem(run, PAPER, Channel.PRESSURE, DiscoverySettings())
    assert sensible(as_it_is(pressure, "leakage", {"coefficient": 0.1}), pressure)
    assert not sensible(as_it_is(pressure, "leakage", {"coefficient": -0.1}), pressure)
    assert sensible(as_it_is(pressure, "leakage", {"coefficient": 0.1, "base": 1.0}), pressure)
    assert not sensible(as_it_is(pressure, "leakage", {"coefficient": 0.1, "base": 2.0}), pressure)


def test_a_relief_valve_relieves(run: Run) -> None:
    pressure = make_problem(run, PAPER, Channel.PRESSURE, DiscoverySettings())
    assert sensible(as_it_is(pressure, "overflow", {"limit": 2e6, "override": 0.2}), pressure)
    weak = {"limit": 2e6, "override": 0.53}
    assert sensible(as_it_is(pressure, "overflow", weak), pressure)
    # Most of what comes on top is a bend, unless it leaves nothing else.
    more = replace(pressure, measured=pressure.measured + 2.0 * pressure.noise * np.sin(np.arange(len(run))))
    assert sensible(as_it_is(more, "overflow", {"limit": 2e6, "override": 0.2}), more)
    assert not sensible(as_it_is(more, "overflow", weak), more)
    fed_back = {"limit": 2e6, "weir_s": 0.1, "weir_exponent": 1.5}
    assert sensible(as_it_is(pressure, "overflow", fed_back), pressure)
    assert not sensible(as_it_is(pressure, "overflow", {**fed_back, "weir_exponent": 2.0}), pressure)
    always_open = replace(pressure, measured=pressure.measured + 4e6)
    assert not sensible(as_it_is(pressure, "overflow", fed_back), always_open)


@pytest.mark.parametrize(("noises", "stops"), [(2.0, True), (6.0, False)])
def test_a_stop_is_pressed_against_within_the_noise_and_not_overrun(
    problem: Problem, noises: float, stops: bool
) -> None:
    rest = PAPER.paths[Channel.POSITION].rest
    pressed = replace(problem, measured=np.full_like(problem.measured, rest + 0.01 + noises * problem.noise))
    assert sensible(as_it_is(problem, "overflow", {"limit": 0.01}), pressed) is stops


def test_what_leaves_most_of_what_comes_on_top_is_no_stop(problem: Problem) -> None:
    pressed = replace(problem, measured=np.full_like(problem.measured, PAPER.paths[Channel.POSITION].rest))
    for override, stops in ((0.2, True), (0.83, False)):
        assert sensible(as_it_is(problem, "overflow", {"limit": 0.01, "override": override}), pressed) is stops


def test_what_bends_as_well_with_its_loop_shut_is_a_curve(run: Run) -> None:
    pressure = make_problem(run, PAPER, Channel.PRESSURE, DiscoverySettings())
    for half_width_v, loops in ((0.2, True), (1e-4, False)):
        numbers = {"half_width_v": half_width_v, "bend_per_v": 0.3, "depth": 0.4}
        true = add_effect(PAPER.paths[Channel.PRESSURE], Candidate("hysteresis"), numbers)
        noise = pressure.noise * np.random.default_rng(3).standard_normal(len(run))
        measured = replace(pressure, measured=pressure.simulate(true) + noise)
        assert sensible(as_it_is(measured, "hysteresis", numbers), measured) is loops


@pytest.mark.parametrize("noisy", [True, False])
def test_a_mode_far_larger_than_the_path_leaves_nothing_else(problem: Problem, noisy: bool) -> None:
    size = problem.noise if noisy else 0.01 * problem.negligible
    quiet = replace(problem, noise=problem.noise if noisy else 0.0)
    hiss = size * np.random.default_rng(3).standard_normal(len(problem.measured))
    more = 2.0 * problem.noise * np.sin(np.arange(len(hiss)))
    for beside_rate, left, is_one in ((9.0, hiss, True), (9.0, hiss + more, False), (1.0, hiss + more, True)):
        numbers = {"frequency_hz": 3.0, "damping": 0.1, "beside_rate": beside_rate}
        true = add_effect(PAPER.paths[Channel.POSITION], Candidate("resonance", Attachment.OUTPUT), numbers)
        measured = replace(quiet, measured=quiet.simulate(true) + left)
        assert sensible(as_it_is(measured, "resonance", numbers, Attachment.OUTPUT), measured) is is_one


@pytest.mark.parametrize(
    ("times", "damping", "share", "is_one"),
    [
        (1.1, 0.2, 0.1, False),
        (0.9, 0.2, 0.1, False),
        (1.1, 0.05, 0.1, True),
        (1.1, 0.2, 1.0, True),
        (2.5, 0.2, 0.1, True),
    ],
)
def test_a_mode_tuned_to_what_drives_the_run_rings(
    problem: Problem, times: float, damping: float, share: float, is_one: bool
) -> None:
    tuned = replace(problem, excitations_hz=(2.0,))
    mode = {"frequency_hz": 2.0 * times, "damping": damping}
    assert sensible(as_it_is(tuned, "resonance", {**mode, "share": share}), tuned) is is_one
    beside = {**mode, "share": 1.0, "beside": share}
    assert sensible(as_it_is(tuned, "resonance", beside, Attachment.OUTPUT), tuned) is is_one


def test_a_loop_that_turns_back_leaves_nothing_else(run: Run) -> None:
    pressure = make_problem(run, PAPER, Channel.PRESSURE, DiscoverySettings())
    numbers = {"half_width_v": 0.3, "bouc_wen": 1.0, "depth": 1.5}
    true = add_effect(PAPER.paths[Channel.PRESSURE], Candidate("hysteresis"), numbers)
    noise = pressure.noise * np.random.default_rng(3).standard_normal(len(run))
    for more, is_one in ((0.0, True), (2.0, False)):
        beside = more * pressure.noise * np.sin(np.arange(len(run)))
        measured = replace(pressure, measured=pressure.simulate(true) + noise + beside)
        assert sensible(as_it_is(measured, "hysteresis", numbers), measured) is is_one


def test_a_spool_that_does_not_slip_is_a_loop_and_a_piston_need_not(run: Run, problem: Problem) -> None:
    pressure = make_problem(run, PAPER, Channel.PRESSURE, DiscoverySettings())
    assert sensible(as_it_is(pressure, "friction", {"coulomb_v": 0.2, "slip": 0.5}), pressure)
    assert not sensible(as_it_is(pressure, "friction", {"coulomb_v": 0.2, "slip": 0.1}), pressure)
    # Bristles so stiff that they hardly bend make it play.
    way = 1.0 / pressure.scales[Quantity.INPUT_PER_OUTPUT]
    assert sensible(as_it_is(pressure, "friction", {"coulomb_v": 0.2, "presliding": 0.05 * way}), pressure)
    assert not sensible(as_it_is(pressure, "friction", {"coulomb_v": 0.2, "presliding": 0.01 * way}), pressure)
    # Unless what breaks away is clearly more than what slides.
    for excess_v, breaks in ((0.02, False), (0.1, True)):
        spool = {"coulomb_v": 0.2, "static_excess_v": excess_v, "presliding": 0.01 * way}
        assert sensible(as_it_is(pressure, "friction", spool), pressure) is breaks
    # So soft that they bend wherever the run goes, they never slide.
    wherever = 0.095 * pressure.scales[Quantity.OUTPUT]
    assert not sensible(as_it_is(pressure, "friction", {"coulomb_v": 0.02, "presliding": wherever}), pressure)
    # Nor one that the run seldom moves faster than it creeps: that is a lag.
    for share, slips in ((0.2, True), (0.8, False)):
        creeps = {"coulomb_v": 0.2, "creep_velocity": share * pressure.scales[Quantity.VELOCITY]}
        assert sensible(as_it_is(pressure, "friction", creeps), pressure) is slips
    # Nor one with so little mass that no sample shows how it swings.
    for swing_s, shows in ((0.15 * run.sample_time_s, True), (0.05 * run.sample_time_s, False)):
        swings = {"coulomb_v": 0.2, "swing_s": swing_s}
        assert sensible(as_it_is(pressure, "friction", swings), pressure) is shows
    assert sensible(as_it_is(problem, "friction", {"coulomb_v": 0.2}), problem)


def test_play_on_a_voltage_that_goes_through_a_loop_is_a_part_of_it(problem: Problem) -> None:
    path = PAPER.paths[Channel.POSITION]
    nominal = nominal_terms(path, problem.signal)
    play, loop = Candidate("backlash", Attachment.INPUT), Candidate("hysteresis")
    alone = add_effect(path, play, {"half_width": 0.1})
    for both, sense in ((alone, True), (add_effect(alone, loop, {"half_width_v": 0.1}), False)):
        names = tuple(effect.name for effect in both.effects)
        begin = hypothesis(problem, both, nominal, {})
        explained = Bench(problem, nominal).explained(fit_hypothesis(problem, begin, iterations=0), names, {})
        assert sensible(explained, problem) is sense


@pytest.mark.parametrize(("share", "plays"), [(0.15, True), (0.05, False)])
def test_play_does_a_tenth_at_least_of_what_closing_it_does(problem: Problem, share: float, plays: bool) -> None:
    closing = 0.02 * problem.scales[Quantity.VELOCITY]
    numbers = {"half_width": share * closing, "lag_s": 0.02}
    assert sensible(as_it_is(problem, "backlash", numbers), problem) is plays


def test_a_leaking_piston_creeps_the_way_its_load_pushes(problem: Problem) -> None:
    assert sensible(as_it_is(problem, "leakage", {"coefficient": 1e-9}), problem)
    assert not sensible(as_it_is(problem, "leakage", {"coefficient": -1e-9}), problem)
    assert sensible(as_it_is(problem, "leakage", {"coefficient": -1e-9, "sag_per_s": 0.1}), problem)
    assert sensible(as_it_is(problem, "leakage", {"coefficient": 1e-9, "against": 1.0}), problem)
    assert not sensible(as_it_is(problem, "leakage", {"coefficient": -1e-9, "against": 1.0}), problem)
    # One that leaves nothing but noise may come from the supply.
    against = add_effect(PAPER.paths[Channel.POSITION], Candidate("leakage"), {"coefficient": -1e-9})
    all_of_it = replace(problem, measured=problem.simulate(against))
    assert sensible(as_it_is(problem, "leakage", {"coefficient": -1e-9}), all_of_it)
    # Beside what sags, next to nothing against a motion is nothing.
    nothing = -1e-3 * problem.scales[Quantity.VELOCITY_PER_LOAD]
    assert sensible(as_it_is(problem, "leakage", {"coefficient": nothing, "against": 1.0, "sag_per_s": 0.1}), problem)
    assert not sensible(as_it_is(problem, "leakage", {"coefficient": nothing, "against": 1.0}), problem)


def test_a_pressure_valve_works_about_a_voltage_and_a_cylinders_does_not(run: Run, problem: Problem) -> None:
    band = {"half_width_v": 0.2, "centre_v": 2.0}
    pressure = make_problem(run, PAPER, Channel.PRESSURE, DiscoverySettings())
    for working, sense in ((1.0, True), (0.0, False)):
        assert sensible(as_it_is(pressure, "dead_zone", {**band, "working": working}), pressure) is sense
    assert not sensible(as_it_is(problem, "dead_zone", {**band, "working": 1.0}), problem)


def test_a_band_that_no_voltage_comes_out_of_again_is_a_limit(run: Run) -> None:
    pressure = make_problem(run, PAPER, Channel.PRESSURE, DiscoverySettings())
    highest_v = float(np.max(run.signals[Channel.PRESSURE.voltage_signal]))
    for half_width_v, sense in ((0.2, True), (0.6, False)):
        band = {"half_width_v": half_width_v, "centre_v": highest_v - 0.5, "working": 1.0}
        assert sensible(as_it_is(pressure, "dead_zone", band), pressure) is sense


def test_a_band_that_no_voltage_goes_into_is_a_bias(run: Run) -> None:
    pressure = make_problem(run, PAPER, Channel.PRESSURE, DiscoverySettings())
    lowest_v = float(np.min(run.signals[Channel.PRESSURE.voltage_signal]))
    for above_v, sense in ((0.3, True), (-0.3, False)):
        band = {"half_width_v": 0.2, "centre_v": lowest_v + above_v, "working": 1.0}
        assert sensible(as_it_is(pressure, "dead_zone", band), pressure) is sense


@pytest.mark.parametrize(
    ("half_width_v", "bias_v", "sense"),
    [(0.3, 0.4, False), (0.3, -0.1, False), (0.3, -0.4, True), (0.6, 0.4, True), (0.3, 0.0, True)],
)
def test_a_band_that_no_voltage_goes_into_is_a_part_of_the_bias_beside_it(
    run: Run, half_width_v: float, bias_v: float, sense: bool
) -> None:
    pressure = make_problem(run, PAPER, Channel.PRESSURE, DiscoverySettings())
    simulator = pressure.simulator
    lifted = replace(pressure, simulator=replace(simulator, voltage_v=0.5 + np.maximum(simulator.voltage_v, 0.0)))
    bias = (EffectSpec(name="bias", parameters={"bias_v": bias_v}),) if bias_v else ()
    effects = (*PAPER.paths[Channel.PRESSURE].effects, *bias)
    band = {"half_width_v": half_width_v}
    assert sensible(as_it_is(lifted, "dead_zone", band, effects=effects), lifted) is sense


def test_what_bends_over_most_of_the_voltage_is_neither_a_kink_nor_a_band(run: Run) -> None:
    pressure = make_problem(run, PAPER, Channel.PRESSURE, DiscoverySettings())
    middle = float(np.median(run.signals[Channel.PRESSURE.voltage_signal]))
    kink = {"asymmetry": -0.05, "centre_v": middle}
    band = {"half_width_v": 0.1, "centre_v": middle, "working": 1.0}
    for rounding_v, sense in ((0.05, True), (2.0, False)):
        assert sensible(as_it_is(pressure, "asymmetric_gain", {**kink, "rounding_v": rounding_v}), pressure) is sense
        assert sensible(as_it_is(pressure, "dead_zone", {**band, "rounding_v": rounding_v}), pressure) is sense


def test_a_second_tone_is_another_one_and_what_swells_does_so_again(problem: Problem) -> None:
    tone = {"amplitude": 1e-3, "frequency_hz": 2.0, "phase_rad": 0.0}
    per_run_hz = 1.0 / problem.length_s
    for turns, sense in ((3.0, True), (0.5, False)):
        second = {**tone, "second_share": 0.5, "second_hz": 2.0 + turns * per_run_hz}
        swell = {**tone, "swell": 0.5, "swell_hz": turns * per_run_hz}
        for parameters in (second, swell):
            assert sensible(as_it_is(problem, "periodic_disturbance", parameters), problem) is sense
        modulated = {**swell, "modulation_rad": 1.0, "modulation_hz": (turns - 0.4) * per_run_hz}
        assert sensible(as_it_is(problem, "periodic_disturbance", modulated), problem) is sense
    assert sensible(as_it_is(problem, "periodic_disturbance", tone), problem)


def test_what_is_over_within_a_cycle_is_a_push_and_no_burst_of_an_oscillation(problem: Problem) -> None:
    tone = {"amplitude": 1e-3, "frequency_hz": 2.0, "phase_rad": 0.0, "burst_period_s": 5.0}
    for cycles, sense in ((2.0, True), (0.5, False)):
        bursts = {**tone, "burst_share": cycles / (2.0 * 5.0)}
        assert sensible(as_it_is(problem, "periodic_disturbance", bursts), problem) is sense
        pushes = {**bursts, "push_share": 0.25}
        assert sensible(as_it_is(problem, "periodic_disturbance", pushes), problem)
