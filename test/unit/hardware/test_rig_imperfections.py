"""Each imperfection shows by its own fingerprint, and is gone where its file leaves it out."""

import numpy as np
import pytest
from scipy import signal

from dt_station_nodes.hardware.virtual import RigInput, VirtualRig, load_rig
from support.rigs import drive, noiseless, rig, settled, triangle

STEP_S = 0.02


def loop_width_v(rig, low=0.0, high=5.0):
    """Width of the loop of a slow triangle at its middle pressure, in volts; each branch at its own time."""
    voltage = triangle(low, high, 20.0, STEP_S)
    pressure = drive(rig, voltage, 0.0).signals["pressure_pa"]
    last = slice(len(voltage) // 2, None)
    voltage, pressure = voltage[last], pressure[last]
    top = int(np.argmax(voltage))
    middle = (pressure[0] + pressure[top]) / 2
    rising = np.interp(middle, pressure[:top], voltage[:top])
    falling = np.interp(middle, pressure[top:][::-1], voltage[top:][::-1])
    return rising - falling


def test_hysteresis_is_a_loop_of_its_width_in_a_slow_triangle():
    lag_v = loop_width_v(rig("ideal", STEP_S))
    assert lag_v == pytest.approx(0.0, abs=0.1)
    assert loop_width_v(rig("relief_hysteresis", STEP_S)) - lag_v == pytest.approx(1.0, rel=0.1)
    assert loop_width_v(rig("paper", STEP_S)) - lag_v == pytest.approx(0.44, rel=0.1)


def test_the_loop_is_wider_at_mid_range():
    """Loops of equal swing at different levels differ: no parallel shift of one branch makes them."""
    worn = rig("relief_hysteresis", STEP_S, relief_valve={"hysteresis": {"half_width_v": 0.2, "end_share": 0.8}})

    def height(middle_v):
        levels = []
        for start in (middle_v - 1.0, middle_v + 1.0):
            voltage = np.concatenate([np.full(100, start), np.full(100, middle_v)])
            levels.append(worn.truth(worn.after(voltage, np.zeros(200))).load_pressure_pa)
        return levels[1] - levels[0]

    assert height(2.5) > 1.3 * height(1.0)


def through(rig, *voltages_v):
    """Pressure after each of some voltages, each held for 2 s, in Pa."""
    state, pressures = rig.initial_state(), []
    for voltage in voltages_v:
        state = rig.after(np.full(100, voltage), np.zeros(100), state)
        pressures.append(rig.truth(state).load_pressure_pa)
    return pressures


def test_hysteresis_remembers_small_reversals():
    base, back, on = through(rig("relief_hysteresis", STEP_S), 3.0, 2.8, 3.2)
    assert on - base > 3 * (base - back)


def test_a_closed_small_loop_is_wiped_out():
    pressures = through(rig("relief_hysteresis", STEP_S), 4.5, 0.5, 3.0, 2.2, 3.0, 2.0, 3.0, 4.5)
    assert pressures[4] == pytest.approx(pressures[2], abs=2e3)
    assert pressures[6] == pytest.approx(pressures[2], abs=2e3)
    assert pressures[7] == pytest.approx(pressures[0], abs=2e3)


def test_a_full_stroke_leaves_remanence():
    start, _, end = through(rig("relief_hysteresis", STEP_S), 0.0, 5.0, 0.0)
    assert end - start > 0.2e6


def test_hysteresis_does_not_depend_on_speed():
    worn = rig("relief_hysteresis", STEP_S)
    slow = worn.truth(worn.after(np.linspace(0, 3, 800), np.zeros(800)))
    fast = worn.truth(worn.after(np.concatenate([np.linspace(0, 3, 50), np.full(750, 3.0)]), np.zeros(800)))
    assert slow.load_pressure_pa == pytest.approx(fast.load_pressure_pa, abs=5e4)


def test_dead_zone_of_the_relief_valve():
    spring = rig("relief_dead_zone", STEP_S)
    pressure = [spring.truth(settled(spring, v)).load_pressure_pa for v in (0.9, 1.5, 2.0)]
    assert pressure == pytest.approx([1.0e6, 1.0e6 + 0.5 * 0.9923e6, 1.0e6 + 0.9923e6], abs=5e4)


def test_saturation_of_the_load_amplifier():
    weak = rig("relief_saturation", STEP_S)
    pressure = [weak.truth(settled(weak, v)).load_pressure_pa for v in (3.5, 4.0, 5.0)]
    assert pressure[1:] == pytest.approx([pressure[0]] * 2, abs=2e3)


def test_delay_shifts_the_pressure_and_nothing_else():
    voltage = np.where(np.arange(400) < 100, 1.0, 3.0)
    near, far = (
        drive(VirtualRig(noiseless(load_rig(name)), 0.001), voltage, 0.0).signals["pressure_pa"]
        for name in ("linear", "relief_delay")
    )
    extra = round((0.06 - load_rig("ideal").relief_valve.delay_s) / 0.001)
    assert far[extra:] == pytest.approx(near[:-extra], abs=3e3)


@pytest.mark.parametrize("delay_s", [0.0, 0.0173, 0.02, 0.05])
def test_delay_need_not_be_a_multiple_of_the_sample(delay_s):
    voltage = np.where(np.arange(20) < 5, 1.0, 3.0)
    coarse = drive(rig("ideal", STEP_S, relief_valve={"delay_s": delay_s}), voltage, 0.0).signals["pressure_pa"]
    fine = drive(rig("ideal", 0.001, relief_valve={"delay_s": delay_s}), voltage.repeat(20), 0.0)
    assert coarse == pytest.approx(fine.signals["pressure_pa"][::20], abs=5e3)


def share_standing(rig, amplitude_v, frequency_hz=0.5):
    """Share of the time around reversals in which the axis hardly moves."""
    t = np.arange(round(4 / STEP_S)) * STEP_S
    run = drive(rig, 2.0, amplitude_v * np.sin(2 * np.pi * frequency_hz * t), settled(rig, 2.0))
    speed = np.abs(np.gradient(run.signals["position_m"], STEP_S))
    return float(np.mean(speed < 0.03 * speed.max()))


def test_overlap_is_a_dead_zone_of_the_servo_valve():
    assert share_standing(rig("ideal", STEP_S), 1.0) < 0.05
    assert share_standing(rig("valve_overlap", STEP_S), 1.0) == pytest.approx(2 / np.pi * np.arcsin(0.4), abs=0.06)
    lapped = rig("valve_overlap", STEP_S)
    run = drive(lapped, 2.0, np.full(100, 0.3), settled(lapped, 2.0))
    assert np.ptp(run.signals["position_m"]) < 5e-4


def test_friction_sticks_at_reversal():
    assert share_standing(rig("ideal", STEP_S), 0.5) < 0.05
    assert share_standing(rig("seal_friction", STEP_S), 0.5) > 0.1


def test_friction_turns_with_the_motion():
    """The force between the cylinders jumps by twice the Coulomb friction from one direction to the other."""

    def taken(name, servo_v):
        tried = rig(name, STEP_S)
        truth = tried.truth(tried.after(np.full(60, 2.0), np.full(60, servo_v), settled(tried, 2.0)))
        a1, a2 = tried.config.tested_cylinder, tried.config.load_cylinder
        cap, rod, push = (np.pi / 4 * d**2 for d in (a1.piston_diameter_m, a1.rod_diameter_m, a2.piston_diameter_m))
        return push * truth.load_pressure_pa - cap * truth.cap_pressure_pa + (cap - rod) * truth.rod_pressure_pa

    jump = {name: taken(name, 0.5) - taken(name, -0.5) for name in ("ideal", "seal_friction")}
    assert jump["seal_friction"] - jump["ideal"] == pytest.approx(2 * 2500, rel=0.1)


def test_leakage_lets_the_load_push_the_axis():
    def drift(name):
        tried = rig(name, STEP_S)
        run = drive(tried, 4.0, np.zeros(200), settled(tried, 4.0))
        return (run.signals["position_m"][-1] - run.signals["position_m"][0]) / run.time_s[-1]

    assert drift("piston_leakage") - drift("ideal") > 1e-4


def test_the_same_seed_gives_the_same_noise_and_another_another():
    still = np.zeros(100)
    first, again = (drive(rig("paper", STEP_S, seed=4), still, 0.0) for _ in range(2))
    other = drive(rig("paper", STEP_S, seed=5), still, 0.0)
    for name in ("pressure_pa", "position_m"):
        assert np.array_equal(first.signals[name], again.signals[name])
        assert not np.array_equal(first.signals[name], other.signals[name])


def test_noise_has_its_size():
    noisy = drive(rig("ideal", STEP_S, pressure_sensor={"noise_rms": 5e3}), np.zeros(2000), 0.0).signals["pressure_pa"]
    assert noisy.std() == pytest.approx(5e3, rel=0.05)
    assert noisy.mean() == pytest.approx(1e6, abs=500)


def test_readings_lie_on_the_converters_grid():
    run = drive(rig("coarse_card", STEP_S), np.linspace(0, 4, 200), np.full(200, 0.3))
    for name, low, high in (("pressure_pa", 0, 16e6), ("position_m", -0.27, 0.27), ("load_voltage_v", 0, 5)):
        codes = (run.signals[name] - low) / ((high - low) / 1024)
        assert codes == pytest.approx(np.round(codes), abs=1e-6)
        assert len(set(np.round(codes))) > 10


def test_hysteresis_dominates_what_the_papers_model_misses_in_the_demo():
    """Square load through the published PI: what equation (1) misses is mostly hysteresis, before and after a refit."""
    model = signal.cont2discrete(
        ([295.1, -2.944e4, 7.457e6, -1.267e8, 3.217e10], [1, 159.3, 1.962e4, 1.479e6, 7.247e7, 2.244e9, 3.242e10]),
        STEP_S,
    )

    def missed(**parts):
        tried = rig("paper", STEP_S, **parts)
        state, voltage, before, rows = tried.initial_state(), 0.0, 0.0, []
        for k in range(600):
            wanted = 4.5e6 if k % 200 < 100 else 1.5e6
            pressure, _, _ = tried.read(state)
            error = (wanted - pressure) / 1e6
            voltage, before = min(max(voltage + 0.2861 * error - 0.1595 * before, 0.0), 5.0), error
            state, out = tried.step(state, RigInput(voltage, 0.0))
            rows.append((out.load_voltage_v, out.pressure_pa / 1e6))
        given, measured = np.array(rows).T
        simulated = 1.0 + signal.lfilter(model[0].ravel(), model[1], given)
        basis = np.column_stack([simulated, np.ones_like(simulated)])
        refitted = basis @ np.linalg.lstsq(basis, measured, rcond=None)[0]
        return np.sqrt(np.mean((measured - simulated) ** 2)), np.sqrt(np.mean((measured - refitted) ** 2))

    (gap, gap_refitted), (rest, rest_refitted) = missed(), missed(relief_valve={"hysteresis": None})
    assert gap > 4 * rest
    assert gap_refitted > 3 * rest_refitted
