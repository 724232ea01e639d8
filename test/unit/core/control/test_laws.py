"""PI and PID against the paper's difference equations, bit for bit, and against python-control."""

import control
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dt_station_nodes.core.control import ControlInput, LoopConfig, LoopController
from dt_station_nodes.core.samples import ControlMode

SAMPLE_TIME_S = 0.02
numbers = st.floats(-10.0, 10.0)
errors = st.lists(st.floats(-5e6, 5e6), min_size=1, max_size=60)


def pi(**extras) -> LoopConfig:
    settings = {"gain": 0.2861, "integral_time_s": 0.0452, "error_scale": 1e-6}
    limits = extras.pop("limits", {})
    return LoopConfig.model_validate({"mode": "pi", "limits": limits, "pi": {**settings, **extras}})


def pid(**extras) -> LoopConfig:
    settings = {"p": 7.1545, "i": -0.0047, "d": 0.1473, "error_scale": 100.0}
    limits = extras.pop("limits", {})
    return LoopConfig.model_validate({"mode": "pid", "limits": limits, "pid": {**settings, **extras}})


def play(config: LoopConfig, setpoints, measurements=None) -> np.ndarray:
    controller = LoopController(config, SAMPLE_TIME_S)
    state = controller.initial_state()
    voltages = []
    for k, setpoint in enumerate(setpoints):
        state, out = controller.step(
            state, ControlInput(setpoint, measurements[k] if measurements is not None else 0.0)
        )
        voltages.append(out.voltage_v)
    return np.array(voltages)


@given(errors, st.floats(0.01, 10.0), st.floats(0.01, 10.0))
def test_pi_is_the_difference_equation_bit_for_bit(setpoints, gain, integral_time_s) -> None:
    a, b = gain, gain - gain * SAMPLE_TIME_S / integral_time_s
    before, voltage, expected = 0.0, 0.0, []
    for setpoint in setpoints:
        x = (setpoint - 0.0) * 1e-6
        voltage = a * x - b * before + voltage
        before = x
        expected.append(voltage)
    got = play(pi(gain=gain, integral_time_s=integral_time_s), setpoints)
    assert got.tolist() == expected


@given(st.lists(st.floats(-0.3, 0.3), min_size=1, max_size=60), numbers, numbers, numbers)
def test_pid_is_the_paper_s_formula_bit_for_bit(setpoints, p, i, d) -> None:
    integral, before, expected = 0.0, 0.0, []
    for setpoint in setpoints:
        x = (setpoint - 0.0) * 100.0
        expected.append(p * x + integral + d / SAMPLE_TIME_S * (x - before))
        integral += i * SAMPLE_TIME_S * x
        before = x
    assert play(pid(p=p, i=i, d=d), setpoints).tolist() == expected


def test_laws_are_their_z_transforms() -> None:
    rng = np.random.default_rng(1)
    x = rng.normal(size=200)
    z = control.tf([1, 0], [1], SAMPLE_TIME_S)
    form7 = 7.1545 - 0.0047 * SAMPLE_TIME_S / (z - 1) + 0.1473 / SAMPLE_TIME_S * (z - 1) / z
    _, want = control.forced_response(form7, inputs=x)
    np.testing.assert_allclose(play(pid(), x / 100.0), want, rtol=1e-9, atol=1e-9)
    a, b = 0.2861, 0.2861 - 0.2861 * 0.02 / 0.0452
    _, want = control.forced_response(control.tf([a, -b], [1, -1], SAMPLE_TIME_S), inputs=x)
    np.testing.assert_allclose(play(pi(), x * 1e6), want, rtol=1e-9, atol=1e-9)


def test_derivative_filter_is_a_lag_and_leaves_the_settled_voltage_alone() -> None:
    filtered = play(pid(i=0.0, derivative_filter_s=0.1), [0.01] * 200)
    ratio = np.diff(filtered[1:60])[1:] / np.diff(filtered[1:60])[:-1]
    np.testing.assert_allclose(ratio, 0.1 / 0.12, rtol=1e-6)
    assert filtered[-1] == pytest.approx(7.1545, rel=1e-9)
    assert filtered[0] < play(pid(i=0.0), [0.01])[0]


@pytest.mark.parametrize("make", [pi, pid])
def test_setpoint_weight_spares_the_jump_but_not_the_measurement(make) -> None:
    extras = {"setpoint_weight": 0.0}
    if make is pid:
        extras["derivative_setpoint_weight"] = 0.0
    weighted, plain = make(**extras), make()
    assert play(weighted, [1.0])[0] == pytest.approx(0.0, abs=1e-12)
    rng = np.random.default_rng(2)
    y = rng.normal(size=50)
    np.testing.assert_allclose(play(weighted, np.zeros(50), y), play(plain, np.zeros(50), y), atol=1e-9)


def test_setpoint_weight_changes_nothing_once_settled() -> None:
    # A closed PI loop over a lag ends where it must whatever the weight.
    for weight in (0.0, 0.3, 1.0):
        controller = LoopController(pi(setpoint_weight=weight), SAMPLE_TIME_S)
        state, y = controller.initial_state(), 0.0
        for _ in range(2000):
            state, out = controller.step(state, ControlInput(2e6, y))
            y += 0.1 * (1e6 * out.voltage_v - y)
        assert y == pytest.approx(2e6, rel=1e-9)


def windup(anti_windup: str, make, lag: float = 0.05) -> tuple[float, float]:
    """Overshoot and samples spent beyond 2 % after a saturated step of a lagging plant."""
    config = make(anti_windup=anti_windup, limits={"lower_v": -1.0, "upper_v": 1.0})
    controller = LoopController(config, SAMPLE_TIME_S)
    state, y, ys = controller.initial_state(), 0.0, []
    for k in range(3000):
        target = 0.95 if k >= 1000 else 5.0  # asks the impossible first
        state, out = controller.step(state, ControlInput(target, y))
        y += lag * (out.voltage_v - y)
        ys.append(y)
    late = np.array(ys[1000:])
    return float(late.max() - 0.95), int(np.flatnonzero(np.abs(late - 0.95) > 0.02).max() + 1)


def slow_pi(**extras) -> LoopConfig:
    return pi(gain=2.0, integral_time_s=0.5, error_scale=1.0, **extras)


def slow_pid(**extras) -> LoopConfig:
    return pid(p=2.0, i=4.0, d=0.0, error_scale=1.0, **extras)


@pytest.mark.parametrize("make", [slow_pi, slow_pid])
def test_anti_windup_comes_back_at_once_where_none_takes_long(make) -> None:
    _, long = windup("none", make)
    for kind in ("back_calculation", "clamping"):
        overshoot, samples = windup(kind, make)
        assert samples < long / 3
        assert overshoot < 0.06


@pytest.mark.parametrize("make", [slow_pi, slow_pid])
def test_clamping_stops_the_integral_in_the_limit(make) -> None:
    config = make(anti_windup="clamping", limits={"lower_v": -1.0, "upper_v": 1.0})
    controller = LoopController(config, SAMPLE_TIME_S)
    state = controller.initial_state()
    memories = []
    for _ in range(50):
        state, out = controller.step(state, ControlInput(5.0, 0.0))
        assert out.limited
        memories.append(state.memory.voltage_v if make is slow_pi else state.memory.integral_v)
    assert np.ptp(memories[1:]) == pytest.approx(0.0, abs=1e-12)


@given(
    st.lists(st.floats(-1e8, 1e8), min_size=1, max_size=80), st.sampled_from(["none", "back_calculation", "clamping"])
)
def test_limits_hold_for_value_and_rate(setpoints, anti_windup) -> None:
    config = pi(anti_windup=anti_windup, limits={"lower_v": -1.0, "upper_v": 4.0, "rate_v_per_s": 20.0})
    got = np.concatenate([[0.0], play(config, setpoints)])
    assert got.min() >= -1.0
    assert got.max() <= 4.0
    assert np.abs(np.diff(got)).max() <= 20.0 * SAMPLE_TIME_S + 1e-12


def test_limited_says_so_exactly_when_a_limit_bites() -> None:
    controller = LoopController(pid(i=0.0, d=0.0, limits={"lower_v": -2.0, "upper_v": 2.0}), SAMPLE_TIME_S)
    state = controller.initial_state()
    for error, limited in ((0.001, False), (0.01, True), (-0.01, True), (0.0, False)):
        state, out = controller.step(state, ControlInput(error, 0.0))
        assert out.limited is limited
        assert out.mode is ControlMode.PID


def test_reset_forgets_everything() -> None:
    controller = LoopController(pi(), SAMPLE_TIME_S)
    state = controller.initial_state()
    for _ in range(10):
        state, _ = controller.step(state, ControlInput(1e6, 0.0))
    assert state != controller.initial_state()
    first = controller.step(controller.initial_state(), ControlInput(1e6, 0.0))
    assert first == LoopController(pi(), SAMPLE_TIME_S).step(controller.initial_state(), ControlInput(1e6, 0.0))


def test_a_value_that_is_no_number_holds_the_voltage_and_is_told() -> None:
    controller = LoopController(pi(), SAMPLE_TIME_S)
    state, before = controller.step(controller.initial_state(), ControlInput(1e6, 0.0))
    after, out = controller.step(state, ControlInput(1e6, float("nan")))
    assert out.voltage_v == before.voltage_v
    assert out.limited
    assert after == state
