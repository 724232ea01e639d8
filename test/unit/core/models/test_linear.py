"""Linear paths against python-control, and what gain, time scale and injection mean."""

import control
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dt_station_nodes.core.models import TransferFunction
from dt_station_nodes.core.models.linear import coefficients, discretise

PRESSURE = TransferFunction(
    numerator=[295.1, -2.944e4, 7.457e6, -1.267e8, 3.217e10],
    denominator=[1, 159.3, 1.962e4, 1.479e6, 7.247e7, 2.244e9, 3.242e10],
)
POSITION = TransferFunction(numerator=[206.4], denominator=[1, 23.34, 0])


def step_answer(transfer: TransferFunction, step_s: float, n: int) -> np.ndarray:
    path = discretise(transfer, 1.0, step_s)
    x = np.zeros(path.b.size)
    outputs = []
    for _ in range(n):
        outputs.append(path.c @ x + path.d)
        x = path.a @ x + path.b
    return np.array(outputs)


@pytest.mark.parametrize("step_s", [0.001, 0.02, 0.1])
@pytest.mark.parametrize("transfer", [PRESSURE, POSITION])
def test_zero_order_hold_agrees_with_python_control(transfer, step_s):
    system = control.tf(transfer.numerator, transfer.denominator)
    times = np.arange(60) * step_s
    theirs = control.forced_response(system, times, np.ones(60)).outputs
    ours = step_answer(transfer, step_s, 60)
    # theirs is in an unscaled companion form: its own error is what limits the agreement
    assert np.abs(ours - theirs).max() < 1e-6 * np.abs(theirs).max()


def test_two_half_steps_are_one_step():
    whole, half = discretise(PRESSURE, 1.0, 0.02), discretise(PRESSURE, 1.0, 0.01)
    assert np.allclose(half.a @ half.a, whole.a, atol=1e-12)
    assert np.allclose(half.a @ half.b + half.b, whole.b, atol=1e-12)


@settings(deadline=None)
@given(st.floats(0.5, 2.0), st.floats(0.2, 5.0))
def test_time_scale_keeps_static_and_integrator_gain(time_scale, gain):
    num, den = coefficients(PRESSURE.model_copy(update={"time_scale": time_scale, "gain": gain}))
    assert num[-1] / den[-1] == pytest.approx(gain * 3.217 / 3.242)
    num, den = coefficients(POSITION.model_copy(update={"time_scale": time_scale, "gain": gain}))
    assert num[-1] / den[-2] == pytest.approx(gain * 206.4 / 23.34)
    assert 1.0 / den[1] == pytest.approx(time_scale / 23.34)


@settings(deadline=None)
@given(st.floats(0.5, 2.0), st.floats(0.2, 5.0))
@pytest.mark.parametrize("transfer", [PRESSURE, POSITION])
def test_a_path_of_another_time_scale_is_one_of_other_coefficients(transfer, time_scale, gain):
    scaled = transfer.model_copy(update={"time_scale": time_scale, "gain": gain})
    num, den = coefficients(scaled)
    path, same = (
        discretise(scaled, 1e-2, 0.005),
        discretise(TransferFunction(numerator=num, denominator=den), 1e-2, 0.005),
    )
    for name in same.__slots__:
        mine, theirs = (np.asarray(getattr(p, name)) for p in (path, same))
        assert np.allclose(mine, theirs, rtol=1e-8, atol=1e-10 * np.abs(theirs).max(initial=0.0)), name


def test_the_settling_rate_is_one_over_the_sum_of_time_constants():
    two_lags = TransferFunction(numerator=[3.0], denominator=[0.02, 0.3, 1.0], time_scale=2.0)
    assert discretise(two_lags, 1.0, 0.01).settling_rate == pytest.approx(1.0 / 0.6)
    assert discretise(POSITION, 1.0, 0.01).settling_rate == 0.0


def test_velocity_reads_the_derivative():
    path = discretise(POSITION, 1.0, 1e-5)
    x = np.array([0.3, -0.2])
    after = path.a @ x + path.b * 2.0
    assert path.velocity @ x == pytest.approx(path.c @ (after - x) / 1e-5, rel=1e-2)


def test_injection_is_a_flow_into_the_integrator():
    path = discretise(POSITION, 1.0, 0.02)
    x = np.zeros(2)
    for k in range(5):
        assert path.c @ x == pytest.approx(0.02 * k * 3.0)
        x = path.a @ x + path.e * 3.0
