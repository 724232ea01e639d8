"""Forms that no fit reaches from an effect's plain one are candidates of their own, with starts that do."""

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy import signal
from scipy.signal import cont2discrete, tf2ss

sys.path.insert(0, str(Path(__file__).parent))

from valves import BARE, PAPER, SPEC, WAVES, answered

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import PathSimulator, PathSpec
from dt_station_nodes.core.models.effects import Attachment
from dt_station_nodes.core.run import Run
from dt_station_nodes.discovery import DiscoverySettings
from dt_station_nodes.discovery.candidates import Candidate, hypothesis, in_vocabulary, library, plain_starts
from dt_station_nodes.discovery.further_forms import (
    BELL,
    BY_LOAD,
    EDGED,
    FURTHER,
    HEAVY,
    KNEE,
    ONE_WAY,
    PLACES,
    RESEATED,
    SHAKEN,
    WIDENED,
    WORN,
)
from dt_station_nodes.discovery.hypothesis_fit import Fit, fit_hypothesis
from dt_station_nodes.discovery.problem import Problem, make_problem
from dt_station_nodes.discovery.terms import nominal_terms

PISTON = PAPER.paths[Channel.POSITION].model_copy(update={"effects": (), "disturbance": None})
FINE_S, FINER = 0.001, 20
SAMPLED = np.repeat(np.arange(1200) * FINE_S * FINER, FINER)
LINES_V = np.linspace(0.0, 5.2, 81)
UP_V, DOWN_V = (lines.ravel() for lines in np.meshgrid(LINES_V[1:], LINES_V[:-1], indexing="ij"))


def relays(given: np.ndarray, width_v: float, bell_v: float) -> np.ndarray:
    """What Preisach's triangle of relays passes, their density a bell of centres and half a bell of widths."""
    kept = UP_V > DOWN_V
    up, down = UP_V[kept], DOWN_V[kept]
    centre, half = 0.5 * (up + down), 0.5 * (up - down)
    weight = np.exp(-0.5 * (half / width_v) ** 2 - 0.5 * ((centre - 2.6) / bell_v) ** 2)
    state, passed = np.where(centre < given[0], 1.0, -1.0), []
    for voltage in given:
        state = np.where(voltage >= up, 1.0, np.where(voltage <= down, -1.0, state))
        passed.append(float(weight @ state))
    return 2.6 * np.array(passed) / float(weight.sum())


def magnetised(wave: int) -> Run:
    """Pressure of a valve of which 0.4 is magnetised."""
    given = 2.4 + 1.8 * WAVES[wave]
    loop = relays(given, 0.5, 1.0)
    return answered(given, 0.6 * given + 0.4 * (loop - loop[0] + given[0]), wave)


def fitted(problem: Problem, candidate: Candidate, bare: PathSpec = BARE) -> Fit:
    nominal = nominal_terms(bare, problem.signal)
    paths = plain_starts(problem, bare, candidate, problem.residual(bare))
    free = {candidate.name: candidate.required}
    hypotheses = [hypothesis(problem, path, nominal, free) for path in paths]
    return fit_hypothesis(problem, hypotheses[0], [h.start() for h in hypotheses], 20, 4)


@pytest.mark.parametrize("wave", [0, 1])
def test_relays_dense_as_a_bell_are_found_with_their_numbers(wave: int) -> None:
    problem = make_problem(magnetised(wave), SPEC, Channel.PRESSURE, DiscoverySettings())
    bell, plain = (fitted(problem, Candidate("hysteresis", also=also)) for also in (BELL, ()))
    assert bell.rss < 0.02 * plain.rss
    numbers = bell.path.effect("hysteresis").parameters
    assert numbers["open_at_v"] == pytest.approx(2.6, abs=0.1)
    # A bell of that standard deviation has this slope in its middle, in volts per volt of its height.
    assert numbers["bend_per_v"] == pytest.approx(2.0 / np.sqrt(2.0 * np.pi), rel=0.15)
    height_v = numbers["depth"] * numbers["steepness"] / numbers["bend_per_v"]
    assert height_v == pytest.approx(0.4 * 2.6, rel=0.2)


def moved(servo_v: np.ndarray, load_v: np.ndarray, acting_v: np.ndarray) -> Problem:
    """A piston that `acting_v` moves where `servo_v` was given, and a little noise."""
    position = PathSimulator(Channel.POSITION, FINE_S, acting_v, np.zeros(0), 1e6, 0.0).simulate(PISTON)[::FINER]
    position = position + 1e-4 * np.random.default_rng(3).standard_normal(len(position))
    signals = {"servo_voltage_v": servo_v[::FINER], "load_voltage_v": load_v[::FINER], "position_m": position}
    return make_problem(Run(FINE_S * FINER, signals), PAPER, Channel.POSITION, DiscoverySettings())


@pytest.mark.parametrize("knee_v", [0.8, 1.5])
def test_a_coil_whose_core_saturates_is_found_with_its_numbers(knee_v: float) -> None:
    servo, passed, current = 1.5 * np.sign(np.sin(2.3 * SAMPLED)), [], 0.0
    for voltage in servo:
        current += FINE_S * (voltage - current) * (1.0 + (current / knee_v) ** 2) / 0.15
        passed.append(current)
    problem = moved(servo, np.zeros_like(servo), np.array(passed))
    lag, plain = (fitted(problem, Candidate("extra_lag", also=a), PISTON) for a in (("saturation",), ()))
    assert lag.rss < min(0.2 * plain.rss, 1.3 * len(problem.measured))
    numbers = lag.path.effect("extra_lag").parameters
    assert numbers["time_constant_s"] == pytest.approx(0.15, rel=0.05)
    assert numbers["saturation"] == pytest.approx(1.0 / knee_v, rel=0.05)


def test_what_passes_a_lag_by_in_part_is_found_where_bent_nominal_numbers_hide_it() -> None:
    servo, passed, behind = 1.2 * signal.sawtooth(1.2 * SAMPLED + 0.5 * np.pi, 0.5), [], 0.0
    for voltage in servo:
        passed.append(0.55 * voltage + 0.45 * behind)
        behind += FINE_S * (voltage - behind) / 0.23
    problem = moved(servo, np.zeros_like(servo), np.array(passed))
    form, plain = (fitted(problem, Candidate("extra_lag", also=a), PISTON) for a in (("straight",), ()))
    assert form.rss < min(0.7 * plain.rss, 1.1 * len(problem.measured))
    numbers = form.path.effect("extra_lag").parameters
    assert (numbers["time_constant_s"], numbers["straight"]) == pytest.approx((0.23, 0.55), rel=0.03)


def test_amplifiers_that_share_a_ground_are_found_where_a_voltage_added_explains_nothing() -> None:
    servo, load = 1.5 * np.sign(np.sin(2.3 * SAMPLED)), 2.0 + np.sign(np.sin(0.9 * SAMPLED))
    problem = moved(servo, load, servo * (1.0 + 0.06 * (load - 2.0)))
    product, added = (fitted(problem, Candidate("cross_coupling", also=a), PISTON) for a in (("gain_per_v",), ()))
    assert product.rss < min(0.1 * added.rss, 1.3 * len(problem.measured))
    numbers = product.path.effect("cross_coupling").parameters
    # The gain is that of no load voltage.
    assert numbers["gain_per_v"] == pytest.approx(0.06 / (1.0 - 2.0 * 0.06), rel=0.03)


def test_what_crosses_over_only_while_the_other_channel_moves_is_found_with_its_numbers() -> None:
    servo, load, kept, crossed = 1.5 * np.sign(np.sin(2.3 * SAMPLED)), 2.0 + np.sign(np.sin(0.9 * SAMPLED)), 2.0, []
    for voltage in load:
        crossed.append(voltage - kept)
        kept += FINE_S * (voltage - kept) / 0.4
    problem = moved(servo, load, servo + 0.1 * np.array(crossed))
    forms = (("lag_s", "changes"), ("lag_s",))
    washed, lagged = (fitted(problem, Candidate("cross_coupling", also=a), PISTON) for a in forms)
    assert washed.rss < min(0.2 * lagged.rss, 1.3 * len(problem.measured))
    numbers = washed.path.effect("cross_coupling").parameters
    assert (numbers["changes"], numbers["lag_s"]) == pytest.approx((0.1, 0.4), rel=0.05)


def test_a_mode_that_only_changes_shake_is_found_with_its_numbers() -> None:
    servo, passed, kept, swing, rate, w = 1.5 * np.sign(np.sin(2.3 * SAMPLED)), [], 0.0, 0.0, 0.0, 2.0 * np.pi * 3.0
    for voltage in servo:
        kept += FINE_S * (voltage - kept) / 0.15
        rate += FINE_S * (w * w * (voltage - kept - swing) - 2.0 * 0.1 * w * rate)
        swing += FINE_S * rate
        passed.append(voltage + 0.3 * swing)
    problem = moved(servo, np.zeros_like(servo), np.array(passed))
    shaken, plain = (fitted(problem, Candidate("resonance", also=a), PISTON) for a in (SHAKEN, ()))
    assert shaken.rss < min(0.1 * plain.rss, 1.3 * len(problem.measured))
    numbers = shaken.path.effect("resonance").parameters
    assert (numbers["frequency_hz"], numbers["share"]) == pytest.approx((3.0, 0.3), rel=0.03)
    assert (numbers["washout_s"], numbers["damping"]) == pytest.approx((0.15, 0.1), rel=0.15)


@pytest.mark.parametrize(
    ("channel", "name", "form"),
    [
        *((channel, "extra_lag", ("straight",)) for channel in Channel),
        (Channel.PRESSURE, "load_dependent_gain", KNEE),
        (Channel.PRESSURE, "friction", HEAVY),
        (Channel.PRESSURE, "extra_lag", ONE_WAY),
        (Channel.PRESSURE, "periodic_disturbance", EDGED),
    ],
)
def test_forms_that_nothing_leads_to_are_tried_from_the_start(
    channel: Channel, name: str, form: tuple[str, ...]
) -> None:
    assert Candidate(name, also=form) in library(channel)


def test_every_further_form_is_a_candidate_of_its_own() -> None:
    for name, channel, also in FURTHER:
        form = Candidate(name, PLACES.get(also), also=also)
        assert form in library(channel, loaded=True)
        assert form not in library(channel, apart=False)
        assert set(also) <= set(form.required)


@pytest.mark.parametrize("form", BY_LOAD)
def test_a_piston_has_a_leak_of_a_form_that_its_load_shows_only_where_that_moves(form: tuple[str, ...]) -> None:
    of_load = Candidate("leakage", also=form)
    assert of_load in library(Channel.POSITION, loaded=True)
    assert of_load not in library(Channel.POSITION)


def driven(path: PathSpec, voltage: np.ndarray, acting_v: Callable[[int, float], float], noise: float) -> np.ndarray:
    """Sampled output above rest of a path on which another voltage acts, of the step and of its output, with noise."""
    numerator = path.scale * path.gain * np.asarray(path.numerator)
    a, b, c, *_ = cont2discrete(tf2ss(numerator, path.denominator), FINE_S)
    state, output = np.zeros((len(a), 1)), []
    for k in range(len(voltage)):
        output.append(float((c @ state)[0, 0]))
        state = a @ state + b * acting_v(k, output[-1])
    measured = np.array(output)[::FINER]
    return np.asarray(measured + noise * np.random.default_rng(3).standard_normal(len(measured)))


def crept(load: np.ndarray, lost_v: Callable[[float, float], float]) -> Problem:
    """A piston past which a load (Pa) pushes oil: `lost_v` of where it is (m) and of the load."""
    servo = 0.9 * np.sin(1.9 * SAMPLED)
    position = driven(PISTON, servo, lambda k, at_m: float(servo[k]) - lost_v(at_m, float(load[k])), 1e-4)
    signals = {"servo_voltage_v": servo[::FINER], "pressure_pa": load[::FINER], "position_m": position}
    return make_problem(Run(FINE_S * FINER, signals), PAPER, Channel.POSITION, DiscoverySettings())


@pytest.mark.parametrize(("place_m", "way_m"), [(0.0, 0.04), (0.03, 0.05), (0.05, 0.08)])
def test_a_bore_worn_in_one_place_is_found_where_a_leak_alike_all_along_is_not(place_m: float, way_m: float) -> None:
    def lost_v(at_m: float, load_pa: float) -> float:
        worn = 0.5 + 0.5 * np.cos(np.clip(np.pi * (at_m - place_m) / way_m, -np.pi, np.pi))
        return 0.3e-6 * (load_pa - 1e6) * (0.2 + 0.8 * float(worn))

    problem = crept(1e6 * (1.0 + 0.8 * np.sign(np.sin(0.83 * SAMPLED))), lost_v)
    worn, plain = (fitted(problem, Candidate("leakage", also=also), PISTON) for also in (WORN, ()))
    assert worn.rss < min(0.02 * plain.rss, 2.0 * len(problem.measured))
    numbers = worn.path.effect("leakage").parameters
    assert numbers["worn_at"] == pytest.approx(place_m, abs=0.05 * way_m)
    assert numbers["worn"] == pytest.approx(0.8, abs=0.1)


@pytest.mark.parametrize("opens_pa", [1.4e6, 2.3e6])
def test_a_seal_that_gives_way_at_a_pressure_is_found_with_it(opens_pa: float) -> None:
    load = 1e6 * (1.7 + 1.6 * signal.sawtooth(0.83 * SAMPLED, 0.5))
    problem = crept(load, lambda _, load_pa: 0.25e-6 * max(load_pa - opens_pa, 0.0))
    forms = (("base", "lag_s", "opens"), ("base", "lag_s"))
    seal, plain = (fitted(problem, Candidate("leakage", also=also), PISTON) for also in forms)
    assert seal.rss < min(0.2 * plain.rss, 1.2 * len(problem.measured))
    assert seal.path.effect("leakage").parameters["base"] == pytest.approx(opens_pa / 1e6, rel=0.02)


@pytest.mark.parametrize(("knee_pa", "per_pa"), [(2.6e6, 5e-7), (3.2e6, 2e-7)])
def test_a_pump_that_delivers_less_from_some_pressure_on_is_found_with_it(knee_pa: float, per_pa: float) -> None:
    volts = 2.4 + 1.8 * signal.sawtooth(2.1 * SAMPLED, 0.5) * (SAMPLED > 0.4) - 2.4 * (SAMPLED < 0.4)

    def delivered_v(k: int, above_pa: float) -> float:
        return float(volts[k]) * (1.0 - per_pa * max(above_pa + BARE.rest - knee_pa, 0.0))

    pressure = BARE.rest + driven(BARE, volts, delivered_v, 5e3)
    run = Run(FINE_S * FINER, {"load_voltage_v": volts[::FINER], "pressure_pa": pressure})
    problem = make_problem(run, SPEC, Channel.PRESSURE, DiscoverySettings())
    knee, plain = (fitted(problem, Candidate("load_dependent_gain", also=also)) for also in (KNEE, ()))
    # It begins as the square root of a pressure drop, not as the line that it is.
    assert knee.rss < 0.1 * plain.rss
    assert knee.path.effect("load_dependent_gain").parameters["base"] == pytest.approx(knee_pa / 1e6, rel=0.05)


@pytest.mark.parametrize(("strength", "lag_s"), [(5.3, 0.046), (3.0, 0.03)])
def test_a_relief_valve_that_what_it_leaves_shuts_is_found_where_one_that_limits_is_not(
    strength: float, lag_s: float
) -> None:
    """It opens at a pressure and shuts at a lower one, by what is left of it; open it lets off in proportion."""
    opens_pa, shuts_pa = 2.9e6, 2.65e6
    volts = 2.2 + 1.4 * signal.sawtooth(2.1 * SAMPLED, 0.5) * (SAMPLED > 0.4) - 2.2 * (SAMPLED < 0.4)
    whole = PathSimulator(Channel.PRESSURE, FINE_S, volts, np.zeros(0), BARE.rest, BARE.rest).simulate(BARE) - BARE.rest
    let_off, is_open, shown = 0.0, False, []
    for pressure in whole:
        shown.append(pressure - let_off)
        is_open = pressure - let_off > opens_pa or (is_open and pressure - let_off > shuts_pa)
        flow = strength * (pressure - let_off - shuts_pa) if is_open else 0.0
        let_off += FINE_S / lag_s * (flow - let_off)
    pressure = BARE.rest + np.array(shown)[::FINER]
    pressure += 1e4 * np.random.default_rng(3).standard_normal(pressure.size)
    run = Run(FINE_S * FINER, {"load_voltage_v": volts[::FINER], "pressure_pa": pressure})
    problem = make_problem(run, SPEC, Channel.PRESSURE, DiscoverySettings())
    shuts = fitted(problem, Candidate("overflow", PLACES[RESEATED], also=RESEATED))
    assert shuts.rss < 1.15 * len(problem.measured)
    numbers = shuts.path.effect("overflow").parameters
    assert numbers["limit"] == pytest.approx(opens_pa, rel=0.01)
    assert numbers["limit"] - numbers["reseat"] == pytest.approx(shuts_pa, rel=0.02)
    assert numbers["closing_s"] == pytest.approx(lag_s, rel=0.1)
    assert numbers["override"] == pytest.approx(1.0 / (1.0 + strength), abs=0.05)
    limits = [fitted(problem, Candidate("overflow", at)).rss for at in (None, Attachment.OUTPUT)]
    assert shuts.rss < 0.25 * min(limits)


@pytest.mark.parametrize("flow", ["gap", "orifice"])
def test_a_leak_behind_the_pressure_is_found_where_one_from_the_valve_is_not(flow: str) -> None:
    share, lag_s, per_mpa = 0.12, 0.03, 0.15
    volts = 2.2 + 1.4 * signal.sawtooth(2.1 * SAMPLED, 0.5) * (SAMPLED > 0.4) - 2.2 * (SAMPLED < 0.4)
    whole = PathSimulator(Channel.PRESSURE, FINE_S, volts, np.zeros(0), BARE.rest, BARE.rest).simulate(BARE)
    down, shown = 0.0, []
    for pressure in 1e-6 * whole:
        left = max(pressure - down, 0.0)
        lost = left * (1.0 + per_mpa * left) ** 3 if flow == "gap" else np.sqrt(left)
        shown.append(pressure - down)
        down += FINE_S / lag_s * (share * lost - down)
    pressure = 1e6 * np.array(shown)[::FINER]
    pressure += 5e3 * np.random.default_rng(3).standard_normal(pressure.size)
    run = Run(FINE_S * FINER, {"load_voltage_v": volts[::FINER], "pressure_pa": pressure})
    problem = make_problem(run, SPEC, Channel.PRESSURE, DiscoverySettings())
    nominal = nominal_terms(BARE, problem.signal)
    behind = Candidate("leakage", PLACES[WIDENED], also=WIDENED)
    assert Candidate("leakage", PLACES[WIDENED]) not in library(Channel.PRESSURE)
    # What sags under its own load is a store inside the path.
    assert "sag_per_s" in Candidate("leakage").required
    assert "sag_per_s" not in behind.required
    # Leaking from another pressure on, it would bend as a spring does.
    assert "base" in Candidate("leakage").optional
    assert "base" not in behind.optional
    found = fitted(problem, behind)
    free = {"leakage": (*behind.required, "lag_s")}
    late = fit_hypothesis(problem, hypothesis(problem, found.path, nominal, free), iterations=20)
    assert late.rss < 1.1 * len(problem.measured)
    numbers = late.path.effect("leakage").parameters
    assert numbers["lag_s"] == pytest.approx(lag_s, rel=0.1)
    assert numbers["turbulence"] == pytest.approx(0.0 if flow == "gap" else 1.0, abs=0.02)
    assert 1e6 * numbers["widening"] == pytest.approx(per_mpa if flow == "gap" else 0.0, abs=0.01)
    at_the_valve = [fitted(problem, Candidate("leakage", also=also)).rss for also in ((), ("made_up",))]
    assert late.rss < (0.1 if flow == "gap" else 0.95) * min(at_the_valve)


@pytest.mark.parametrize("upwards", [True, False])
def test_a_volume_behind_a_check_valve_is_found_where_a_lag_both_ways_is_not(upwards: bool) -> None:
    lag_s, filled, passed = 0.04, 0.0, []
    volts = 2.2 + 1.4 * signal.sawtooth(4.1 * SAMPLED, 0.5) * (SAMPLED > 0.4) - 2.2 * (SAMPLED < 0.4)
    for volt in volts:
        lags = bool(volt > filled) == upwards
        filled += (volt - filled) * (1.0 - np.exp(-FINE_S / lag_s) if lags else 1.0)
        passed.append(filled)
    pressure = BARE.rest + driven(BARE, volts, lambda k, _: float(passed[k]), 7e3)
    run = Run(FINE_S * FINER, {"load_voltage_v": volts[::FINER], "pressure_pa": pressure})
    problem = make_problem(run, SPEC, Channel.PRESSURE, DiscoverySettings())
    one_way, plain = (fitted(problem, Candidate("extra_lag", also=also)) for also in (ONE_WAY, ()))
    assert one_way.rss < min(0.5 * plain.rss, 1.2 * len(problem.measured))
    numbers = one_way.path.effect("extra_lag").parameters
    assert numbers["unequal"] == pytest.approx(1.0 if upwards else -1.0, abs=0.1)
    assert (1.0 + abs(numbers["unequal"])) * numbers["time_constant_s"] == pytest.approx(lag_s, rel=0.1)


def test_what_stiffens_at_rest_is_told_from_a_gain_that_drifts() -> None:
    volts = (2.2 + 1.1 * np.sin(1.3 * SAMPLED) * (np.sin(0.35 * SAMPLED) > 0.0)) * (SAMPLED > 0.4)
    built, before, passed = 1.0, 0.0, []
    for volt in volts:
        built = (built + FINE_S * (1.0 - built) / 3.0) * np.exp(-0.9 * abs(volt - before))
        before = volt
        passed.append(volt * (1.0 - 0.15 * built))
    pressure = BARE.rest + driven(BARE, volts, lambda k, _: float(passed[k]), 7e3)
    run = Run(FINE_S * FINER, {"load_voltage_v": volts[::FINER], "pressure_pa": pressure})
    problem = make_problem(run, SPEC, Channel.PRESSURE, DiscoverySettings())
    stiffens, drifts = (fitted(problem, Candidate(name)) for name in ("thixotropy", "gain_drift"))
    assert stiffens.rss < min(0.3 * drifts.rss, 1.2 * len(problem.measured))
    assert stiffens.path.effect("thixotropy").parameters["rebuilding_s"] == pytest.approx(3.0, rel=0.1)
    assert not in_vocabulary("thixotropy")


@pytest.mark.parametrize(("level_v", "hz"), [(0.07, 25.0), (0.15, 15.0)])
def test_a_spool_with_mass_is_found_where_one_without_is_not(level_v: float, hz: float) -> None:
    fine, w = 10, 2.0 * np.pi * hz
    volts = 2.2 + 1.2 * signal.sawtooth(0.9 * SAMPLED) * (SAMPLED > 0.4) - 2.2 * (SAMPLED < 0.4)
    place, rate, acts = 0.0, 0.0, []
    for volt in np.repeat(volts, fine):
        pulled = volt - place
        force = pulled if rate == 0.0 and abs(pulled) <= level_v else np.copysign(level_v, rate or pulled)
        after = rate + FINE_S / fine * (w * w * (pulled - force) - 1.2 * w * rate)
        rate = 0.0 if rate * after < 0.0 else after
        place += FINE_S / fine * rate
        acts.append(place)
    acting = np.array(acts)[fine - 1 :: fine]
    pressure = BARE.rest + driven(BARE, volts, lambda k, _: float(acting[k]), 7e3)
    run = Run(FINE_S * FINER, {"load_voltage_v": volts[::FINER], "pressure_pa": pressure})
    problem = make_problem(run, SPEC, Channel.PRESSURE, DiscoverySettings())
    heavy, creeping = (fitted(problem, Candidate("friction", also=also)) for also in (HEAVY, ("creep_velocity",)))
    assert heavy.rss < min(0.5 * creeping.rss, 1.2 * len(problem.measured))
    numbers = heavy.path.effect("friction").parameters
    assert numbers["coulomb_v"] == pytest.approx(level_v, rel=0.05)
    assert numbers["swing_s"] == pytest.approx(1.0 / w, rel=0.2)


@pytest.mark.parametrize(("hz", "duty"), [(6.37, None), (2.3, None), (3.1, 0.5), (1.7, 0.15)])
def test_a_disturbance_with_edges_is_found_where_three_harmonics_leave_them(hz: float, duty: float | None) -> None:
    given = 2.0 + 1.2 * WAVES[1]
    clean = answered(given, given, 1)
    angle = 2.0 * np.pi * hz * 0.02 * np.arange(given.size) + 1.1
    edged = 2e5 * (signal.sawtooth(angle) if duty is None else signal.square(angle, duty))
    signals = {**clean.signals, "pressure_pa": clean.signals["pressure_pa"] + edged}
    problem = make_problem(Run(0.02, signals), SPEC, Channel.PRESSURE, DiscoverySettings())
    gap = problem.residual(BARE) / problem.sigma
    edges = fitted(problem, Candidate("periodic_disturbance", also=EDGED))
    numbers = edges.path.effect("periodic_disturbance").parameters
    assert numbers["frequency_hz"] == pytest.approx(hz, rel=1e-3)
    harmonics = ("second_sine", "second_cosine", "third_sine", "third_cosine")
    tones = fitted(problem, Candidate("periodic_disturbance", also=harmonics))
    # an edge between two samples, of so strong a disturbance, costs much wherever it is put
    assert edges.rss < min(0.35 * tones.rss, 0.06 * float(gap @ gap))
