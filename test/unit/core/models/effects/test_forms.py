"""Forms of effects beside their plain ones, each by what tells it from that."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from control import pade
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.signal import lsim
from scipy.stats import norm

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import EffectSpec, ModelSpec, PathSimulator, PathSpec

Array = NDArray[np.float64]

PAPER = ModelSpec.from_yaml((Path(__file__).resolve().parents[5] / "config/models/paper.yaml").read_text())
PRESSURE = PAPER.paths[Channel.PRESSURE].model_copy(update={"effects": ()})
POSITION = PAPER.paths[Channel.POSITION].model_copy(update={"effects": (), "disturbance": None})
STATIC = PathSpec(numerator=[1.0], denominator=[1.0])
STEP_S = 0.005


def having(path: PathSpec, name: str, at: str | None = None, **parameters: float) -> PathSpec:
    given = {"name": name, "parameters": parameters} | ({"at": at} if at else {})
    return path.model_copy(update={"effects": (EffectSpec.model_validate(given),)})


def pressure(voltage: Array, path: PathSpec) -> Array:
    return PathSimulator(Channel.PRESSURE, STEP_S, voltage, np.zeros(0), 1e6, 1e6).simulate(path)


def static(voltage: Array, path: PathSpec) -> Array:
    """What comes of each voltage, a sample later, as a hold does."""
    return PathSimulator(Channel.PRESSURE, STEP_S, voltage, np.zeros(0), 0.0, 0.0).simulate(path)


def position(voltage: Array, path: PathSpec) -> Array:
    return PathSimulator(Channel.POSITION, STEP_S, voltage, np.zeros(0), 1e6, 0.0).simulate(path)


@pytest.mark.parametrize("hz", [0.2, 0.5])
def test_a_dispersed_delay_passes_every_size_and_comes_as_late(hz: float) -> None:
    seconds = np.arange(4000) * STEP_S
    sine = np.sin(2.0 * np.pi * hz * seconds)
    late, dispersed = (
        position(sine, having(POSITION, "delay", delay_s=0.1, dispersion=share)) - position(sine, POSITION)
        for share in (0.0, 1.0)
    )
    assert np.std(dispersed[2000:] - late[2000:]) < 2e-3 * np.std(late[2000:])


def test_a_dispersed_delay_answers_a_step_at_once_and_ends_where_a_plain_one_does() -> None:
    step = np.repeat([0.0, 2.0], [100, 900])
    late, dispersed = (pressure(step, having(PRESSURE, "delay", delay_s=0.1, dispersion=s)) for s in (0.0, 1.0))
    assert abs(dispersed[-1] - late[-1]) < 1e-3 * (late[-1] - 1e6)
    assert np.ptp(late[:118]) < 1.0 < np.ptp(dispersed[:118])


@pytest.mark.parametrize(("order", "blocks"), [(2.0, [1]), (1.0, [2]), (2.0 ** (-4 / 5), [2, 2])])
def test_a_dispersed_delay_is_a_pade_element_of_any_order(order: float, blocks: list[int]) -> None:
    seconds = np.arange(3000) * STEP_S
    voltage = np.sin(2.0 * np.pi * 1.1 * seconds) + 0.5 * np.sign(np.sin(2.0 * np.pi * 0.3 * seconds))
    ours = position(voltage, having(POSITION, "delay", delay_s=0.2, dispersion=order))
    top, bottom = np.ones(1), np.ones(1)
    for degree in blocks:
        numerator, denominator = pade(0.2 / len(blocks), degree)
        top, bottom = np.polymul(top, numerator), np.polymul(bottom, denominator)
    times, fine = np.arange(30000) * STEP_S / 10.0, np.repeat(voltage, 10)
    late = lsim((np.polymul([206.4], top), np.polymul([1.0, 23.34, 0.0], bottom)), fine, times)[1][::10] / 100.0
    plain = position(voltage, POSITION)
    assert np.std(ours - late) < 0.02 * np.std(plain - late)


def test_two_joints_of_unequal_play_stand_still_as_long_as_the_tighter_one() -> None:
    seconds = np.arange(2000) * STEP_S
    voltage = 2.0 * np.sin(2.0 * np.pi * 0.5 * seconds)
    moved = position(voltage, POSITION)
    half = 0.1 * float(np.ptp(moved))
    plays = [position(voltage, having(POSITION, "backlash", half_width=half * share)) for share in (1.3, 0.7)]
    both = position(voltage, having(POSITION, "backlash", half_width=half, spread=0.3))
    assert np.allclose(both, 0.5 * (plays[0] + plays[1]), atol=1e-12)
    assert not np.allclose(both, position(voltage, having(POSITION, "backlash", half_width=half)), atol=0.1 * half)


@pytest.mark.parametrize("at", ["input", "output"])
def test_a_contact_that_gives_follows_by_its_time_and_stands_in_the_gap_at_once(at: str) -> None:
    """A spring that meets viscous drag: on a ramp it lags by that of its time, at a reversal nothing pushes it on."""
    half, lag_s, slope = 0.2, 0.05, 1.5
    ramp = slope * STEP_S * np.concatenate([np.arange(400), np.arange(400, 0, -1)])
    out = static(ramp, having(STATIC, "backlash", at, half_width=half, lag_s=lag_s))
    # What acts over a sample comes out at its end, by its mean half a sample behind.
    late_s = lag_s + (0.5 * STEP_S if at == "input" else 0.0)
    assert ramp[398] - out[399] == pytest.approx(half + slope * late_s, rel=0.02)
    # Once the ramp has come back by what the contact gave, the load stands until the gap is taken up.
    given, whole = (int(way / slope / STEP_S) for way in (slope * lag_s, slope * lag_s + 2.0 * half))
    stands = out[402 + given : 398 + whole]
    assert np.ptp(stands) < 0.01 * half
    assert stands[0] == pytest.approx(float(np.max(out)), abs=0.01 * half)


def test_a_load_that_coasts_in_its_gap_goes_on_when_its_drive_stops() -> None:
    """Where drag would stop it later than its drive stops (43 ms), and no further than the gap's other side."""
    half = 0.004
    voltage = np.repeat([2.0, 0.0], [100, 200])
    driven = position(voltage, POSITION)
    stands, pushed, coasts, far = (
        position(voltage, having(POSITION, "backlash", half_width=half, coast_s=time))
        for time in (0.0, 0.02, 0.06, 0.5)
    )
    assert stands[-1] == pytest.approx(driven[-1] - half, abs=1e-9)
    assert np.allclose(pushed, stands, atol=1e-9)
    assert stands[-1] + 0.05 * half < coasts[-1] < far[-1] <= driven[-1] + half + 1e-12
    assert np.all(np.abs(coasts - driven) <= half + 1e-12)
    assert np.allclose(coasts[20:100], stands[20:100], atol=1e-9)


@pytest.mark.parametrize("coast_s", [0.0, 0.2])
def test_a_load_that_rubs_in_its_gap_comes_as_far_as_its_speed_takes_it(coast_s: float) -> None:
    drag, half = 0.5, 0.02
    voltage = np.repeat([2.0, 0.0], [100, 200])
    driven = position(voltage, POSITION)
    out = position(voltage, having(POSITION, "backlash", half_width=half, dry_drag=drag, coast_s=coast_s))
    # It leaves its drive where that slows down quicker, and takes no notice of it any more.
    at = 100 + int(np.argmax(np.abs(out[100:] - driven[100:] + half) > 1e-9)) - 1
    speed = (driven[at] - driven[at - 1]) / STEP_S
    lost = drag * coast_s
    way = coast_s * (speed - lost * np.log1p(speed / lost)) if coast_s else 0.5 * speed**2 / drag
    assert out[-1] - out[at] == pytest.approx(way, rel=1e-6)
    assert np.ptp(out[-100:]) == 0.0


def test_a_gain_that_steps_is_the_voltage_stepping_with_it() -> None:
    voltage = 2.0 + np.sin(2.0 * np.pi * 0.5 * STEP_S * np.arange(400))
    steps = {"jump": -0.2, "jump_s": 100 * STEP_S, "second_jump": 0.3, "second_jump_s": 250 * STEP_S}
    stepped = pressure(voltage, having(PRESSURE, "gain_drift", rate_per_s=0.0, **steps))
    gain = 1.0 - 0.2 * (np.arange(400) >= 100) + 0.3 * (np.arange(400) >= 250)
    assert np.allclose(stepped, pressure(voltage * gain, PRESSURE), rtol=1e-9)


def test_what_leaks_at_rest_and_is_made_up_for_does_not_show_there() -> None:
    still = np.zeros(600)
    orifice = {"coefficient": 1.0, "turbulence": 1.0}
    lost, made_up = (pressure(still, having(PRESSURE, "leakage", **orifice, made_up=share)) for share in (0.0, 1.0))
    assert lost[-1] < 0.95e6
    assert made_up == pytest.approx(1e6, rel=1e-9)
    full = np.full(600, 3.0)
    assert pressure(full, having(PRESSURE, "leakage", **orifice, made_up=1.0))[-1] < pressure(full, PRESSURE)[-1] - 5e4


def test_a_gap_that_widens_loses_more_than_in_proportion() -> None:
    def lost(volts: float) -> float:
        leak = having(PRESSURE, "leakage", coefficient=0.5, base=1.0, widening=3e-7)
        voltage = np.full(800, volts)
        return float(pressure(voltage, PRESSURE)[-1] - pressure(voltage, leak)[-1])

    assert lost(4.0) > 3.0 * lost(2.0) > 0.0


def test_a_lip_that_the_pressure_seats_loses_less_than_in_proportion_and_nothing_once_it_is_shut() -> None:
    def lost(volts: float) -> float:
        leak = having(PRESSURE, "leakage", coefficient=0.5, base=1.0, widening=-2e-7)
        voltage = np.full(800, volts)
        return float(pressure(voltage, PRESSURE)[-1] - pressure(voltage, leak)[-1])

    assert 0.0 < lost(3.0) < 1.5 * lost(1.0)
    assert pressure(np.full(800, 1.0), PRESSURE)[-1] < 6e6 < pressure(np.full(800, 6.0), PRESSURE)[-1]
    assert lost(6.0) == pytest.approx(0.0, abs=1.0)


def test_a_bore_worn_in_one_place_leaks_there_as_the_plain_form_does_and_less_elsewhere() -> None:
    def creep(place_m: float, **form: float) -> float:
        leak = having(POSITION, "leakage", coefficient=1e-9, **form)
        still = PathSimulator(Channel.POSITION, STEP_S, np.zeros(200), np.full(200, 2e6), 1e6, place_m)
        return float(np.ptp(still.simulate(leak)))

    worn = {"worn": 0.8, "worn_at": 0.1, "worn_bend": 30.0}
    plain = creep(0.1)
    assert creep(0.1, **worn) == pytest.approx(plain, rel=1e-2)
    assert creep(0.1 + 1.0 / 30.0, **worn) == pytest.approx(plain * (0.2 + 0.8 / np.e), rel=5e-2)
    assert creep(-0.1, **worn) == pytest.approx(0.2 * plain, rel=1e-2)


def test_a_seal_that_gives_way_leaks_above_its_pressure_only() -> None:
    def creep(load_pa: float, **form: float) -> float:
        leak = having(POSITION, "leakage", coefficient=1e-9, base=1.5, **form)
        still = PathSimulator(Channel.POSITION, STEP_S, np.zeros(200), np.full(200, load_pa), 1e6, 0.0)
        return float(still.simulate(leak)[-1])

    assert creep(2.5e6, opens=1.0) == pytest.approx(creep(2.5e6), rel=1e-9)
    assert creep(2.5e6) < 0.0 < creep(1.2e6)
    assert creep(1.2e6, opens=1.0) == 0.0


def test_a_pressure_that_rises_quicker_than_it_falls_ends_at_the_same() -> None:
    voltage = np.repeat([0.0, 3.0, 0.0], [50, 400, 400])
    plain = pressure(voltage, PRESSURE)
    one_sided = pressure(voltage, having(PRESSURE, "asymmetric_gain", at="state", asymmetry=0.4))
    assert one_sided[[449, 849]] == pytest.approx(plain[[449, 849]], rel=2e-3)
    assert one_sided[70] > plain[70] + 1e4
    assert one_sided[470] > plain[470] + 1e4


def test_unequal_areas_change_the_way_and_not_when_the_piston_turns() -> None:
    voltage = 2.0 * np.sin(2.0 * np.pi * 0.5 * STEP_S * np.arange(1200))
    plain = position(voltage, POSITION)
    unequal = having(POSITION, "asymmetric_gain", at="state", asymmetry=0.2, of_speed=1.0)
    steps = np.diff(plain)
    expected = np.cumsum(steps + 0.2 * np.abs(steps))
    assert position(voltage, unequal)[1:] == pytest.approx(expected, abs=2e-5 * np.ptp(plain))


def test_a_pump_that_delivers_less_from_a_pressure_on_is_the_nominal_one_below_it() -> None:
    knee = {"per_load": 2e-7, "base": 2.5, "linearity": 1.0}
    low, high = np.full(600, 1.0), np.full(600, 4.0)
    above = having(PRESSURE, "load_dependent_gain", above=1.0, **knee)
    both = having(PRESSURE, "load_dependent_gain", **knee)
    assert np.array_equal(pressure(low, above), pressure(low, PRESSURE))
    assert pressure(low, both)[-1] > pressure(low, PRESSURE)[-1] + 1e4
    assert pressure(high, above)[-1] == pytest.approx(pressure(high, both)[-1], rel=1e-9)
    assert pressure(high, above)[-1] < pressure(high, PRESSURE)[-1] - 1e5


@pytest.mark.parametrize("volts", [1.0, 3.0])
def test_a_droop_divides_the_gain(volts: float) -> None:
    per_pa = 2e-7
    droop = having(PRESSURE, "load_dependent_gain", per_load=per_pa, linearity=2.0)
    voltage = np.full(1500, volts)
    above = pressure(voltage, droop)[-1] - 1e6
    assert above * (1.0 + per_pa * above) == pytest.approx(pressure(voltage, PRESSURE)[-1] - 1e6, rel=1e-3)


@pytest.mark.parametrize("volts", [1.0, 3.0])
def test_a_loss_that_grows_costs_more_with_each_further_load_pressure(volts: float) -> None:
    per_pa, growth = 4e-8, 3e-7
    grows = having(PRESSURE, "load_dependent_gain", per_load=per_pa, linearity=1.0, growth=growth)
    voltage = np.full(1500, volts)
    above, given = (pressure(voltage, path)[-1] - 1e6 for path in (grows, PRESSURE))
    assert above == pytest.approx(given * (1.0 - per_pa * above * (1.0 + growth * above)), rel=1e-3)


def spool(voltage: Array, **parameters: float) -> Array:
    """Voltage (V) at which a spool with friction stands, as a slow valve's pressure shows it."""
    gain = (pressure(np.full(400, 1.0), PRESSURE)[-1] - 1e6) / 1.0
    return (pressure(voltage, having(PRESSURE, "friction", **parameters)) - 1e6) / gain


def test_a_spool_that_slips_moves_in_stairs_and_stays_at_most_as_far_behind_as_it_sticks() -> None:
    voltage = np.concatenate([np.linspace(0.0, 4.0, 20000), np.linspace(4.0, 1.0, 20000)])
    stands = spool(voltage, coulomb_v=0.4, slip=0.75)
    behind = np.abs(voltage - stands)
    assert behind.max() < 0.42
    levels = np.round(stands[np.abs(np.gradient(stands)) < 1e-7], 2)
    assert len(np.unique(levels)) >= 12
    assert np.diff(np.unique(levels[: len(levels) // 2])).min() > 0.28


def test_a_spool_that_slips_nowhere_is_a_play_operator_and_one_that_slides_on_has_no_stairs() -> None:
    voltage = 2.0 + 1.5 * np.sin(2.0 * np.pi * 0.2 * np.arange(4000) * STEP_S)
    play = (pressure(voltage, having(PRESSURE, "hysteresis", half_width_v=0.3)) - 1e6) * 1e-6
    stuck = (pressure(voltage, having(PRESSURE, "friction", coulomb_v=0.3, slip=0.0)) - 1e6) * 1e-6
    assert np.allclose(play, stuck, atol=1e-9)
    sliding, stairs = (spool(voltage, coulomb_v=0.3, slip=0.5, slides_on=on) for on in (1.0, 0.0))
    rising = slice(200, 240)
    assert np.all(np.diff(sliding[rising]) > 1e-4)
    assert np.any(np.diff(stairs[200:400]) < 1e-5)
    damped = spool(voltage, coulomb_v=0.3, slip=0.5, slide_s=0.05)
    assert np.std(damped - stairs) > 0.01


@pytest.mark.parametrize(("before", "after"), [(-1.0, 2.0), (1.0, -2.0)])
def test_a_spool_that_ends_further_out_past_zero_opens_all_the_way(before: float, after: float) -> None:
    step = np.repeat([before, after], [200, 400])
    sided = having(PRESSURE, "extra_lag", time_constant_s=0.1, closing=0.3, past_zero=1.0)
    alike = having(PRESSURE, "extra_lag", time_constant_s=0.13)
    assert np.allclose(pressure(step, sided)[200:], pressure(step, alike)[200:], rtol=1e-9)
    slewed = having(PRESSURE, "rate_limit", rate_v_per_s=2.0, closing=0.3, past_zero=1.0)
    slower = having(PRESSURE, "rate_limit", rate_v_per_s=1.4)
    assert np.allclose(pressure(step, slewed)[200:], pressure(step, slower)[200:], rtol=1e-9)


def test_a_mass_that_rides_on_the_path_shows_in_jumps_and_not_at_rest() -> None:
    step = np.repeat([0.0, 1.0], [100, 3900])
    # 1 + g s^2 / (s^2 + 2 z w s + w^2): a jump comes through 1 + g times, what stands as it is.
    ridden = having(STATIC, "resonance", frequency_hz=3.0, damping=0.09, share=-0.5, riding=-0.09)
    out = PathSimulator(Channel.PRESSURE, STEP_S, step, np.zeros(0), 0.0, 0.0).simulate(ridden)
    assert out[101] == pytest.approx(1.5, abs=0.06)
    assert out[-1] == pytest.approx(1.0, abs=1e-6)


def test_a_piston_whose_lag_is_unequal_too_goes_as_its_equation_says() -> None:
    """v' = (g(u) K u - v) / T(v): the gain by which way the valve is open, the lag by which way the piston moves."""
    gain, rate, asymmetry, unequal = 0.01 * 206.4 / 23.34, 23.34, -0.2, 0.3
    servo = np.repeat([1.0, -1.0, 0.4, -2.0], 30)
    speed, went, fine = 0.0, [0.0], 200
    for volts in servo:
        driven, way = gain * volts * (1.0 + asymmetry * np.sign(volts)), went[-1]
        for _ in range(fine):
            quick = rate / (1.0 + unequal * np.sign(speed or driven))
            before, speed = speed, driven + (speed - driven) * np.exp(-quick * STEP_S / fine)
            way += 0.5 * (before + speed) * STEP_S / fine
        went.append(way)
    out = position(servo, having(POSITION, "asymmetric_gain", at="state", asymmetry=asymmetry, lag_asymmetry=unequal))
    equal = position(servo, having(POSITION, "asymmetric_gain", at="state", asymmetry=asymmetry))
    off, other = (np.abs(one - np.array(went[:-1])).max() for one in (out, equal))
    assert off < 0.02 * other


@pytest.mark.parametrize("asymmetry", [0.25, -0.25])
def test_a_piston_with_unequal_drag_goes_as_its_equation_says(asymmetry: float) -> None:
    """T v' = K u - v + a |v|: gain and lag over 1 - a forward, over 1 + a backward."""
    gain, rate = 0.01 * 206.4 / 23.34, 23.34
    servo = np.repeat([1.0, -1.0, 0.4, -2.0], 30)
    speed, went, fine = 0.0, [0.0], 200
    for volts in servo:
        way = went[-1]
        for _ in range(fine):
            drag = 1.0 - asymmetry * np.sign(speed or volts)
            before, end = speed, gain * volts / drag
            speed = end + (speed - end) * np.exp(-rate * drag * STEP_S / fine)
            way += 0.5 * (before + speed) * STEP_S / fine
        went.append(way)
    dragged = position(servo, having(POSITION, "asymmetric_gain", at="state", asymmetry=asymmetry, of_drag=1.0))
    driven = position(servo, having(POSITION, "asymmetric_gain", at="state", asymmetry=asymmetry))
    off, other = (np.abs(one - np.array(went[:-1])).max() for one in (dragged, driven))
    assert off < 0.01 * other


def test_a_mode_that_only_changes_shake_answers_as_behind_a_washout() -> None:
    time_s = np.arange(4000) * STEP_S
    given = np.where(time_s < 0.5, 0.0, 1.0) + 0.3 * np.sin(2.0 * np.pi * 1.7 * time_s)
    w, damping, share, washout_s = 2.0 * np.pi * 2.5, 0.08, 0.4, 0.15
    mode = np.polymul([washout_s, 1.0], [1.0 / w**2, 2.0 * damping / w, 1.0])
    exact = given + lsim(([share * washout_s, 0.0], mode), given, time_s, interp=False)[1]
    numbers = {"frequency_hz": 2.5, "damping": damping, "share": share, "washout_s": washout_s}
    out = static(given, having(STATIC, "resonance", **numbers))
    # What comes a sample later is the mean within the sample.
    assert np.abs(out[1:] - 0.5 * (exact[1:] + exact[:-1] + given[:-1] - given[1:])).max() < 2e-3
    carried = static(given, having(STATIC, "resonance", **{**numbers, "washout_s": 0.0}))
    assert np.abs(carried - out).max() > 0.1


def test_a_loop_closes_where_iron_saturates() -> None:
    wave = 3.0 * np.sin(2.0 * np.pi * 0.25 * np.arange(1600) * STEP_S)
    open_loop, closing = (
        np.abs(pressure(wave, having(STATIC, "hysteresis", half_width_v=0.2, depth=0.5, closes_v=v))[1:] - wave[:-1])
        for v in (0.0, 0.7)
    )
    small, large = np.abs(wave[:-1]) < 0.05, np.abs(wave[:-1]) > 2.5
    assert np.allclose(closing[small], open_loop[small], rtol=5e-3, atol=1e-6)
    assert closing[large].max() < 0.01 * open_loop[large].max()


def test_a_loop_that_closes_may_be_widest_anywhere() -> None:
    wave = 2.0 * np.sin(2.0 * np.pi * 0.25 * np.arange(1600) * STEP_S)
    loop = {"half_width_v": 0.2, "depth": 0.5, "closes_v": 0.7}
    about_zero = static(wave, having(STATIC, "hysteresis", **loop))
    shifted = static(wave + 1.5, having(STATIC, "hysteresis", open_at_v=1.5, **loop))
    assert np.allclose(shifted[800:] - 1.5, about_zero[800:], atol=1e-9)


def test_a_leak_grows_as_its_oil_warms() -> None:
    load, still = np.full(4000, 3e6), np.zeros(4000)
    cold, warming = (
        PathSimulator(Channel.POSITION, STEP_S, still, load, 0.0, 0.0).simulate(
            having(POSITION, "leakage", coefficient=1e-10, warming_per_s=rate)
        )
        for rate in (0.0, 0.02)
    )
    seconds = np.arange(4000) * STEP_S
    # Its creep, integrated: c P (t + w t^2 / 2).
    assert np.allclose(warming[2000:], cold[2000:] * (1.0 + 0.01 * seconds[2000:]), rtol=0.01)


def test_air_in_a_sensors_line_is_soft_at_low_pressure_only() -> None:
    low, high = (np.repeat([volts, volts + 0.05], [2000, 2000]) for volts in (0.1, 4.0))
    static = PathSpec(numerator=[1e6], denominator=[1.0], rest=0.0)
    airy = having(static, "trapped_air", at="output", softness_s=0.4, stiffening=2e-6)

    def rise_s(voltage: Array) -> float:
        out = PathSimulator(Channel.PRESSURE, STEP_S, voltage, np.zeros(0), 0.0, float(voltage[0]) * 1e6).simulate(airy)
        return STEP_S * float(np.sum(1.0 - (out[2000:] - out[1999]) / (0.05e6)))

    assert rise_s(low) > 3.0 * rise_s(high)


def test_air_in_a_sensors_line_may_answer_to_the_pressure_ahead_of_it() -> None:
    """T y' = p - y with T = softness / (1 + stiffening p), exact under a steady pressure p."""
    static = PathSpec(numerator=[1e6], denominator=[1.0], rest=0.0)
    airy = having(static, "trapped_air", at="output", softness_s=0.4, stiffening=2e-6, ahead=1.0)
    out = PathSimulator(Channel.PRESSURE, STEP_S, np.repeat([0.0, 3.0], [1, 400]), np.zeros(0), 0.0, 0.0).simulate(airy)
    mid_s = STEP_S * (np.arange(399) + 0.5)
    assert out[2:] == pytest.approx(3e6 * -np.expm1(-mid_s * 7.0 / 0.4), abs=1e4)


def test_a_drift_that_never_settles_is_what_one_that_settles_ever_later_comes_to() -> None:
    voltage = np.full(1500, 2.0)

    def drifting(**settling: float) -> np.ndarray:
        return pressure(voltage, having(PRESSURE, "gain_drift", rate_per_s=0.01, **settling))

    never = drifting()
    gaps = [float(np.max(np.abs(drifting(settling_s=t) - never))) for t in (10.0, 100.0, 1e4, 1e9)]
    assert gaps == sorted(gaps, reverse=True)
    assert gaps[0] > 1e4
    assert gaps[-1] < 1.0


def rung(height: float, **more: float) -> np.ndarray:
    """What is left of a step's ringing, per its height."""
    step = np.repeat([0.0, height], [50, 1500])
    mode = having(STATIC, "resonance", frequency_hz=2.0, damping=0.05, **more)
    return (static(step, mode)[50:] - height) / height


def test_behind_an_orifice_large_swings_die_sooner_and_small_ones_as_without() -> None:
    large, small, plain = rung(4.0, doubling=1.0), rung(1e-4, doubling=1.0), rung(1.0)
    assert np.allclose(rung(4.0), plain, atol=1e-9)
    assert np.max(np.abs(small - plain)) < 1e-3
    assert np.std(large) < 0.7 * np.std(plain)
    assert np.allclose(rung(8.0, doubling=2.0), large, atol=1e-9)


@pytest.mark.parametrize("stiffening", [0.6, -0.08])
def test_a_stiffening_mode_swings_as_duffings(stiffening: float) -> None:
    """Against the equation itself; the wider it swings the quicker, or slower where it softens."""
    step_v, damping, frequency_hz = 2.0, 0.03, 1.0
    omega = 2.0 * np.pi * frequency_hz

    def motion(_: float, state: np.ndarray) -> list[float]:
        gap = state[0] - step_v
        return [state[1], -2.0 * damping * omega * state[1] - omega**2 * (1.0 + stiffening * gap**2) * gap]

    after = np.arange(800) * STEP_S
    exact = solve_ivp(motion, (0.0, after[-1]), [0.0, 0.0], t_eval=after, rtol=1e-8, atol=1e-10).y[0]
    mode = having(STATIC, "resonance", frequency_hz=frequency_hz, damping=damping, stiffening=stiffening)
    out = static(np.repeat([0.0, step_v], [50, 850]), mode)[51 : 51 + after.size]
    # Sub-steps hold the stiffness, and an output read at a sample is that sub-step's mean.
    assert np.max(np.abs(out - exact)) < 0.05 * np.max(exact)


def test_an_uneven_loop_turns_over_a_longer_way_up_than_down() -> None:
    triangle = np.concatenate([np.linspace(0.0, 2.0, 400), np.linspace(2.0, 0.0, 400)] * 3)

    def lag(uneven: float) -> np.ndarray:
        loop = having(STATIC, "hysteresis", half_width_v=0.3, bouc_wen=1.0, way_back=1.0, uneven=uneven)

        return triangle[:-1] - static(triangle, loop)[1:]

    even, odd, other = lag(0.0), lag(0.5), lag(-0.5)
    up, down = slice(1600 + 40, 1600 + 100), slice(2000 + 40, 2000 + 100)
    assert np.all(odd[up] < even[up])
    assert np.all(odd[down] < even[down])
    assert np.all(other[up] > even[up])
    assert np.max(np.abs(odd)) == pytest.approx(0.3, rel=0.05)


@pytest.mark.parametrize("sharpness", [0.5, 1.0, 2.3, 6.0])
@pytest.mark.parametrize("half_width_v", [0.002, 0.02, 0.2])
def test_a_loop_that_is_moved_far_at_once_is_at_its_far_side(half_width_v: float, sharpness: float) -> None:
    jumps = np.repeat([0.0, 2.0, -1.5, 2.5], 40)
    loop = having(STATIC, "hysteresis", half_width_v=half_width_v, bouc_wen=1.0, sharpness=sharpness, way_back=0.5)
    behind = jumps[:-1] - static(jumps, loop)[1:]
    assert behind[[60, 140]] == pytest.approx(half_width_v, rel=0.1)
    assert behind[100] == pytest.approx(-half_width_v, rel=0.1)


@pytest.mark.parametrize("ratio", [1.5, 3.0, 6.0])
def test_memory_ends_where_it_began_and_starts_by_its_share_less(ratio: float) -> None:
    step = np.repeat([0.0, 1.0], [50, 60_000])
    answer = static(step, having(STATIC, "memory", share=0.3, slowest_s=4.0, ratio=ratio))
    assert answer[51] == pytest.approx(0.7, abs=0.05)
    assert answer[-1] == pytest.approx(1.0, abs=1e-6)
    assert np.all(np.diff(answer[50:]) >= -1e-12)


def relays(volts: Array, centres_v: Array, half_width_v: float) -> Array:
    """Mean answer (n,), from -1 to 1, of relays that switch at centre + half width and back at centre - half width."""
    on = np.where(centres_v < 0.0, 1.0, -1.0)
    answers = []
    for now in volts:
        on = np.where(now >= centres_v + half_width_v, 1.0, np.where(now <= centres_v - half_width_v, -1.0, on))
        answers.append(float(on.mean()))
    return np.array(answers)


@pytest.mark.parametrize("middle_v", [0.0, 1.0])
@pytest.mark.parametrize("share", [1.0, 0.4])
def test_a_loop_that_saturates_is_relays_with_centres_dense_as_a_bell(middle_v: float, share: float) -> None:
    """Preisach's model: a density of relays over centre and width."""
    spread_v, half_width_v, steepness = 0.8, 0.3, 1.4
    centres = middle_v + spread_v * norm.ppf((np.arange(2000) + 0.5) / 2000)
    time_s = STEP_S * np.arange(3000)
    volts = middle_v + 2.5 * np.sin(0.6 * time_s) + 0.9 * np.sin(2.1 * time_s)
    bend = np.sqrt(2.0 / np.pi) / spread_v
    numbers = {"half_width_v": half_width_v, "bend_per_v": bend, "steepness": steepness, "depth": share}
    answer = static(volts, having(STATIC, "hysteresis", **numbers, open_at_v=middle_v))[1:]
    expected = middle_v + steepness / bend * relays(volts, centres, half_width_v)
    assert answer == pytest.approx((1.0 - share) * volts[:-1] + share * expected[:-1], abs=2e-3)


@pytest.mark.parametrize("cushion_s", [0.003, 0.02])
def test_a_cushioned_end_presses_back_as_a_spring_and_a_damper(cushion_s: float) -> None:
    """Against the equation itself, with the lag and the speed per volt of the path."""
    lag_s, gain, end, stiffness = 0.05, 0.1, 0.02, 3000.0
    path = PathSpec(numerator=[gain / lag_s], denominator=[1.0, 1.0 / lag_s, 0.0])
    volts = 3.0 * np.sign(np.sin(2.0 * np.pi * 0.5 * STEP_S * np.arange(800) + 0.1))

    def motion(_: float, state: Array, driven: float) -> list[float]:
        place, speed = state
        pressed = stiffness * (place - end + cushion_s * max(speed, 0.0)) if place > end else 0.0
        return [speed, (gain * (driven - pressed) - speed) / lag_s]

    state, exact = np.zeros(2), [0.0]
    for driven in volts[:-1]:
        state = solve_ivp(motion, (0.0, STEP_S), state, args=(driven,), max_step=5e-4, rtol=1e-7).y[:, -1]
        exact.append(float(state[0]))
    stop = {"limit": end, "stiffness": stiffness, "cushion_s": cushion_s}
    pressed_in, free = (position(volts, p) for p in (having(path, "overflow", **stop), path))
    # An end met within a sub-step is met by all of it or not at all.
    assert np.max(np.abs(pressed_in - exact)) < 3e-4
    assert np.max(np.abs(free - exact)) > 0.05


@pytest.mark.parametrize("stop", [{}, {"stiffness": 7000.0, "cushion_s": 0.008}], ids=["hard", "spring_and_damper"])
def test_a_mass_on_a_spring_meets_a_stop(stop: dict[str, float]) -> None:
    """It stands still there, leaves at once, and is pressed back by what the stop is made of."""
    path = PathSpec(numerator=[0.576], denominator=[1.0, 19.2, 144.0])
    end, step_s, fine = 0.012, STEP_S, 200
    volts = 5.0 * np.sin(1.9 * step_s * np.arange(2400)) + 2.0 * np.sin(6.9 * step_s * np.arange(2400))
    place, speed, ways = 0.0, 0.0, []
    for volt in volts:
        ways.append(place)
        for _ in range(fine):
            over = max(place - end, 0.0) if stop else 0.0
            pressed = stop["stiffness"] * (over + stop["cushion_s"] * max(speed, 0.0)) if over > 0.0 else 0.0
            speed += step_s / fine * (0.576 * (volt - pressed) - 19.2 * speed - 144.0 * place)
            place += step_s / fine * speed
            if not stop and place > end:
                place, speed = end, min(speed, 0.0)
    stopped = position(volts, having(path, "overflow", limit=end, standing=1.0, **stop))
    free = position(volts, path)
    assert np.std(free - ways) > 2e-3
    assert np.std(stopped - ways) < 2e-5
    # It is no store: nothing of it runs over.
    assert position(volts, having(path, "overflow", limit=end, **stop)) == pytest.approx(free, abs=1e-12)


def test_a_mass_without_a_spring_goes_no_further_than_its_limit() -> None:
    path = PathSpec(numerator=[0.5], denominator=[1.0, 0.0, 0.0])
    volts = np.full(400, 1.0)
    assert position(volts, path)[-1] > 0.2
    assert position(volts, having(path, "overflow", limit=0.1))[-1] == pytest.approx(0.1)


def test_a_leak_of_a_mass_on_a_spring_is_taken_off_the_voltage() -> None:
    """It is no store that loses it at once: the output comes to stand lower by the flow in the mean lag of the path."""
    path = PathSpec(numerator=[0.576], denominator=[1.0, 19.2, 144.0])
    leak, volts = 2e-9, np.full(2000, 3.0)
    lower = position(volts, path) - position(volts, having(path, "leakage", coefficient=leak))
    assert lower[-1] == pytest.approx(leak * 1e6 * 19.2 / 144.0, rel=1e-3)
    assert lower[1] < 0.2 * leak * 1e6 * STEP_S


@pytest.mark.parametrize(
    ("bend", "law"), [(0.0, np.exp), (1.0, lambda heat: 1.0 + heat), (-1.0, lambda heat: 1.0 / (1.0 - heat))]
)
def test_a_gain_that_heats_goes_with_the_filtered_losses_and_back_at_rest(bend: float, law: Callable) -> None:
    volts = np.repeat([3.0, -3.0, 0.0, 2.0], [4000, 4000, 8000, 200])
    heat = {"heat_per_v2": -0.03, "heat_s": 5.0, "heat_bend": bend}
    out = static(volts, having(STATIC, "gain_drift", rate_per_s=0.0, **heat))
    held = 1.0 - np.exp(-np.arange(1, 4001) * STEP_S / 5.0)
    np.testing.assert_allclose(out[1:4001], 3.0 * law(-0.03 * 9.0 * held), rtol=1e-9)
    assert out[8000] == pytest.approx(-3.0 * law(-0.27), rel=1e-3), "either sign heats"
    assert out[16001] == pytest.approx(2.0, rel=2e-3), "at rest it cools"


def _limited_between(voltage: Array, before_s: float, after_s: float, upper_v: float, fine: int = 50) -> Array:
    """A lag, what gets through of it, and a lag, held within a fine step."""
    step, before, after, found = STEP_S / fine, 0.0, 0.0, np.zeros(len(voltage))
    for k, volts in enumerate(voltage):
        found[k] = after
        for _ in range(fine):
            half = volts + (before - volts) * np.exp(-0.5 * step / before_s)
            before = volts + (half - volts) * np.exp(-0.5 * step / before_s)
            after = min(half, upper_v) + (after - min(half, upper_v)) * np.exp(-step / after_s)
    return found


@pytest.mark.parametrize("upper_v", [1.5, 100.0], ids=["met", "never met"])
def test_a_limit_behind_one_of_a_paths_lags_limits_what_that_lets_through(upper_v: float) -> None:
    before_s, after_s = 0.03, 0.08
    lags = PathSpec(numerator=[1.0], denominator=[before_s * after_s, before_s + after_s, 1.0])
    voltage = np.repeat(np.random.default_rng(8).uniform(0.0, 3.0, 40), 15)
    behind = static(voltage, having(lags, "saturation", upper_v=upper_v, lower_v=-100.0, behind_s=before_s))
    wanted = _limited_between(voltage, before_s, after_s, upper_v)
    assert np.std(behind - wanted) < 2e-3 * np.std(wanted)
    in_front = static(voltage, having(lags, "saturation", upper_v=upper_v, lower_v=-100.0))
    assert (np.std(in_front - wanted) > 0.02 * np.std(wanted)) == (upper_v < 3.0)
