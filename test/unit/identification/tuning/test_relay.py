"""Ziegler-Nichols from the model, and the relay that finds the same by experiment, within limits."""

import control
import numpy as np
import pytest

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.closed_loop import ModelPlant
from dt_station_nodes.core.control import LoopController
from dt_station_nodes.core.models import PlantModel
from dt_station_nodes.core.samples import ControlMode
from dt_station_nodes.identification import tuning
from support.controllers import controller, paper_model

SAMPLE_TIME_S = 0.02
MODEL = paper_model()
SCALE = {Channel.PRESSURE: 1e-6, Channel.POSITION: 100.0}
OTHER = {Channel.PRESSURE: ("position_pid", 0.0), Channel.POSITION: ("pressure_pi", 2.5e6)}


def experiment(channel: Channel, sample_time_s: float = SAMPLE_TIME_S, **changes) -> tuning.RelayExperiment:
    usual = tuning.usual_relay(MODEL, channel)
    config = tuning.RelayConfig.model_validate({**usual.model_dump(), **changes})
    name, setpoint = OTHER[channel]
    tuner = tuning.RelayTuner(config, sample_time_s)
    other = LoopController(controller(name), sample_time_s)
    return tuning.RelayExperiment(channel, tuner, config.setpoint, other, setpoint)


def run(relay: tuning.RelayExperiment, sample_time_s: float = SAMPLE_TIME_S):
    return tuning.run_relay(ModelPlant(PlantModel(MODEL, sample_time_s)), relay).relay


@pytest.mark.parametrize("channel", list(Channel))
def test_the_ultimate_gain_is_on_the_verge(channel) -> None:
    point = tuning.ultimate_point(MODEL, channel, SAMPLE_TIME_S, SCALE[channel])
    path = tuning.sampled_path(MODEL, channel, SAMPLE_TIME_S)
    poles = control.feedback(path * point.gain, 1).poles()
    worst = poles[np.argmax(abs(poles))]
    assert abs(worst) == pytest.approx(1.0, abs=1e-4)
    assert 2 * np.pi / (abs(np.angle(worst)) / SAMPLE_TIME_S) == pytest.approx(point.period_s, rel=1e-3)


def test_a_path_that_never_oscillates_is_told_so() -> None:
    with pytest.raises(tuning.TuningError, match="never oscillates"):
        tuning.ultimate_point(MODEL, Channel.POSITION, None, 100.0)


def test_ziegler_and_nichols_rules() -> None:
    point = tuning.UltimatePoint(2.0, 0.6)
    pi = tuning.settings(point, ControlMode.PI, 1.0)
    assert (pi.gain, pi.integral_time_s) == pytest.approx((0.9, 0.5))
    pid = tuning.settings(point, ControlMode.PID, 1.0)
    assert (pid.p, pid.p / pid.i, pid.d / pid.p) == pytest.approx((1.2, 0.3, 0.075))
    with pytest.raises(tuning.TuningError, match="rules for pi and pid"):
        tuning.settings(point, ControlMode.FUZZY, 1.0)


def test_tuned_loop_keeps_limits_and_anti_windup_and_is_stable() -> None:
    base = controller("pressure_pi")
    point = tuning.ultimate_point(MODEL, Channel.PRESSURE, SAMPLE_TIME_S, 1e-6)
    tuned = tuning.tuned(base, point, ControlMode.PI, 1e-6)
    assert tuned.limits == base.limits
    assert tuned.pi.anti_windup is base.pi.anti_windup
    assert tuning.stability(MODEL, Channel.PRESSURE, tuned, SAMPLE_TIME_S).stable


def test_relay_finds_the_ultimate_point_of_the_model() -> None:
    relay = experiment(Channel.PRESSURE)
    state = run(relay)
    assert state.outcome is tuning.RelayOutcome.DONE
    found = relay.tuner.result(state, 1e-6)
    true = tuning.ultimate_point(MODEL, Channel.PRESSURE, SAMPLE_TIME_S, 1e-6)
    # A describing function sees only the first harmonic, and a switch comes up to a sample late.
    assert found.gain == pytest.approx(true.gain, rel=0.15)
    assert found.period_s == pytest.approx(true.period_s, abs=SAMPLE_TIME_S)


def test_relay_comes_nearer_with_finer_samples() -> None:
    relay = experiment(Channel.PRESSURE, 0.002, hysteresis=2.0e3)
    found = relay.tuner.result(run(relay, 0.002), 1e-6)
    true = tuning.ultimate_point(MODEL, Channel.PRESSURE, 0.002, 1e-6)
    assert found.gain == pytest.approx(true.gain, rel=0.1)
    assert found.period_s == pytest.approx(true.period_s, rel=0.05)


@pytest.mark.parametrize("channel", list(Channel))
def test_relay_never_asks_for_more_than_its_amplitude(channel) -> None:
    relay = experiment(channel)
    plant = ModelPlant(PlantModel(MODEL, SAMPLE_TIME_S))
    usual = tuning.usual_relay(MODEL, channel)
    state = relay.initial_state()
    while not relay.finished(state):
        seen = plant.read()
        state, output = relay.step(state, seen.pressure_pa, seen.position_m)
        assert abs(output.voltage_v[channel] - usual.bias_v) <= usual.amplitude_v + 1e-12
        plant.write(output.voltage_v[Channel.PRESSURE], output.voltage_v[Channel.POSITION])
    _, after = relay.step(state, 0.0, 0.0)
    assert after.voltage_v[channel] == usual.bias_v


def test_leaving_the_limits_ends_it_at_the_bias() -> None:
    relay = experiment(Channel.PRESSURE, amplitude_v=2.0, highest=2.6e6)
    state = run(relay)
    assert state.outcome is tuning.RelayOutcome.OUT_OF_LIMITS
    with pytest.raises(tuning.TuningError, match="left the limits"):
        relay.tuner.result(state, 1e-6)


def test_a_dead_sensor_counts_as_out_of_limits() -> None:
    tuner = tuning.RelayTuner(tuning.usual_relay(MODEL, Channel.POSITION), SAMPLE_TIME_S)
    state, voltage = tuner.step(tuner.initial_state(), float("nan"))
    assert state.outcome is tuning.RelayOutcome.OUT_OF_LIMITS
    assert voltage == 0.0


def test_no_limit_cycle_ends_in_time() -> None:
    relay = experiment(Channel.PRESSURE, bias_v=0.0, amplitude_v=0.1, timeout_s=5.0)
    state = run(relay)
    assert state.outcome is tuning.RelayOutcome.TIMED_OUT
    with pytest.raises(tuning.TuningError, match="no steady limit cycle"):
        relay.tuner.result(state, 1e-6)


def test_a_set_point_outside_the_limits_is_refused() -> None:
    with pytest.raises(ValueError, match="between lowest and highest"):
        experiment(Channel.PRESSURE, lowest=3.0e6)
