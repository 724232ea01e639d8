"""What must hold whatever the calibration: oil, energy, rest, step against run, fine against coarse sub-steps."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dt_station_nodes.core.samples import SampleFlag
from dt_station_nodes.hardware.virtual import RigError, RigInput, RigState, VirtualRig, kernel, load_rig
from support.rigs import changed, drive, rig, settled

SHUT = {"overlap_v": 5.0, "rounding_v": 1e-4, "null_shift_v_pa": 0.0}


def oil(rig: VirtualRig, state: RigState) -> np.ndarray:
    """Oil in A1's two chambers as volume at atmospheric pressure, m^3 (the integral of 1 / bulk modulus)."""
    p, s = rig._parameters, state.values
    pressures = s[[kernel.CAP, kernel.ROD]]
    volumes = np.array(
        [
            p[kernel.V1_CAP] + p[kernel.A1_CAP] * (p[kernel.HALF_STROKE] - s[kernel.X]),
            p[kernel.V1_ROD] + p[kernel.A1_ROD] * (p[kernel.HALF_STROKE] + s[kernel.X]),
        ]
    )
    air = kernel.ATMOSPHERE_PA * p[kernel.AIR] / (pressures + kernel.ATMOSPHERE_PA)
    return volumes * np.exp(pressures / p[kernel.BULK] - air)


def test_oil_shut_in_stays_shut_in():
    shut = rig("paper", 0.02, servo_valve=SHUT)
    start = shut.initial_state()
    end = shut.after(np.tile([0.0, 5.0], 40).repeat(5), np.zeros(400), start)
    loaded = shut.after(np.full(60, 5.0), np.zeros(60), start)
    assert shut.truth(loaded).position_m > 5e-5
    assert oil(shut, end) == pytest.approx(oil(shut, start), rel=2e-5)
    assert oil(shut, loaded) == pytest.approx(oil(shut, start), rel=2e-5)


def test_moving_pistons_displace_what_flows():
    moving = rig("ideal", 0.02)
    state = moving.after(np.full(60, 2.0), np.full(60, 0.5), settled(moving, 2.0))
    truth, p = moving.truth(state), moving._parameters
    into_cap, into_rod = kernel.servo_flows(
        p,
        truth.spool_v + p[kernel.NULL] - p[kernel.NULL_SHIFT] * (truth.load_pressure_pa - p[kernel.REST]),
        truth.cap_pressure_pa,
        truth.rod_pressure_pa,
    )
    assert truth.velocity_m_s > 0.03
    assert into_cap == pytest.approx(-p[kernel.A1_CAP] * truth.velocity_m_s, rel=0.01)
    assert into_rod == pytest.approx(p[kernel.A1_ROD] * truth.velocity_m_s, rel=0.01)


def test_a_push_dies_away_where_nothing_is_fed_in():
    shut = rig("paper", 0.02, servo_valve=SHUT)
    rest = shut.initial_state()
    values = rest.values.copy()
    values[kernel.V] = 0.2
    state, speeds = RigState(values), []
    for _ in range(100):
        state, _ = shut.step(state, RigInput(0.0, 0.0))
        speeds.append(abs(shut.truth(state).velocity_m_s))
    assert speeds[-1] < 1e-5
    assert shut.truth(state).position_m == pytest.approx(shut.truth(rest).position_m, abs=1e-4)


@pytest.mark.parametrize("name", ["paper", "ideal", "seal_friction", "valve_overlap", "piston_leakage"])
def test_no_drift_at_rest(name):
    resting = rig(name, 0.02)
    end = resting.after(np.zeros(1000), np.zeros(1000))
    before, after = resting.truth(resting.initial_state()), resting.truth(end)
    assert after.position_m == pytest.approx(before.position_m, abs=2e-6)
    assert after.load_pressure_pa == pytest.approx(1.0e6, abs=100.0)


def test_rest_stays_rest_at_either_end_of_the_stroke():
    for start in (-0.26, 0.26):
        resting = rig("ideal", 0.02, axis={"start_position_m": start})
        end = resting.truth(resting.after(np.zeros(200), np.zeros(200)))
        assert end.position_m == pytest.approx(start, abs=1e-5)


@pytest.mark.parametrize("servo_v", [10.0, -10.0])
def test_the_stroke_ends_the_motion(servo_v):
    rammed = rig("paper", 0.02)
    truth = rammed.truth(rammed.after(np.full(150, 2.0), np.full(150, servo_v)))
    assert abs(truth.position_m) == pytest.approx(0.27, abs=1e-3)
    assert abs(truth.velocity_m_s) < 1e-3


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_any_voltages_leave_it_finite_and_within_the_supplies(seed):
    rng = np.random.default_rng(seed)
    wild = rig("paper", 0.02)
    state = wild.after(rng.uniform(-1, 6, 100), rng.choice([-12.0, -3.0, 0.0, 3.0, 12.0], 100))
    truth = wild.truth(state)
    assert np.isfinite(state.values).all()
    assert -kernel.ATMOSPHERE_PA <= truth.load_pressure_pa < 40e6
    assert -kernel.ATMOSPHERE_PA <= truth.cap_pressure_pa < 60e6


@pytest.mark.parametrize("name", ["paper", "ideal"])
def test_half_the_substep_gives_the_same_run(name):
    rng = np.random.default_rng(3)
    load, servo = rng.uniform(0, 5, 20).repeat(15), rng.uniform(-1, 1, 30).repeat(10)
    exact = {"pressure_sensor": {"noise_rms": 0.0, "bits": 0}, "position_sensor": {"noise_rms": 0.0, "bits": 0}}
    coarse = drive(rig(name, 0.02, **exact), load, servo)
    fine = drive(VirtualRig(changed(load_rig(name), longest_substep_s=5e-6, **exact), 0.02), load, servo)
    for signal, tolerance in (("pressure_pa", 2e-3), ("position_m", 2e-3)):
        span = np.ptp(fine.signals[signal])
        assert coarse.signals[signal] == pytest.approx(fine.signals[signal], abs=tolerance * span)


def test_sample_time_changes_what_is_seen_not_what_happens():
    load = np.where(np.arange(200) < 100, 1.0, 3.0)
    slow = drive(rig("ideal", 0.02), load, 0.0)
    fast = drive(rig("ideal", 0.002), load.repeat(10), 0.0)
    assert fast.signals["pressure_pa"][::10] == pytest.approx(slow.signals["pressure_pa"], abs=2e3)


def test_runs_are_steps_and_steps_leave_their_state_alone():
    stepped, load, servo = rig("paper", 0.02), np.linspace(0, 4, 50), np.linspace(-1, 1, 50)
    run, state = drive(stepped, load, servo), stepped.initial_state()
    for k in range(50):
        kept = state.values.copy()
        following, out = stepped.step(state, RigInput(load[k], servo[k]))
        again, same = stepped.step(state, RigInput(load[k], servo[k]))
        assert out == same
        assert np.array_equal(following.values, again.values)
        assert np.array_equal(kept, state.values)
        assert (out.pressure_pa, out.position_m) == (run.signals["pressure_pa"][k], run.signals["position_m"][k])
        state = following


def test_a_velocity_pushes_the_relief_valve_open():
    rig_20ms = rig("ideal", 0.02)
    standing = rig_20ms.truth(settled(rig_20ms, 2.0)).load_pressure_pa
    pressed = rig_20ms.truth(rig_20ms.after(np.full(40, 2.0), np.full(40, -1.0), settled(rig_20ms, 2.0)))
    assert pressed.load_pressure_pa > standing + 2e4


def test_flags_tell_what_the_card_cut():
    cut = rig("paper", 0.02)
    _, out = cut.step(cut.initial_state(), RigInput(7.0, -11.0))
    assert out.flags == SampleFlag.LOAD_VOLTAGE_LIMITED | SampleFlag.SERVO_VOLTAGE_LIMITED
    assert (out.load_voltage_v, out.servo_voltage_v) == (pytest.approx(5.0, abs=1e-4), pytest.approx(-10.0))


def test_voltages_must_be_numbers():
    rig_20ms = rig("paper", 0.02)
    with pytest.raises(RigError, match="finite"):
        rig_20ms.step(rig_20ms.initial_state(), RigInput(float("nan"), 0.0))


@pytest.mark.parametrize("sample_time_s", [0.0, -1.0, float("nan")])
def test_sample_time_must_be_positive(sample_time_s):
    with pytest.raises(RigError, match="sample time"):
        rig("paper", sample_time_s)
