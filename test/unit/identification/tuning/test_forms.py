"""Table 1 of the paper to all printed digits, and the discrete forms against the controllers themselves."""

import control
import numpy as np
import pytest

from dt_station_nodes.core.control import ControlInput, LoopController, PiConfig
from dt_station_nodes.identification import tuning
from support.controllers import controller

SAMPLE_TIME_S = 0.02
TABLE_1 = {
    "pressure_pi_zn": ("(0.459 s + 3.456)/s", "(0.459 z - 0.3899)/(z - 1)"),
    "pressure_pi": ("(0.2861 s + 6.33)/s", "(0.2861 z - 0.1595)/(z - 1)"),
}


@pytest.mark.parametrize("name", TABLE_1)
def test_table_1_to_all_printed_digits(name) -> None:
    assert tuning.texts(controller(name), SAMPLE_TIME_S) == TABLE_1[name]


@pytest.mark.parametrize(("name", "printed"), [("pressure_pi_zn", "0.3899"), ("pressure_pi", "0.1595")])
@pytest.mark.parametrize("method", ["tustin", "backward_diff"])
def test_no_other_discretisation_prints_table_1(name, printed, method) -> None:
    kr, ki = tuning.continuous_pi(controller(name).pi)
    sampled = control.c2d(control.tf([kr, ki], [1, 0]), SAMPLE_TIME_S, method)
    a, minus_b = sampled.num[0][0] / sampled.den[0][0][0]
    assert (tuning.printed(a), tuning.printed(-minus_b)) != (tuning.printed(kr), printed)


def test_zero_order_hold_is_the_difference_form_of_the_controller() -> None:
    config = PiConfig(gain=1.7, integral_time_s=0.31, error_scale=1.0)
    for sample_time_s in (0.001, 0.02, 0.1):
        assert tuning.discrete_pi(config, sample_time_s) == pytest.approx(config.coefficients(sample_time_s), rel=1e-12)


@pytest.mark.parametrize(
    "name", ["pressure_pi", "position_pid", "position_pid_tuned", "position_fuzzy", "position_fuzzy_integral"]
)
def test_linear_form_is_what_the_controller_does_with_small_errors(name) -> None:
    config = controller(name).changed(limits={})
    rng = np.random.default_rng(3)
    error = 0.01 * rng.uniform(-1.0, 1.0, 60)  # error units; within the surface's innermost cells
    load = 1.0e6
    slope = None
    if config.fuzzy is not None:
        table = tuning.fuzzy_slopes(config.fuzzy)
        slope = table[0]  # slight load
    error[0] = 0.0
    _, want = control.forced_response(tuning.linear(config, SAMPLE_TIME_S, slope), inputs=error)
    loop = LoopController(config, SAMPLE_TIME_S)
    state, got = loop.initial_state(), []
    for value in error / tuning.error_scale(config):
        state, out = loop.step(state, ControlInput(value, 0.0, load))
        got.append(out.voltage_v)
    np.testing.assert_allclose(got, want, rtol=1e-6, atol=1e-9)


def test_manual_mode_has_no_form() -> None:
    config = controller("pressure_pi").changed(mode="manual")
    for ask in (tuning.texts, tuning.linear):
        with pytest.raises(tuning.TuningError, match="manual mode"):
            ask(config, SAMPLE_TIME_S)
