"""Each effect: nothing at its neutral value, its textbook fingerprint beyond."""

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy import integrate, signal

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import DisturbanceSpec, ModelSpec, PathSpec, PlantModel
from dt_station_nodes.core.models.effects import Attachment, Effect, registry

TS = 0.02
STATIC = PathSpec(numerator=[1.0], denominator=[1.0])
INTEGRATOR = PathSpec(numerator=[206.4], denominator=[1, 23.34, 0], scale=0.01)
FAST = PathSpec(numerator=[1.0], denominator=[0.05, 1.0])
TIME = np.arange(500) * TS
SWEEP = 2.0 * np.sin(2 * math.pi * 0.3 * TIME)


def answer(name, parameters, path=STATIC, voltage=SWEEP, channel=Channel.POSITION, load=None):
    spec = ModelSpec(name="t", paths={channel: path})
    if name:
        spec = spec.with_effect(channel, name, parameters)
    if channel is Channel.POSITION:
        spec = spec.model_copy(update={"paths": {**spec.paths, Channel.PRESSURE: STATIC}})
    # one sample later: a static path answers within the sample that the voltage acts in
    result = PlantModel(spec, TS).simulate(voltage, voltage, load)
    return (result.position_m if channel is Channel.POSITION else result.pressure_pa)[1:]


@pytest.mark.parametrize("effect", registry().values(), ids=list(registry()))
def test_neutral_parameters_change_nothing(effect: Effect):
    neutral = {p.name: p.neutral for p in effect.parameters}
    if effect.name == "resonance":
        neutral |= {"frequency_hz": 1.0, "damping": 0.5, "share": 0.0}
    load = np.full(TIME.size, 2e6)
    with_it = answer(effect.name, neutral, INTEGRATOR, channel=effect.channels[-1], load=load)
    without = answer(None, {}, INTEGRATOR, channel=effect.channels[-1], load=load)
    assert np.allclose(with_it, without, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("effect", registry().values(), ids=list(registry()))
def test_an_effect_says_what_it_is(effect: Effect):
    assert effect.sentence.endswith(".")
    assert effect.check.endswith(".")
    assert effect.source
    assert all(p.lower <= value <= p.upper for p in effect.parameters for value in p.starts)
    assert all(p.starts or p.optional for p in effect.parameters)


def test_dead_zone_swallows_its_band_and_shifts_the_rest():
    out = answer("dead_zone", {"half_width_v": 0.5})
    expected = np.sign(SWEEP) * np.maximum(np.abs(SWEEP) - 0.5, 0.0)
    assert np.allclose(out, expected[:-1])


def test_a_valve_that_works_about_a_voltage_stands_there_within_its_band():
    out = answer("dead_zone", {"half_width_v": 0.2, "centre_v": 0.7, "working": 1.0})
    beyond = SWEEP - 0.7
    assert np.allclose(out, (0.7 + np.sign(beyond) * np.maximum(np.abs(beyond) - 0.2, 0.0))[:-1])


def test_rounded_dead_zone_tends_to_the_sharp_one():
    sharp = answer("dead_zone", {"half_width_v": 0.5})
    rounded = answer("dead_zone", {"half_width_v": 0.5, "rounding_v": 0.01})
    assert 1e-4 < np.abs(rounded - sharp).max() < 0.01


def test_a_lagging_spool_uncovers_its_ports_when_it_has_got_there():
    """What an overlap inside the path lets through, integrated, is what the lagging voltage has beyond it."""
    volts = np.where(np.sin(2.0 * math.pi * 0.8 * TIME) > 0.0, 0.5, -0.7)
    spec = ModelSpec(name="t", paths={Channel.POSITION: INTEGRATOR, Channel.PRESSURE: STATIC})
    band = {"half_width_v": 0.2, "centre_v": 0.05}
    spec = spec.with_effect(Channel.POSITION, "dead_zone", band, at=Attachment.STATE)
    found = PlantModel(spec, TS).simulate(0.0 * volts, volts).position_m
    fine = 200
    lagged = signal.lfilter(
        [0.0, 1.0 - math.exp(-23.34 * TS / fine)], [1.0, -math.exp(-23.34 * TS / fine)], np.repeat(volts, fine)
    )
    beyond = np.sign(lagged - 0.05) * np.maximum(np.abs(lagged - 0.05) - 0.2, 0.0)
    expected = 0.01 * 206.4 / 23.34 * np.concatenate([[0.0], np.cumsum(beyond)[fine - 1 : -1 : fine]]) * TS / fine
    assert np.abs(found - expected).max() < 0.002 * np.ptp(expected)


def test_saturation_clips():
    assert np.allclose(answer("saturation", {"upper_v": 1.2, "lower_v": -0.7}), np.clip(SWEEP, -0.7, 1.2)[:-1])


def test_a_valves_limits_are_sought_as_far_on_either_side():
    upper, lower = (registry()["saturation"].parameter(name) for name in ("upper_v", "lower_v"))
    assert (lower.lower, lower.upper) == (-upper.upper, -upper.lower)


def test_a_limit_lets_part_of_what_is_beyond_it_pass():
    limits = {"upper_v": 1.2, "lower_v": -0.7, "passing": 0.2}
    clipped = np.clip(SWEEP, -0.7, 1.2)
    assert np.allclose(answer("saturation", limits), (clipped + 0.2 * (SWEEP - clipped))[:-1])


def test_what_is_straight_up_to_a_share_of_its_limit_bends_towards_it_from_there():
    limits = {"upper_v": 1.2, "lower_v": -0.7, "straight": 0.6}
    limit = np.where(SWEEP > 0.0, 1.2, -0.7)
    beyond = np.maximum(SWEEP / limit - 0.6, 0.0) / 0.4
    expected = np.where(beyond > 0.0, limit * (0.6 + 0.4 * np.tanh(beyond)), SWEEP)
    assert np.allclose(answer("saturation", limits), expected[:-1])
    sharp = answer("saturation", {**limits, "straight": 0.999})
    assert np.abs(sharp - np.clip(SWEEP, -0.7, 1.2)[:-1]).max() < 1e-3


def test_a_soft_limit_may_bend_from_a_working_voltage_and_a_sharp_one_stays_where_it_is():
    limits = {"upper_v": 1.2, "lower_v": -0.7, "centre_v": 0.5}
    assert np.allclose(answer("saturation", limits), np.clip(SWEEP, -0.7, 1.2)[:-1])
    above = SWEEP - 0.5
    reach = np.where(above > 0.0, 0.7, 1.2)
    assert np.allclose(answer("saturation", {**limits, "straight": 0.0}), (0.5 + reach * np.tanh(above / reach))[:-1])


def test_hysteresis_loop_is_as_wide_as_it_says():
    out = answer("hysteresis", {"half_width_v": 0.3})
    rising, falling = np.diff(SWEEP[:-1]) > 0, np.diff(SWEEP[:-1]) < 0
    late = TIME[1:-1] > 4.0
    middle = np.abs(SWEEP[1:-1]) < 0.5
    lag = SWEEP[1:-1] - out[1:]
    assert np.allclose(lag[rising & late & middle], 0.3)
    assert np.allclose(lag[falling & late & middle], -0.3)


def test_backlash_stands_still_after_a_reversal():
    out = answer("backlash", {"half_width": 0.3})
    assert np.abs(out - SWEEP[:-1]).max() == pytest.approx(0.3)
    top = int(np.argmax(SWEEP))
    assert np.ptp(out[top : top + 5]) == 0.0


def test_friction_holds_below_its_level_and_subtracts_above():
    assert np.ptp(answer("friction", {"coulomb_v": 0.5}, INTEGRATOR, np.full(200, 0.4))) < 1e-12
    slide = answer("friction", {"coulomb_v": 0.5}, INTEGRATOR, np.full(200, 1.5))
    assert np.diff(slide)[-1] / TS == pytest.approx(0.01 * 206.4 / 23.34 * 1.0, rel=1e-6)


@pytest.mark.parametrize("leak_first", [True, False])
@pytest.mark.parametrize("volts", [0.0, 0.6, -0.6])
@pytest.mark.parametrize("coulomb_v", [0.02, 0.2])
def test_friction_holds_a_piston_against_its_leak_whichever_is_listed_first(leak_first, volts, coulomb_v):
    gain, leak = 0.01 * 206.4 / 23.34, 3e-3
    both = [("leakage", {"coefficient": 1e-9}), ("friction", {"coulomb_v": coulomb_v})]
    spec = ModelSpec(name="t", paths={Channel.POSITION: INTEGRATOR, Channel.PRESSURE: STATIC})
    for name, parameters in both if leak_first else reversed(both):
        spec = spec.with_effect(Channel.POSITION, name, parameters)
    servo = np.full(TIME.size, volts)
    out = PlantModel(spec, TS).simulate(servo, servo, np.full(TIME.size, 3e6)).position_m
    free, level = gain * volts - leak, gain * coulomb_v
    expected = math.copysign(max(abs(free) - level, 0.0), free)
    assert np.diff(out)[-1] / TS == pytest.approx(expected, rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("level_v", [0.4, -0.4])
def test_friction_grows_with_the_pressure_that_presses_the_seals_on(level_v):
    load = np.full(TIME.size, 2.0)
    seal = {"coulomb_v": 0.1, "per_load": 0.5}
    free = answer("", {}, INTEGRATOR, np.full(TIME.size, math.copysign(abs(level_v) - 0.2, level_v)), load=load)
    held = answer("friction", seal, INTEGRATOR, np.full(TIME.size, level_v), load=load)
    assert np.allclose(held, free, rtol=1e-9)
    assert np.ptp(answer("friction", seal, INTEGRATOR, np.full(TIME.size, 0.19), load=load)) < 1e-12


def test_friction_that_slips_creeps_below_its_level_by_its_own_curve():
    speed_per_volt, level, slip = 0.01 * 206.4 / 23.34, 0.5, 0.004
    for volts in (-0.3, 0.4, 1.5):
        moved = answer("friction", {"coulomb_v": level, "slip_velocity": slip}, INTEGRATOR, np.full(200, volts))
        velocity = np.diff(moved)[-1] / TS
        assert velocity / speed_per_volt + level * math.tanh(velocity / slip) == pytest.approx(volts, rel=1e-3)


def test_friction_that_hardly_slips_sticks():
    sharp = answer("friction", {"coulomb_v": 0.5}, INTEGRATOR)
    rounded = answer("friction", {"coulomb_v": 0.5, "slip_velocity": 1e-5}, INTEGRATOR)
    assert 1e-7 < np.abs(rounded - sharp).max() < 2e-3 * np.ptp(sharp)


def test_a_piston_that_stands_is_held_by_all_static_friction_and_one_that_moves_by_less():
    gripping = {"coulomb_v": 0.5, "static_excess_v": 0.4, "stribeck_velocity": 0.01}
    voltage = np.concatenate([np.full(100, 0.88), np.full(100, 1.5), np.full(300, 0.8)])
    out = answer("friction", gripping, INTEGRATOR, voltage)
    speed = np.diff(out) / TS
    assert np.all(np.abs(speed[:98]) < 1e-12)
    # speed per volt of the path is 206.4 / 23.34 cm/s
    level = 0.5 + 0.4 * math.exp(-((speed[-1] / 0.01) ** 2))
    assert speed[-1] > 0.0
    assert speed[-1] == pytest.approx(0.01 * 206.4 / 23.34 * (0.8 - level), rel=1e-6)


@pytest.mark.parametrize("slide_s", [0.0, 0.01])
def test_a_spool_that_slides_on_follows_until_the_voltage_turns_back(slide_s):
    """It breaks away at 0.5 V, slides on 0.2 V behind, and after a turn waits for 0.5 V again."""
    spool = {"coulomb_v": 0.5, "slip": 0.6, "slides_on": 1.0, "slide_s": slide_s}
    up, down = np.linspace(0.0, 2.0, 101), np.linspace(2.0, 1.0, 51)
    held = np.full(50, 2.0)
    out = answer("friction", spool, voltage=np.concatenate([up, held, down]), channel=Channel.PRESSURE)
    still, slid = up[:-1] <= 0.5 - 1e-9, up[:-1] > 0.75
    assert np.all(out[:100][still] == 0.0)
    np.testing.assert_allclose(out[:100][slid], up[:-1][slid] - 0.2, atol=1e-9 if slide_s == 0.0 else 0.02)
    assert out[149] == pytest.approx(1.8, abs=1e-3)
    turned = out[151:]
    waits = down[: len(turned)] >= 1.8 - 0.5 + 1e-9
    np.testing.assert_allclose(turned[waits], 1.8, atol=1e-3)
    assert turned[-1] == pytest.approx(1.0 + 0.2, abs=0.03)


def test_a_spool_on_an_oil_film_lags_by_its_level_and_creeps_home_when_left():
    """At a constant 2 V/s it is level tanh(2 / 0.5) behind; left alone it creeps on at creep / level of the rest."""
    spool = {"coulomb_v": 0.2, "creep_velocity": 0.5}
    volts = np.concatenate([np.arange(200) * 2.0 * TS, np.full(200, 200 * 2.0 * TS)])
    behind = volts[:-1] - answer("friction", spool, voltage=volts, channel=Channel.PRESSURE)
    # Within a sample the voltage is held, which the spool gains on: by less than one step of it.
    assert behind[190] == pytest.approx(0.2 * math.tanh(2.0 / 0.5), abs=2.0 * TS)
    left = behind[320:360]
    assert np.all(np.diff(left) < 0.0)
    assert left[20] / left[0] == pytest.approx(math.exp(-0.5 / 0.2 * 20 * TS), rel=0.02)


def test_a_spool_on_bristles_goes_where_dahls_equation_says_and_oil_damps_it():
    level, way = 0.3, 0.08
    volts = 1.5 * np.sin(2.0 * math.pi * 0.4 * TIME) * np.sin(2.0 * math.pi * 0.11 * TIME)
    place, bent, fine = volts[0], 0.0, [volts[0]]
    for change in np.repeat(np.diff(volts) / 200, 200):
        side = math.copysign(1.0, change)
        moved = change / (1.0 + level / way * (1.0 - side * bent))
        place, bent = place + moved, bent + moved / way * (1.0 - side * bent)
        fine.append(place)
    spool = {"coulomb_v": level, "presliding": way}
    stands = answer("friction", spool, voltage=volts, channel=Channel.PRESSURE)
    np.testing.assert_allclose(stands, fine[:-1:200], atol=1e-3)
    ramp = 2.0 * TIME
    late = ramp[:-1] - answer("friction", {**spool, "slide_s": 0.05}, voltage=ramp, channel=Channel.PRESSURE)
    assert late[-1] == pytest.approx(level + 0.05 * 2.0, abs=2.0 * TS)


def test_bristles_that_only_bend_at_first_go_the_same_way_back():
    """Elasto-plastic (Dupont et al., 2002): a share of the level bends them and is given back, the rest is lost."""
    level, way, share = 0.3, 0.08, 0.6
    volts = 1.5 * np.sin(2.0 * math.pi * 0.4 * TIME) * np.sin(2.0 * math.pi * 0.11 * TIME)
    place, held, fine = volts[0], 0.0, [volts[0]]
    for change in np.repeat(np.diff(volts) / 200, 200):
        side = math.copysign(1.0, change)
        given_way = max(0.0, (side * held / level - share) / (1.0 - share))
        slope = level / way * (1.0 - given_way)
        moved = change / (1.0 + slope)
        place, held = place + moved, held + moved * slope
        fine.append(place)
    spool = {"coulomb_v": level, "presliding": way, "elastic": share}
    stands = answer("friction", spool, voltage=volts, channel=Channel.PRESSURE)
    np.testing.assert_allclose(stands, fine[:-1:200], atol=1e-3)
    # Below that share nothing is lost.
    small = 0.5 * share * level * np.sin(2.0 * math.pi * 0.7 * TIME)
    bent = answer("friction", spool, voltage=small, channel=Channel.PRESSURE)
    np.testing.assert_allclose(bent, small[:-1] / (1.0 + level / way), atol=1e-9)


def test_what_is_centred_in_its_gap_comes_to_where_it_is_read_and_play_is_as_wide_as_it_was():
    half, rate = 0.2, 0.8
    volts = np.where(TIME < 1.0, 2.0 * TIME, 2.0)
    behind = volts[:-1] - answer("backlash", {"half_width": half, "centring_per_s": rate}, voltage=volts)
    pushed = behind[(TIME[:-1] > 0.5) & (TIME[:-1] < 1.0)]
    np.testing.assert_allclose(pushed, half, atol=2.0 * TS)
    stopped = behind[TIME[:-1] >= 1.0 + 2.0 * TS]
    np.testing.assert_allclose(stopped[10:] / stopped[:-10], math.exp(-10.0 * TS * rate), rtol=1e-6)


@pytest.mark.parametrize("excess", [0.0, 0.1])
def test_a_spool_with_mass_goes_where_its_spring_and_dry_friction_send_it(excess):
    """Against the equation of motion by small steps, over jumps past which it swings and a ramp on which it slips."""
    level, hz, damping, pace, fine = 0.2, 9.0, 0.3, 2.0, 400
    volts = np.where(np.sin(2.0 * math.pi * 0.7 * TIME) > 0.0, 1.0, -0.4) + 0.15 * TIME
    natural = 2.0 * math.pi * hz
    step, place, rate, ends = TS / fine, volts[0], 0.0, []
    for k, volt in enumerate(np.repeat(volts, fine)):
        pulled = volt - place
        most = level + excess * math.exp(-((rate / pace) ** 2))
        if rate == 0.0 and abs(pulled) <= most:
            force = pulled
        else:
            force = math.copysign(most, rate if rate != 0.0 else pulled)
        after = rate + step * (natural * natural * (pulled - force) - 2.0 * damping * natural * rate)
        rate = 0.0 if rate * after < 0.0 else after
        place += step * rate
        if k % fine == fine - 1:
            ends.append(place)
    spool = {"coulomb_v": level, "swing_s": 1.0 / natural, "swing_damping": damping}
    spool |= {"static_excess_v": excess, "spool_stribeck_velocity": pace}
    stands = answer("friction", spool, voltage=volts, channel=Channel.PRESSURE)
    # What is held over a sub-step is the mean of where it was: no more than that where it moves.
    apart = np.abs(stands - ends[: len(stands)])
    still = np.abs(np.diff(ends, prepend=0.0)[: len(stands)]) < 0.02
    assert np.mean(still) > 0.8
    assert apart[still].max() < 0.02
    assert apart.max() < 0.2


def test_a_spool_with_mass_stays_where_friction_holds_it():
    spool = {"coulomb_v": 0.2, "swing_s": 0.01, "swing_damping": 0.5}
    volts = np.concatenate([np.zeros(50), np.full(50, 0.19), np.full(50, -0.19), np.full(100, 0.5)])
    out = answer("friction", spool, voltage=volts, channel=Channel.PRESSURE)
    assert np.all(out[:149] == 0.0)
    assert abs(0.5 - out[-1]) <= 0.2
    assert np.ptp(out[-50:]) == 0.0


def test_a_spool_on_bristles_is_held_more_the_slower_it_goes():
    level, excess, pace = 0.2, 0.15, 1.0
    spool = {"coulomb_v": level, "presliding": 0.01, "static_excess_v": excess, "spool_stribeck_velocity": pace}
    for speed in (0.05, 0.7, 5.0):
        ramp = speed * TIME
        behind = (ramp[:-1] - answer("friction", spool, voltage=ramp, channel=Channel.PRESSURE))[-1]
        if speed == 0.7:
            assert level + 0.2 * excess < behind < level + 0.95 * excess
        else:
            assert behind == pytest.approx(level + (excess if speed < pace else 0.0), abs=0.01 + speed * TS / 4.0)


def test_a_spool_driven_steadily_is_held_steadily_and_less_the_quicker():
    level, excess = 0.2, 0.15
    spool = {"coulomb_v": level, "presliding": 0.01, "static_excess_v": excess, "spool_stribeck_velocity": 1.0}
    before = level + excess
    for speed in (0.2, 0.5, 0.7, 1.0, 2.0):
        behind = speed * TIME[:-1] - answer("friction", spool, voltage=speed * TIME, channel=Channel.PRESSURE)
        assert np.ptp(behind[-100:]) < 1e-6
        assert level < behind[-1] < before
        before = behind[-1]


@pytest.mark.parametrize("volts", [0.9, 1.3, 1.7, 2.0])
def test_a_spool_that_jumps_is_held_as_little_as_one_at_that_speed_and_stays_so(volts):
    level, spool = 0.2, {"coulomb_v": 0.2, "presliding": 0.01, "static_excess_v": 0.15, "spool_stribeck_velocity": 1.0}
    behind = volts - answer("friction", spool, voltage=np.where(TIME < 1.0, 0.0, volts), channel=Channel.PRESSURE)
    np.testing.assert_allclose(behind[TIME[:-1] >= 1.0 + 2.0 * TS], level, atol=1e-6)


def test_damped_bristles_hold_as_the_lugre_equations_say():
    level, bend, damping, gain, lag = 0.3, 2e-3, 0.04, 0.01 * 206.4 / 23.34, 1.0 / 23.34
    volts = 0.8 * np.sin(2.0 * math.pi * 0.8 * TIME) + 0.1

    def slopes(t: float, state: np.ndarray) -> list[float]:
        _, velocity, bristle = state
        bending = velocity - abs(velocity) * bristle / bend
        held = level * (bristle + damping * bending) / bend
        return [velocity, (gain * (volts[min(int(t / TS + 1e-9), len(volts) - 1)] - held) - velocity) / lag, bending]

    solution = integrate.solve_ivp(slopes, (0.0, TIME[-1]), [0.0] * 3, t_eval=TIME[1:], max_step=TS / 4, rtol=1e-8)
    exact = solution.y[0]
    bristles = {"coulomb_v": level, "presliding": bend}
    with_damping = answer("friction", {**bristles, "damping_s": damping}, INTEGRATOR, volts)
    without = answer("friction", bristles, INTEGRATOR, volts)
    assert np.abs(with_damping - exact).max() < 0.002 * np.ptp(exact)
    assert np.abs(without - exact).max() > 0.01 * np.ptp(exact)


def test_friction_only_takes_energy():
    voltage = np.where(TIME < 1.0, 2.0, 0.0)
    position = answer("friction", {"coulomb_v": 0.3}, INTEGRATOR, voltage)
    velocity = np.diff(position)
    after = velocity[60:]
    assert np.all(np.diff(after) <= 1e-15)
    assert np.all(after >= -1e-15)
    assert after[-1] == pytest.approx(0.0, abs=1e-15)


@pytest.mark.parametrize("delay", [0.02, 0.06, 0.1])
def test_delay_shifts_by_whole_samples(delay):
    shift = round(delay / TS)
    out = answer("delay", {"delay_s": delay})
    assert np.allclose(out[shift:], SWEEP[: -1 - shift])


def test_rate_limit_bounds_the_slope():
    out = answer("rate_limit", {"rate_v_per_s": 1.0})
    assert np.abs(np.diff(out)).max() <= 1.0 * TS * (1 + 1e-9)
    assert np.abs(out).max() < np.abs(SWEEP).max()


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_spool_that_springs_close_slews_faster_towards_zero(sign):
    voltage = sign * np.where((TIME > 1.0) & (TIME < 5.0), 1.0, 0.0)
    out = sign * answer("rate_limit", {"rate_v_per_s": 1.0, "closing": 0.25}, voltage=voltage)
    slopes = np.diff(out) / TS
    assert slopes.max() == pytest.approx(0.75)
    assert slopes.min() == pytest.approx(-1.25)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_spool_that_springs_close_lags_less_towards_zero(sign):
    voltage = sign * np.where((TIME > 1.0) & (TIME < 5.0), 1.0, 0.0)
    missing_s = TS * np.abs(
        voltage[:-1] - answer("extra_lag", {"time_constant_s": 0.2, "closing": 0.4}, voltage=voltage)
    )
    assert missing_s[TIME[1:] < 5.0].sum() == pytest.approx(0.28, abs=TS)
    assert missing_s[TIME[1:] >= 5.0].sum() == pytest.approx(0.12, abs=TS)


def test_a_loop_of_limited_speed_is_its_lag_that_slews():
    """Against fine steps of x' = clip((u - x) / T, rate), which a limit before the lag is not."""
    lag, rate, fine = 0.05, 4.0, 200
    square = np.where(TIME % 2.0 < 1.0, 1.0, -0.5)
    expected, x = [], square[0]
    begin = PathSpec(numerator=[1.0], denominator=[lag, 1.0], rest=0.0)
    for held in square:
        expected.append(x)
        for _ in range(fine):
            x += TS / fine * np.clip((held - x) / lag, -rate, rate)
    settled = TIME[1:] > 0.9
    inside = answer("rate_limit", {"rate_v_per_s": rate, "loop_s": lag}, begin, square)
    assert np.abs(inside - expected[1:])[settled].max() < 0.01
    before = answer("rate_limit", {"rate_v_per_s": rate}, begin, square)
    assert np.abs(before - expected[1:])[settled].max() > 0.1


@pytest.mark.parametrize("softness_s", [0.0, 0.05])
def test_a_pressure_that_fills_no_faster_follows_what_its_valve_makes_at_a_rate(softness_s):
    """Against fine steps of p' = r tanh((y - p) / (r T)), or clipped to r, behind a path whose static gain is 3."""
    rate_v, lag, gain, fine = 0.6, 0.1, 3.0, 200
    square = np.where(TIME % 4.0 < 2.0, 1.0, -0.5) * (TIME > 0.1)
    lagged = PathSpec(numerator=[gain], denominator=[lag, 1.0])
    slew = {"rate_v_per_s": rate_v, "softness_s": softness_s}
    spec = ModelSpec(name="t", paths={Channel.PRESSURE: lagged})
    spec = spec.with_effect(Channel.PRESSURE, "rate_limit", slew, Attachment.OUTPUT)
    out = PlantModel(spec, TS).simulate(square, square).pressure_pa
    expected, y, p, step = [], 0.0, 0.0, TS / fine
    for held in square:
        expected.append(p)
        for _ in range(fine):
            y = gain * held + (y - gain * held) * math.exp(-step / lag)
            most = rate_v * gain
            p += (
                step * most * math.tanh((y - p) / (most * softness_s))
                if softness_s
                else np.clip(y - p, -most * step, most * step)
            )
    assert np.abs(out - expected).max() < 0.02
    assert np.abs(np.diff(out)).max() == pytest.approx(rate_v * gain * TS, rel=1e-3)


def test_a_sag_that_bends_falls_with_the_square_root_of_the_output():
    start_m, sag, bend = 0.1, 0.4, 5000.0
    spec = ModelSpec(name="t", paths={Channel.POSITION: INTEGRATOR, Channel.PRESSURE: STATIC})
    spec = spec.with_effect(Channel.POSITION, "leakage", {"coefficient": 0.0, "sag_per_s": sag, "sag_bend": bend})
    model = PlantModel(spec, TS)
    still = np.zeros(TIME.size)
    out = model.simulate(still, still, state=model.initial_state(position_m=start_m)).position_m
    expected = (np.sqrt(start_m) - 0.5 * sag / np.sqrt(bend) * TIME) ** 2
    assert np.allclose(out[TIME < 5.0], expected[TIME < 5.0], rtol=0.03)


def test_leakage_creeps_with_the_absolute_pressure():
    rest = PathSpec(numerator=[1.0], denominator=[1.0], rest=1e6)
    paths = {Channel.POSITION: INTEGRATOR, Channel.PRESSURE: rest}
    spec = ModelSpec(name="t", paths=paths).with_effect(Channel.POSITION, "leakage", {"coefficient": 1e-9})
    out = PlantModel(spec, TS).simulate(np.zeros(100), np.zeros(100), np.full(100, 3e6)).position_m
    assert np.allclose(np.diff(out) / TS, -3e-3)


def test_a_leaking_valve_holds_less_pressure():
    """As much lost per second as the path's rate: half of the pressure above rest."""
    path = PathSpec(numerator=[9e6], denominator=[0.02, 0.3, 3.0], rest=1e6)
    spec = ModelSpec(name="t", paths={Channel.PRESSURE: path})
    volts, still = np.full(400, 1.0), np.zeros(400)
    share = {"coefficient": 10.0, "base": 1.0}
    assert PlantModel(spec, TS).simulate(volts, still).pressure_pa[-1] == pytest.approx(4e6)
    leaking = spec.with_effect(Channel.PRESSURE, "leakage", share)
    assert PlantModel(leaking, TS).simulate(volts, still).pressure_pa[-1] == pytest.approx(2.5e6, rel=1e-6)
    # The square-root law meets the laminar one at the rest pressure, 3 MPa below what it is here.
    orifice = spec.with_effect(Channel.PRESSURE, "leakage", {**share, "turbulence": 1.0, "base": 0.0})
    held = PlantModel(orifice, TS).simulate(volts, still).pressure_pa[-1]
    assert held + math.sqrt(held * 1e6) == pytest.approx(4e6, rel=1e-6)


@pytest.mark.parametrize(("turbulence", "widening"), [(0.0, 4e-7), (1.0, 0.0)])
def test_a_leak_behind_the_path_holds_down_what_it_leaves(turbulence, widening):
    """lag dz/dt = flow(y - z) / rate - z, its pressure absolute; at once without a lag."""
    path = PathSpec(numerator=[9e6], denominator=[0.02, 0.3, 3.0], rest=1e6)
    spec = ModelSpec(name="t", paths={Channel.PRESSURE: path})
    leak = {"coefficient": 2.0, "turbulence": turbulence, "widening": widening}

    def lost(left_pa):
        laminar = left_pa * (1.0 + widening * left_pa) ** 3
        return 2.0 / 10.0 * (turbulence * math.sqrt(left_pa * 1e6) + (1.0 - turbulence) * laminar)

    def shown(voltage, **more):
        leaking = spec.with_effect(Channel.PRESSURE, "leakage", {**leak, **more}, Attachment.OUTPUT)
        return PlantModel(leaking, TS).simulate(voltage, 0.0 * voltage).pressure_pa

    for more in ({}, {"lag_s": 0.03}):
        held = shown(np.full(400, 1.0), **more)[-1]
        assert held + lost(held) == pytest.approx(4e6, rel=1e-6)
    whole = PlantModel(spec, TS / 40).simulate(np.repeat(1.0 + 0.3 * SWEEP, 40), np.zeros(40 * SWEEP.size)).pressure_pa
    down, after = 0.0, []
    for pressure in whole:
        after.append(pressure - down)
        down += TS / 40 / 0.03 * (lost(pressure - down) - down)
    assert shown(1.0 + 0.3 * SWEEP, lag_s=0.03)[50:] == pytest.approx(np.array(after)[::40][50:], rel=5e-3)


def test_load_takes_gain():
    load = np.full(TIME.size, 3e6)
    out = answer("load_dependent_gain", {"per_load": 1e-7}, load=load)
    assert np.allclose(out, SWEEP[:-1] * math.sqrt(1 - 0.6))


def test_what_one_way_loses_goes_over_into_what_the_other_wins_where_both_edges_of_a_spool_leak():
    """q = k u sqrt(1 - 2 share tanh(u / w)), w = 0.3 V."""
    load = np.full(TIME.size, 3e6)
    out = answer("load_dependent_gain", {"per_load": 1e-7, "direction": 1.0, "rounding_v": 0.3}, load=load)
    given = SWEEP[:-1]
    assert np.allclose(out, given * np.sqrt(1.0 - 0.6 * np.tanh(given / 0.3)))


def test_a_supply_that_sags_takes_gain_later_than_the_load_comes():
    """lag dq/dt = load - q, and the square root of what q leaves of the pressure drop."""
    load = np.where(TIME < 2.0, 0.0, 3e6)
    out = answer("load_dependent_gain", {"per_load": 1e-7, "lag_s": 0.4}, load=load)
    sagged = np.where(TIME < 2.0, 0.0, 3e6 * (1.0 - np.exp(-(TIME - 2.0) / 0.4)))
    assert out == pytest.approx((SWEEP * np.sqrt(1.0 - 2e-7 * sagged))[:-1], abs=0.02)
    assert out[-1] == pytest.approx(SWEEP[-2] * math.sqrt(1 - 0.6), rel=1e-3)


def test_what_a_washout_lets_across_fades_with_its_lag():
    step = np.where(TIME < 2.0, 0.0, 1.0)
    out = answer("cross_coupling", {"share": 0.0, "lag_s": 0.4, "changes": 0.3}, voltage=step)
    faded = np.where(TIME < 2.0, 0.0, 1.0 + 0.3 * np.exp(-(TIME - 2.0) / 0.4))
    assert out == pytest.approx(faded[:-1], abs=0.02)
    assert out.max() > 1.28
    assert out[-1] == pytest.approx(1.0, abs=1e-3)


def test_asymmetric_gain():
    out = answer("asymmetric_gain", {"asymmetry": 0.2})
    assert out.max() / -out.min() == pytest.approx(1.2 / 0.8, rel=1e-3)


def test_a_kink_leaves_its_centre_or_zero_where_it_is():
    kink = {"asymmetry": 0.2, "centre_v": 0.5}
    centred, through = (answer("asymmetric_gain", {**kink, "through_zero": share}) for share in (0.0, 1.0))
    given = SWEEP[:-1]
    at_centre, at_zero = (int(np.argmin(np.abs(given - volts))) for volts in (0.5, 0.0))
    assert centred[at_centre] == pytest.approx(given[at_centre], abs=1e-2)
    assert through[at_zero] == pytest.approx(0.0, abs=1e-2)
    assert np.ptp(centred - through) == pytest.approx(0.0, abs=1e-12)
    above = given > 0.6
    assert np.polyfit(given[above], through[above], 1)[0] == pytest.approx(1.2)
    # With a gain so much less, all above the centre is as it was.
    kept = answer("asymmetric_gain", {**kink, "through_zero": -1.0}) / 1.2
    assert kept[above] == pytest.approx(given[above], abs=1e-9)
    assert np.polyfit(given[given < 0.4], kept[given < 0.4], 1)[0] == pytest.approx(0.8 / 1.2)


@pytest.mark.parametrize(("of_slope", "offset"), [(0.0, 0.0), (1.0, -0.2 * 0.3 * math.log(2.0))])
def test_a_rounded_kink_goes_back_to_its_lines_or_past_them(of_slope, offset):
    """A factor that changes softly leaves both lines through the centre, a slope that does moves them."""
    out = answer("asymmetric_gain", {"asymmetry": 0.2, "rounding_v": 0.3, "of_slope": of_slope})
    given = SWEEP[:-1]
    for side, gain in ((given > 1.2, 1.2), (given < -1.2, 0.8)):
        assert out[side] == pytest.approx(gain * given[side] + offset, abs=1e-3)
    assert abs(out[np.argmin(np.abs(given))]) < 1e-2


def test_bias_adds():
    assert np.allclose(answer("bias", {"bias_v": 0.1}), SWEEP[:-1] + 0.1)


@pytest.mark.parametrize("turning", [0.0, 0.01])
def test_a_leak_under_a_load_that_comes_of_the_motion_slows_it_either_way(turning):
    load = np.full(TIME.size, 3e6)
    leak = {"coefficient": 1e-8, "against": 1.0, "turning": turning}
    free = answer(None, {}, INTEGRATOR, load=load)
    slowed = answer("leakage", leak, INTEGRATOR, load=load)
    speed, lost = np.diff(free) / TS, np.diff(free - slowed) / TS
    quick = np.abs(speed) > 0.5 * np.abs(speed).max()
    assert lost[quick] == pytest.approx(0.03 * np.sign(speed[quick]), rel=1e-3)
    assert np.abs(np.diff(slowed)).max() < np.abs(np.diff(free)).max()


def test_a_leak_stops_a_piston_that_hardly_moves_and_does_not_turn_it():
    load, crawl = np.full(TIME.size, 3e6), np.where(TIME < 5.0, 0.01, -0.01)
    slowed = answer("leakage", {"coefficient": 1e-7, "against": 1.0}, INTEGRATOR, voltage=crawl, load=load)
    assert slowed == pytest.approx(np.zeros(len(slowed)), abs=1e-3)


@pytest.mark.parametrize("trimmed", [0.0, 1.0])
def test_a_gauge_that_stiffens_bends_what_it_shows_of_all_of_the_pressure(trimmed):
    path = PathSpec(numerator=[2.0], denominator=[1.0])
    spec = ModelSpec(name="t", paths={Channel.PRESSURE: path})
    spring = {"coefficient": 0.01, "centre": 0.5, "trimmed": trimmed}
    spec = spec.with_effect(Channel.PRESSURE, "cubic_stiffness", spring, Attachment.OUTPUT)
    shown = PlantModel(spec, TS).simulate(SWEEP, SWEEP).pressure_pa[1:]
    true = 2.0 * SWEEP[:-1]
    assert shown == pytest.approx(true - 2.0 * 0.01 * ((true - 0.5) ** 3 + trimmed * 0.5**3))


def test_a_spring_behind_the_path_that_answers_late_pulls_at_what_it_has_left():
    """tau dz/dt = G force(y - z) - z."""
    spec = ModelSpec(name="t", paths={Channel.PRESSURE: PathSpec(numerator=[2.0], denominator=[1.0])})
    spring = {"coefficient": 0.05, "stiffening": 0.1, "answer_s": 0.15}
    spec = spec.with_effect(Channel.PRESSURE, "cubic_stiffness", spring, Attachment.OUTPUT)
    shown = PlantModel(spec, TS).simulate(SWEEP, SWEEP).pressure_pa[1:]
    held = np.full(400, 3.0)
    back, pulled, way = 0.0, [], TS / 1000
    for y in np.repeat(2.0 * SWEEP[:-1], 1000):
        left = y - back
        back += way / 0.15 * (2.0 * 0.05 * left**3 * (1.0 + 0.1 * left**2) - back)
        pulled.append(back)
    assert shown == pytest.approx(2.0 * SWEEP[:-1] - np.array(pulled[999::1000]), abs=0.02 * np.ptp(shown))
    end = PlantModel(spec, TS).simulate(held, held).pressure_pa[-1]
    assert end + 2.0 * 0.05 * end**3 * (1.0 + 0.1 * end**2) == pytest.approx(6.0, rel=1e-6)


def test_a_sensor_whose_gain_drifts_reads_the_rest_value_by_it_too():
    path = PathSpec(numerator=[2.0], denominator=[1.0], rest=5.0)
    spec = ModelSpec(name="t", paths={Channel.PRESSURE: path})
    spec = spec.with_effect(Channel.PRESSURE, "gain_drift", {"rate_per_s": 0.02}, Attachment.OUTPUT)
    read = PlantModel(spec, TS).simulate(SWEEP, SWEEP).pressure_pa[1:]
    true = 5.0 + 2.0 * SWEEP[:-1]
    assert read == pytest.approx(true * (1.0 + 0.02 * TIME[:-1]), abs=0.02 * TS * np.abs(true).max())


def test_two_lags_side_by_side_are_an_extra_lag_that_a_share_passes_by():
    quick_s, slow_s, share = 0.05, 0.4, 0.3
    zero_s = share * slow_s + (1.0 - share) * quick_s
    together = {"time_constant_s": slow_s, "second_s": quick_s, "straight": zero_s / slow_s}
    step = np.where(TIME < 0.1, 0.0, 1.0)
    out, since = answer("extra_lag", together, voltage=step), np.maximum(TIME[1:] - 0.1, 0.0)
    sides = share * (1.0 - np.exp(-since / quick_s)) + (1.0 - share) * (1.0 - np.exp(-since / slow_s))
    np.testing.assert_allclose(out, sides, atol=0.02)


def test_a_volume_that_fills_slower_than_it_empties_lags_longer_upwards():
    mean_s, unequal = 0.2, 0.4
    voltage = np.where((TIME > 1.0) & (TIME < 5.0), 1.0, 0.0)
    out = answer("extra_lag", {"time_constant_s": mean_s, "unequal": unequal}, voltage=voltage)
    # What is missing of a step, summed over time, is the lag; the voltage changes and the output is read in samples.
    missing_s = TS * np.abs(voltage[:-1] - out)
    assert missing_s[TIME[1:] < 5.0].sum() == pytest.approx(mean_s * (1.0 + unequal), abs=TS)
    assert missing_s[TIME[1:] >= 5.0].sum() == pytest.approx(mean_s * (1.0 - unequal), abs=TS)


@pytest.mark.parametrize("turbulence", [0.0, 0.5, 8.0])
def test_a_volume_behind_a_turbulent_restrictor_closes_wide_gaps_slower(turbulence):
    lag_s, high_v = 0.2, 1.5
    voltage = np.where(TIME > 1.0, high_v, 0.0)
    out = answer("extra_lag", {"time_constant_s": lag_s, "turbulence": turbulence}, voltage=voltage)
    # The flow that a gap drives, and the gap summed over time as it closes: the integral of (1 + t q)(1 + 2 t q) dq.
    flow = high_v if turbulence == 0.0 else (math.sqrt(1.0 + 4.0 * turbulence * high_v) - 1.0) / (2.0 * turbulence)
    missing_vs = lag_s * (flow + 1.5 * turbulence * flow**2 + 2.0 / 3.0 * turbulence**2 * flow**3)
    assert TS * np.abs(voltage[:-1] - out).sum() == pytest.approx(missing_vs, abs=TS * high_v)


@pytest.mark.parametrize(("saturation", "in_air"), [(0.5, 0.0), (2.0, 0.0), (2.0, 0.3)])
def test_a_coil_whose_core_saturates_misses_its_flux_linkage(saturation, in_air):
    lag_s, high_v = 0.2, 1.5
    voltage = np.where(TIME > 1.0, high_v, 0.0)
    coil = {"time_constant_s": lag_s, "saturation": saturation, "in_air": in_air}
    out = answer("extra_lag", coil, voltage=voltage)
    # The voltage that a coil's current does not show is its flux's rate: summed over time, the arc tangent of it.
    missing_vs = lag_s * (in_air * high_v + (1.0 - in_air) / saturation * math.atan(saturation * high_v))
    assert TS * (voltage[:-1] - out).sum() == pytest.approx(missing_vs, abs=0.5 * TS * high_v)


@pytest.mark.parametrize("unequal", [0.0, 0.3, -0.3])
def test_a_pilot_that_opens_later_than_it_closes_delays_rising_voltages_longer(unequal):
    mean_s, slope = 0.1, 0.5
    ramps = slope * np.minimum(TIME, TIME[-1] - TIME)
    late_s = (ramps[:-1] - answer("delay", {"delay_s": mean_s, "unequal": unequal}, voltage=ramps)) / slope
    rising, falling = (TIME[1:] > 1.0) & (TIME[1:] < 4.0), TIME[1:] > 0.5 * TIME[-1] + 1.0
    assert late_s[rising] == pytest.approx(mean_s * (1.0 + unequal), abs=0.6 * TS)
    assert -late_s[falling] == pytest.approx(mean_s * (1.0 - unequal), abs=0.6 * TS)


def test_extra_lag_is_the_exact_first_order_answer():
    out = answer("extra_lag", {"time_constant_s": 0.1}, FAST, np.where(TIME < 0.1, 0.0, 1.0))
    t = TIME[1:] - 0.1
    # second-order answer of 1 / ((0.05 s + 1)(0.1 s + 1))
    exact = np.where(t > 0, 1 - 2 * np.exp(-t / 0.1) + np.exp(-t / 0.05), 0.0)
    assert np.abs(out - exact).max() < 2e-3


@pytest.mark.parametrize("inertia_s", [1e-6, 0.01, 0.025, 0.05, 0.1])
def test_a_lag_with_mass_is_an_element_of_second_order(inertia_s):
    """From an overdamped one, by two equal lags, to a damping ratio of a half."""
    lag_s = 0.1
    out = answer("extra_lag", {"time_constant_s": lag_s, "inertia_s": inertia_s}, FAST, np.where(TIME < 0.1, 0.0, 1.0))
    whole = np.polymul([0.05, 1.0], [lag_s * inertia_s, lag_s, 1.0])
    exact = np.concatenate([np.zeros(4), signal.step(([1.0], whole), T=TIME[: len(out) - 4])[1]])
    assert np.abs(out - exact).max() < 3e-3


def test_resonance_rings_at_its_frequency_and_settles_at_one():
    out = answer("resonance", {"frequency_hz": 2.0, "damping": 0.05}, voltage=np.ones(500) * (TIME > 0.1))
    assert out.max() == pytest.approx(1 + math.exp(-math.pi * 0.05 / math.sqrt(1 - 0.05**2)), rel=0.02)
    crossings = TIME[1:-1][np.diff(np.sign(out - 1.0)) != 0]
    assert np.mean(np.diff(crossings[1:11])) == pytest.approx(0.25, rel=0.03)


@pytest.mark.parametrize(("path", "unit"), [(FAST, 1.0), (INTEGRATOR, 0.01 * 206.4 / 23.34)])
def test_a_mode_beside_the_path_swings_with_the_voltage(path, unit):
    """Driven at its own frequency it swings by one over twice its damping, a quarter of a turn late."""
    frequency, damping = 2.0, 0.1
    voltage = np.sin(2 * math.pi * frequency * np.arange(2000) * TS)
    mode = {"frequency_hz": frequency, "damping": damping}
    spec = ModelSpec(name="t", paths={Channel.POSITION: path, Channel.PRESSURE: STATIC})

    def out(**beside):
        own = spec.with_effect(Channel.POSITION, "resonance", {**mode, **beside}, at=Attachment.OUTPUT)
        bare = PlantModel(spec, TS).simulate(voltage, voltage).position_m
        return (PlantModel(own, TS).simulate(voltage, voltage).position_m - bare)[-500:]

    unit = unit if path is FAST else unit / (2 * math.pi * frequency)
    swing, rate = out(beside=0.3), out(beside_rate=0.3)
    assert np.ptp(swing) / 2 == pytest.approx(0.3 * unit / (2 * damping), rel=0.02)
    assert np.ptp(rate) / 2 == pytest.approx(np.ptp(swing) / 2, rel=0.02)
    assert np.dot(swing, rate) == pytest.approx(0.0, abs=0.1 * np.dot(swing, swing))


@pytest.mark.parametrize("path", [FAST, INTEGRATOR])
def test_a_mode_beside_the_path_stiffens_with_what_the_output_shows_of_its_swing(path):
    times, voltage = 40.0, np.sign(np.sin(2 * math.pi * 0.3 * np.arange(500) * TS))
    mode = {"frequency_hz": 1.5, "damping": 0.1, "beside": 0.3}

    def out(gain, **more):
        paths = {Channel.POSITION: path.model_copy(update={"gain": gain * path.gain}), Channel.PRESSURE: STATIC}
        spec = ModelSpec(name="t", paths=paths)
        own = spec.with_effect(Channel.POSITION, "resonance", {**mode, **more}, at=Attachment.OUTPUT)
        return PlantModel(own, TS).simulate(voltage, voltage).position_m

    size = float(np.std(out(1.0)))
    curved = out(1.0, doubling=size, stiffening=0.5 / size**2)
    assert np.std(curved - out(1.0)) > 0.01 * size
    larger = out(times, doubling=times * size, stiffening=0.5 / (times * size) ** 2)
    np.testing.assert_allclose(larger, times * curved, rtol=1e-6, atol=1e-9 * times * size)


def test_a_duhem_loop_bends_alike_on_its_way_back():
    """Against v' = a |u'| (u - v) + u' / 2 in fine steps, whose half width is 1 / (2 a)."""
    sharpness, expected, v = 2.5, [], 0.0
    for before, now in zip(np.concatenate([[SWEEP[0]], SWEEP[:-1]]), SWEEP, strict=True):
        for step in np.linspace(before, now, 400)[1:]:
            move = (now - before) / 399
            v += sharpness * abs(move) * (step - v) + 0.5 * move
        expected.append(v)
    loop = {"half_width_v": 1.0 / sharpness, "bouc_wen": 1.0, "depth": 0.5, "way_back": 1.0}
    assert np.abs(answer("hysteresis", loop) - expected[:-1]).max() < 0.02
    assert np.abs(answer("hysteresis", {**loop, "way_back": 0.0}) - expected[:-1]).max() > 0.03


@pytest.mark.parametrize("slope", [-1.0, 0.6])
def test_plays_of_spread_widths_weigh_as_their_density_says(slope):
    """Against eight play operators, the weights along a line about their mean."""
    width, expected = 0.4, 0.0
    for j in range(1, 9):
        play, radius, out = SWEEP[0], width * j / 4.5, []
        for voltage in SWEEP:
            play = min(max(play, voltage - radius), voltage + radius)
            out.append(play)
        expected = expected + (1.0 + slope * (4.5 - j) / 3.5) / 8.0 * np.array(out)
    spread = {"half_width_v": width, "spread": 1.0}
    assert np.abs(answer("hysteresis", {**spread, "density_slope": slope}) - expected[:-1]).max() < 1e-9
    assert np.abs(answer("hysteresis", spread) - expected[:-1]).max() > 0.02


@pytest.mark.parametrize("beta", [0.35, 0.5, 0.7])
def test_a_bouc_wen_loop_follows_its_equation_whatever_its_way_back(beta):
    """Against w z' = u' - (beta |u'| z + gamma u' |z|) |z|^(n - 1) in fine steps, beta + gamma = 1."""
    width, power, expected, z = 0.3, 1.7, [], 0.0
    for before, now in zip(np.concatenate([[SWEEP[0]], SWEEP[:-1]]), SWEEP, strict=True):
        move = (now - before) / 400 / width
        for _ in range(400):
            z += move * (1.0 - (1.0 - beta + beta * np.sign(move * z)) * abs(z) ** power)
        expected.append(now - width * z)
    loop = {"half_width_v": width, "bouc_wen": 1.0, "sharpness": power, "way_back": 2.0 * beta - 1.0}
    way_back = registry()["hysteresis"].parameter("way_back")
    assert way_back.lower <= loop["way_back"] <= way_back.upper
    assert np.abs(answer("hysteresis", loop) - expected[:-1]).max() < 0.02 * width


def test_gain_drifts_with_time():
    out = answer("gain_drift", {"rate_per_s": 0.01}, voltage=np.ones(500))
    assert out[-1] == pytest.approx(1 + 0.01 * TIME[-1], abs=1e-3)


def test_gain_that_ages_with_work_has_aged_alike_after_the_same_work():
    worn = {"rate_per_s": -0.02, "settling_s": 8.0, "onset_s": 1.0, "by_work": 1.0}
    volts = np.concatenate([np.full(100, 2.0), np.full(100, -1.0), np.full(200, 0.0), np.full(300, 1.0)])
    gain = np.ones(len(volts) - 1)
    moved = volts[:-1] != 0.0
    gain[moved] = answer("gain_drift", worn, voltage=volts)[moved] / volts[:-1][moved]
    work = np.concatenate([[0.0], np.cumsum(np.abs(volts)) * TS])[: len(gain)]
    aged = np.maximum(work - 1.0, 0.0)
    np.testing.assert_allclose(gain[moved], (1.0 - 0.02 * 8.0 * (1.0 - np.exp(-aged / 8.0)))[moved], atol=1e-3)
    assert gain[400] == pytest.approx(gain[198], abs=1e-3), "at rest nothing ages"


def test_gain_that_swings_is_the_nominal_one_in_the_mean():
    swing = {"rate_per_s": 0.0, "swing": 0.3, "swing_cosine": -0.2, "period_s": 20.0}
    out = answer("gain_drift", swing, voltage=np.ones(1001))
    assert np.mean(out[:1000]) == pytest.approx(1.0, abs=1e-9)
    assert np.ptp(out) == pytest.approx(2.0 * math.hypot(0.3, 0.2), rel=1e-3)


def test_a_pump_limits_the_speed_and_winds_nothing_up():
    spec = ModelSpec(name="t", paths={Channel.POSITION: INTEGRATOR, Channel.PRESSURE: STATIC})
    limits = {"upper_v": 2.0, "lower_v": -1.0}
    spec = spec.with_effect(Channel.POSITION, "saturation", limits, at=Attachment.STATE)
    voltage = np.select([TIME < 3.0, TIME < 6.0], [6.0, -6.0], 0.5)
    speed = np.diff(PlantModel(spec, TS).simulate(voltage, voltage).position_m) / TS / (0.01 * 206.4 / 23.34)
    assert speed.max() == pytest.approx(2.0)
    assert speed.min() == pytest.approx(-1.0)
    assert speed[-1] == pytest.approx(0.5)
    # Had the flow gone on growing behind the limit, the speed would stay there after the voltage has turned.
    turned = np.flatnonzero(np.diff(voltage) != 0.0)[0] + 1
    assert speed[turned + 1] < 1.0


def test_a_pump_whose_demand_winds_up_goes_on_after_the_voltage_has_turned():
    """Against x' = clip(v), T v' = k u - v in fine steps: v itself knows no limit."""
    spec = ModelSpec(name="t", paths={Channel.POSITION: INTEGRATOR, Channel.PRESSURE: STATIC})
    limits = {"upper_v": 2.0, "lower_v": -1.0, "winding_up": 1.0}
    spec = spec.with_effect(Channel.POSITION, "saturation", limits, at=Attachment.STATE)
    voltage = np.select([TIME < 3.0, TIME < 6.0], [6.0, -6.0], 0.5)
    gain, lag, fine = 0.01 * 206.4 / 23.34, 1.0 / 23.34, 100
    x, v, expected = 0.0, 0.0, []
    for held in voltage:
        expected.append(x)
        for _ in range(fine):
            v += TS / fine * (gain * held - v) / lag
            x += TS / fine * np.clip(v, -1.0 * gain, 2.0 * gain)
    out = PlantModel(spec, TS).simulate(voltage, voltage).position_m
    assert np.abs(out - expected).max() < 0.01 * np.ptp(expected)
    turned = int(np.flatnonzero(np.diff(voltage) != 0.0)[0]) + 1
    assert out[turned + 1] - out[turned] > 1.5 * gain * TS


def test_periodic_disturbance_is_a_sine_at_the_sample():
    out = answer("periodic_disturbance", {"amplitude": 0.2, "frequency_hz": 1.5, "phase_rad": 0.4}, voltage=0 * TIME)
    assert np.allclose(out, 0.2 * np.sin(2 * math.pi * 1.5 * TIME[1:] + 0.4))


def test_a_second_tone_adds_to_the_first():
    sine = {"amplitude": 0.2, "frequency_hz": 1.5, "phase_rad": 0.4}
    second = {"second_share": 0.5, "second_hz": 2.3, "second_rad": -1.0}
    one, both = (answer("periodic_disturbance", {**sine, **more}, voltage=0 * TIME) for more in ({}, second))
    assert np.allclose(both - one, 0.1 * np.sin(2 * math.pi * 2.3 * TIME[1:] - 1.0))


def test_an_oscillation_swells_and_sinks():
    sine = {"amplitude": 0.2, "frequency_hz": 3.0, "phase_rad": 0.4}
    swell = {"swell": 0.7, "swell_hz": 0.3, "swell_rad": 1.0}
    plain, out = (answer("periodic_disturbance", {**sine, **more}, voltage=0 * TIME) for more in ({}, swell))
    assert np.allclose(out, plain * (1.0 + 0.7 * np.sin(2 * math.pi * 0.3 * TIME[1:] + 1.0)))


def test_the_frequency_of_an_oscillation_goes_up_and_down():
    sine = {"amplitude": 0.2, "frequency_hz": 3.0, "phase_rad": 0.4}
    swing = {"modulation_rad": 1.3, "modulation_hz": 0.2, "modulation_phase_rad": 0.9}
    out = answer("periodic_disturbance", {**sine, **swing}, voltage=0 * TIME)
    phase = 2 * math.pi * 3.0 * TIME[1:] + 0.4 + 1.3 * np.sin(2 * math.pi * 0.2 * TIME[1:] + 0.9)
    assert np.allclose(out, 0.2 * np.sin(phase))


@pytest.mark.parametrize("share", [0.5, 0.3, -0.4])
def test_what_pushes_one_way_does_so_about_the_crest_of_its_sine(share):
    sine = {"amplitude": 0.2, "frequency_hz": 1.5, "phase_rad": 0.4}
    plain, out = (
        answer("periodic_disturbance", {**sine, **more}, voltage=0 * TIME) for more in ({}, {"push_share": share})
    )
    side = math.copysign(1.0, share)
    assert np.all(side * out >= 0.0)
    assert np.max(side * out) == pytest.approx(0.2, rel=0.01)
    assert np.mean(out != 0.0) == pytest.approx(abs(share), abs=0.02)
    assert np.mean(out) == pytest.approx(0.2 * share * 2.0 / math.pi, rel=0.05)
    # It is there where the sine is beyond what it is at the push's ends.
    assert np.all((out != 0.0) == (side * plain > 0.2 * math.cos(math.pi * share)))


@pytest.mark.parametrize(
    ("rise", "high", "fall", "wave"),
    [
        (1.0, 0.0, 0.0, lambda angle: signal.sawtooth(angle + math.pi)),
        (0.5, 0.0, 0.5, lambda angle: signal.sawtooth(angle + 0.5 * math.pi, 0.5)),
        (0.0006, 0.5, 0.0, signal.square),
        (0.0006, 0.2, 0.0, lambda angle: signal.square(angle - 0.3 * math.pi, 0.2) + 0.6),
    ],
    ids=["sawtooth", "triangle", "square", "pulses"],
)
def test_edges_make_sawtooth_triangle_square_and_pulses_without_a_mean(rise, high, fall, wave):
    numbers = {"amplitude": 0.2, "frequency_hz": 1.3, "phase_rad": 0.4}
    edges = {"rise_share": rise, "high_share": high, "fall_share": fall}
    out = answer("periodic_disturbance", {**numbers, **edges}, voltage=0 * TIME)
    off = np.abs(out - 0.2 * wave(2 * math.pi * 1.3 * TIME[1:] + 0.4))
    assert np.mean(off > 0.01) < 0.03
    assert np.mean(out) == pytest.approx(0.0, abs=0.01)


def test_bursts_leave_the_sine_as_it_is_or_nothing():
    bursts = {"burst_period_s": 4.0, "burst_share": 0.25, "burst_start_s": -1.0}
    sine = {"amplitude": 0.2, "frequency_hz": 1.5, "phase_rad": 0.4}
    steady, out = (answer("periodic_disturbance", {**sine, **more}, voltage=0 * TIME) for more in ({}, bursts))
    into = (TIME[1:] + 1.0) % 4.0
    assert np.array_equal(out[(into > 0.1) & (into < 0.9)], steady[(into > 0.1) & (into < 0.9)])
    assert not out[(into > 1.1) & (into < 3.9)].any()


@pytest.mark.parametrize("echo", [0.2, -0.3])
def test_a_line_throws_back_a_share_that_comes_two_dead_times_later(echo):
    delay_s = 0.1
    step = np.where(TIME >= TS, 1.0, 0.0)
    out = answer("delay", {"delay_s": delay_s, "echo": echo}, voltage=step)
    every = round(delay_s / TS)
    levels = [out[passes * every + 1] / out[-1] for passes in (0, 2, 4, 6)]
    first = 1.0 / (1.0 + echo + echo**2)
    assert levels == pytest.approx([0.0, first, first * (1.0 + echo), 1.0], abs=1e-9)
    assert out[-1] == pytest.approx(answer("delay", {"delay_s": delay_s}, voltage=step)[-1])


@pytest.mark.parametrize("mixing", [0.1, 0.3])
def test_a_line_that_mixes_is_late_by_its_dead_time_with_that_spread(mixing):
    delay_s = 0.3
    step = np.where(TIME >= TS, 1.0, 0.0)
    late = TIME[:-1]

    def arrivals(**more):
        out = answer("delay", {"delay_s": delay_s, **more}, voltage=step)
        return np.diff(out, prepend=0.0) / out[-1]

    comes, plain = arrivals(mixing=mixing), float(arrivals() @ late)
    mean = float(comes @ late)
    # What comes within a sample shows at its end: on average half of one later than it is put down here.
    assert mean + 0.5 * TS == pytest.approx(plain, abs=0.2 * TS)
    assert float(comes @ (late - mean) ** 2) ** 0.5 == pytest.approx(mixing * delay_s, rel=0.05)
    assert np.all(comes >= -1e-12)
    # What comes early as well leaves the dead time as long.
    assert float(arrivals(mixing=mixing, dispersion=0.2) @ late) + 0.5 * TS == pytest.approx(plain, abs=0.2 * TS)


@pytest.mark.parametrize(("stretch", "levels_v"), [(-0.9, 0.5), (-0.3, 1e9), (0.6, 1.0)])
def test_a_delay_is_shorter_or_longer_the_more_flows_up_to_where_that_levels_off(stretch, levels_v):
    ramp = 0.2 * TIME
    out = answer("delay", {"delay_s": 0.2, "stretch_per_v": stretch, "stretch_levels_v": levels_v}, voltage=ramp)
    late_s = ((ramp[:-1] - out) / 0.2)[50:]
    expected = 0.2 * (1.0 + stretch * levels_v * np.tanh(ramp[:-1] / levels_v))[50:]
    # A voltage is held for a sample.
    assert np.abs(late_s - late_s.mean() - (expected - expected.mean())).max() < 0.6 * TS
    assert np.ptp(late_s) == pytest.approx(np.ptp(expected), abs=TS)


def test_a_delay_that_wanders_is_longer_and_shorter_in_turn():
    ramp = 1.0 * TIME
    out = answer("delay", {"delay_s": 0.2, "wander": 0.5, "wander_hz": 0.25, "wander_rad": 0.3}, voltage=ramp)
    late = (ramp[:-1] - out)[50:]
    expected = 0.2 * (1.0 + 0.5 * np.sin(2.0 * math.pi * 0.25 * TIME[:-1] + 0.3))[50:]
    assert np.abs(late - late.mean() - (expected - expected.mean())).max() < 0.01
    assert np.ptp(late) == pytest.approx(0.2, rel=0.02)


def test_a_spring_on_the_spool_bends_the_voltage_itself():
    """It acts at once, whatever the path: w + coefficient (gain w)^3 = voltage."""
    spring = {"coefficient": 0.05, "of_spool": 1.0}
    lag = PathSpec(numerator=[2.0], denominator=[0.05, 1.0])
    roots = [np.roots([0.05 * 8.0, 0.0, 1.0, -volts]) for volts in SWEEP]
    acts = np.array([float(root[np.abs(root.imag) < 1e-9].real[0]) for root in roots])
    np.testing.assert_allclose(
        answer("cubic_stiffness", spring, lag, SWEEP, Channel.PRESSURE),
        answer(None, {}, lag, acts, Channel.PRESSURE),
        atol=1e-7,
    )


def test_cubic_stiffness_balances_the_voltage():
    out = answer("cubic_stiffness", {"coefficient": 1000.0}, INTEGRATOR, np.ones(500))
    assert out[-1] == pytest.approx((1.0 / 1000.0) ** (1 / 3), rel=1e-3)


def test_a_spring_with_a_linear_part_balances_the_voltage():
    out = answer("cubic_stiffness", {"coefficient": 1000.0, "linear": 5.0}, INTEGRATOR, np.ones(2000))
    assert 1000.0 * out[-1] ** 3 + 5.0 * out[-1] == pytest.approx(1.0, rel=1e-3)


def test_a_spring_that_the_valve_was_trimmed_with_does_nothing_at_zero():
    spring = {"coefficient": 1000.0, "centre": 0.05, "linear": 5.0, "trimmed": 1.0}
    assert np.ptp(answer("cubic_stiffness", spring, INTEGRATOR, np.zeros(500))) < 1e-12
    out = answer("cubic_stiffness", spring, INTEGRATOR, np.ones(2000))[-1]

    def force(y):
        return 1000.0 * (y - 0.05) ** 3 + 5.0 * (y - 0.05)

    assert force(out) - force(0.0) == pytest.approx(1.0, rel=1e-3)


def test_a_linkage_that_gives_lets_a_share_of_each_move_through():
    stiff, gives = (answer("backlash", {"half_width": 0.4, **more}) for more in ({}, {"give": 0.3}))
    assert np.allclose(gives, 0.3 * SWEEP[:-1] + 0.7 * stiff)


@pytest.mark.parametrize(("bend", "left"), [(-1.0, 1.0 / 1.2), (0.0, math.exp(-0.2)), (1.0, 0.8)])
def test_what_tires_goes_with_past_effort_by_the_law_of_its_bend(bend, left):
    out = answer("fatigue", {"loss_per_v": 0.1, "recovery_s": 0.5, "bend": bend}, voltage=np.full(500, -2.0))
    assert out[-1] == pytest.approx(-2.0 * left, rel=1e-4)


def test_what_a_peak_tires_recovers_as_the_peak_is_forgotten():
    voltage = np.repeat([0.5, -2.0, 0.5], [50, 10, 400])
    out = answer("fatigue", {"loss_per_v": 0.1, "recovery_s": 0.5, "bend": 1.0, "of_peaks": 1.0}, voltage=voltage)
    since_s = TS * np.arange(1, len(out[60:]) + 1)
    peak = np.maximum(2.0 * np.exp(-since_s / 0.5), 0.5)
    assert out[50:60] == pytest.approx(-2.0 * 0.8)
    assert out[60:] == pytest.approx(0.5 * (1.0 - 0.1 * peak), rel=2e-3)


@pytest.mark.parametrize("broken", [0.0, 0.7])
def test_what_stiffens_at_rest_breaks_down_with_motion_either_way_and_comes_back(broken):
    law = {"loss": 0.4, "rebuilding_s": 2.0, "breaking_per_v": 1.5, "broken": broken}
    steady = answer("thixotropy", law, voltage=np.full(5000, 1.0))
    assert steady[0] == pytest.approx(1.0 - 0.4 * (1.0 - broken), rel=1e-2)
    assert steady[-1] == pytest.approx(0.6, rel=1e-3)
    back = np.where(np.arange(5000) < 4950, 1.0, np.where(np.arange(5000) < 4951, 2.0, 1.0))
    out = answer("thixotropy", law, voltage=back)
    for sample, given, moved in ((4950, 2.0, 1.0), (4951, 1.0, 2.0)):
        assert out[sample] == pytest.approx(given * (1.0 - 0.4 * math.exp(-1.5 * moved)), rel=0.02)


def test_a_spring_may_stiffen_more_than_with_the_cube_and_sit_ahead_of_the_output():
    swings = PathSpec(numerator=[900.0], denominator=[1.0, 9.0, 900.0])
    spring = {"coefficient": 0.1, "stiffening": 0.5}
    out = answer("cubic_stiffness", spring, swings, np.full(500, 2.0), Channel.PRESSURE)[-1]
    assert out + 0.1 * out**3 * (1.0 + 0.5 * out**2) == pytest.approx(2.0, rel=1e-6)
    wave = 2.0 * np.sin(9.0 * TIME)
    plain, ahead = (
        answer("cubic_stiffness", {**spring, **more}, swings, wave, Channel.PRESSURE) for more in ({}, {"lead_s": 0.02})
    )
    # What is pulled back sooner than it moves is damped.
    assert np.abs(ahead[200:]).max() < np.abs(plain[200:]).max()


def test_quadratic_damping_takes_voltage_with_the_square_of_the_speed():
    # speed per volt of the path is 206.4 / 23.34 cm/s
    out = answer("quadratic_damping", {"coefficient": 50.0}, INTEGRATOR, np.full(500, 3.0))
    speed = (out[-1] - out[-2]) / TS
    assert speed / (0.01 * 206.4 / 23.34) + 50.0 * speed**2 == pytest.approx(3.0, rel=1e-3)


def relieved(**parameters):
    spec = ModelSpec(name="t", paths={Channel.PRESSURE: STATIC})
    spec = spec.with_effect(Channel.PRESSURE, "overflow", {"limit": 1.5, **parameters}, at=Attachment.OUTPUT)
    return PlantModel(spec, TS).simulate(SWEEP, SWEEP).pressure_pa[1:]


def test_a_relief_valve_closes_lower_than_it_opens():
    out, asked = relieved(reseat=0.5), SWEEP[:-1]
    rising = np.diff(SWEEP) > 0.0
    shut = (asked < 1.0) | (rising & (asked < 1.5))
    assert np.array_equal(out[shut], asked[shut])
    assert np.allclose(out[~shut & (np.abs(asked - 1.5) > 0.1) & (asked > 1.05)], 1.0)


def test_a_relief_valve_shuts_by_what_it_leaves_where_that_opens_it():
    valve = {"reseat": 0.3, "override": 0.1, "opening_s": 0.15, "closing_s": 0.2}
    asked = SWEEP[:-1]
    out, by_what_there_would_be = relieved(**valve, relieved=1.0), relieved(**valve)
    # Slow as it is, it has let off too much by when less comes: what it leaves shuts it before what comes does.
    shut = int(np.flatnonzero((np.diff(out) > 0.0) & (np.diff(asked) < 0.0))[0])
    assert out[shut] == pytest.approx(1.2, abs=0.02)
    assert asked[shut] > 1.8
    missing = asked - out
    assert np.allclose(missing[shut + 2 : shut + 6] / missing[shut + 1 : shut + 5], math.exp(-TS / 0.2), rtol=1e-6)
    assert np.array_equal(out[: shut + 1], by_what_there_would_be[: shut + 1])
    assert by_what_there_would_be[shut + 5] < 1.2 < out[shut + 5]


def test_what_a_relief_valve_lets_through_grows_as_of_an_orifice():
    asked = SWEEP[:-1]
    out = relieved(override=0.2, override_exponent=0.5)
    over = np.maximum(asked - 1.5, 0.0)
    np.testing.assert_allclose(out, np.minimum(asked, 1.5 + 0.2 * np.sqrt(1.5 * over)), rtol=1e-12)


def test_a_relief_valve_takes_time_to_open():
    slow, at_once = relieved(opening_s=0.1), relieved()
    assert at_once.max() == pytest.approx(1.5)
    assert at_once.max() + 0.02 < slow.max() < SWEEP.max()
    # What it has let off when it shuts again is still less for a while: it closes as slowly.
    assert (slow < SWEEP[:-1] - 1e-3)[SWEEP[:-1] < 1.45].any()


def test_a_relief_valve_that_is_shut_leaves_its_output_to_recover_in_its_own_time():
    at_once, lets_go = relieved(), relieved(closing_s=0.2)
    shut = SWEEP[:-1] < 1.5
    assert np.array_equal(lets_go[~shut], at_once[~shut])
    # A sub-step of the sample in which it shuts tells no more: what is missing then decays by this time constant.
    missing = (SWEEP[:-1] - lets_go)[shut]
    after = missing[:-1] > 1e-3
    assert after.any()
    assert np.allclose((missing[1:][after] / missing[:-1][after])[2:6], math.exp(-TS / 0.2), rtol=1e-6)
    assert np.array_equal(relieved(opening_s=0.1), relieved(opening_s=0.1, closing_s=0.1))


def test_what_a_relief_valve_lets_off_is_missing_from_what_feeds_a_path_without_a_store():
    swings = PathSpec(numerator=[900.0], denominator=[1.0, 9.0, 900.0])  # one volt holds one unit; settles in 10 ms
    valve = {"limit": 1.5, "weir_s": 0.02, "weir_exponent": 0.5}
    out = answer("overflow", valve, swings, np.full(500, 2.5), Channel.PRESSURE)[-1]
    over = out - 1.5
    assert out + over * 0.01 / 0.02 * (over / 1.5) ** -0.5 == pytest.approx(2.5, rel=1e-4)
    below = np.full(500, 1.3)
    free = answer(None, {}, swings, below, Channel.PRESSURE)
    opened = answer("overflow", {**valve, "limit": 1.1 * free.max()}, swings, below, Channel.PRESSURE)
    np.testing.assert_allclose(opened, free, rtol=1e-9)


def test_a_piston_goes_no_further_than_its_two_ends():
    out = answer("overflow", {"limit": 0.05, "lower_limit": -0.02}, INTEGRATOR)
    assert out.max() == pytest.approx(0.05)
    assert out.min() == pytest.approx(-0.02)


def test_a_piston_that_stands_at_its_end_leaves_it_sooner():
    voltage = np.where(TIME < 5.0, 1.0, -1.0)
    running, standing = (answer("overflow", {"limit": 0.1, "standing": s}, INTEGRATOR, voltage) for s in (0.0, 1.0))
    assert standing.max() == pytest.approx(0.1)
    # A drive that runs on takes ln 2 of its time constant to turn.
    ahead = float(running[-1] - standing[-1]) / (0.01 * 206.4 / 23.34)
    assert ahead == pytest.approx(math.log(2.0) / 23.34, rel=0.02)


def test_where_a_piston_goes_on_from_its_end_moves_as_little_as_the_end():
    voltage = 2.0 * np.sin(2.0 * np.pi * 0.8 * TIME)
    travel = answer(None, {}, INTEGRATOR, voltage)
    ends = travel.max() * np.linspace(0.6, 0.65, 60)
    ways = [answer("overflow", {"limit": end, "standing": 1.0}, INTEGRATOR, voltage) for end in ends]
    moved = max(float(np.abs(b - a).max()) for a, b in pairwise(ways))
    # A stop that is met a sub-step later would leave a jump in where the piston goes on from it.
    assert moved == pytest.approx(float(ends[1] - ends[0]), rel=1e-6)


def test_a_port_that_closes_past_an_end_lets_a_piston_come_to_rest_and_back_at_once():
    voltage = np.where(TIME < 5.0, 1.0, -1.0)
    port = {"limit": 0.1, "lower_limit": -1.0, "throttling": 0.02}
    out = answer("overflow", port, INTEGRATOR, voltage)
    free = answer(None, {}, INTEGRATOR, voltage)
    inside = free < 0.099
    before = np.cumprod(inside).astype(bool)
    np.testing.assert_allclose(out[before], free[before], rtol=1e-9)
    # Past the limit what drives it falls with the way gone: it closes in on where the port is shut.
    assert 0.1195 < out[TIME[1:] < 5.0][-1] < 0.1201
    # The way back is not throttled.
    back = out[TIME[1:] > 5.5]
    np.testing.assert_allclose(np.diff(back)[2:], np.diff(free[TIME[1:] > 5.5])[2:], rtol=1e-3)


def test_an_end_that_gives_is_pressed_in_by_the_voltage():
    pressed = answer("overflow", {"limit": 0.1, "standing": 1.0, "stiffness": 500.0}, INTEGRATOR, np.full(500, 2.0))
    assert pressed[-1] == pytest.approx(0.1 + 2.0 / 500.0)


@pytest.mark.parametrize(
    ("name", "parameters"), [("overflow", {"limit": 0.03}), ("cubic_stiffness", {"coefficient": 4e4})]
)
def test_what_does_not_hold_the_load_leaves_it_its_way(name, parameters):
    away = DisturbanceSpec(numerator=[1.0], denominator=[0.3, 1.0], input_scale=1e-6)
    path = INTEGRATOR.model_copy(update={"disturbance": away})
    load = 1e6 + 1e6 * np.sin(TIME)
    beside = answer(name, {**parameters, "load_share": 0.0}, path, load=load)
    alone = answer(name, parameters, INTEGRATOR)
    moved = answer(None, {}, path, load=load) - answer(None, {}, INTEGRATOR)
    assert np.ptp(moved) > 0.005
    # A spring is told where the load is at a sub-step's end and where the piston is at its start.
    assert np.allclose(beside, alone + moved, atol=1e-4)
    assert np.abs(answer(name, parameters, path, load=load) - beside).max() > 0.002


def test_overflow_stops_at_the_limit_and_leaves_it_at_once():
    voltage = np.where(TIME < 5.0, 1.0, -1.0)
    out = answer("overflow", {"limit": 0.1}, INTEGRATOR, voltage)
    assert out.max() <= 0.1 + 1e-9
    leave = int(np.flatnonzero(out < 0.1 - 1e-3)[-1])
    first_below = int(np.flatnonzero((TIME[1:] > 5.0) & (out < 0.1 - 1e-6))[0])
    assert TIME[1 + first_below] < 5.3
    assert leave > first_below
