import numpy as np
import pytest

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import ModelSpec, PlantModel
from dt_station_nodes.core.run import Run
from dt_station_nodes.core.waveforms import Shape, Waveform, waveform_samples
from dt_station_nodes.identification import IdentificationError
from dt_station_nodes.identification.modelfile import characteristic_effects, with_characteristic
from dt_station_nodes.identification.static_characteristic import static_characteristic
from dt_station_nodes.identification.static_shape import magnetised, play

SPEC = ModelSpec.model_validate(
    {
        "name": "static",
        "paths": {
            "pressure": {"numerator": [20.0], "denominator": [1.0, 20.0], "scale": 1e6, "rest": 1e6},
            "position": {"numerator": [8.8 * 23.0], "denominator": [1.0, 23.0, 0.0], "scale": 0.01},
        },
    }
)
STEP_S = 0.02


def slow_run(spec, channel, triangle, samples=4000, noise=1.0):
    voltage = waveform_samples(triangle, STEP_S, samples)
    still = np.zeros(samples)
    volts = (voltage, still) if channel is Channel.PRESSURE else (still, voltage)
    simulated = PlantModel(spec, STEP_S).simulate(*volts)
    rng = np.random.default_rng(0)
    if channel is Channel.PRESSURE:
        return Run(
            STEP_S,
            {"load_voltage_v": voltage, "pressure_pa": simulated.pressure_pa + noise * 5e3 * rng.normal(size=samples)},
        )
    return Run(
        STEP_S,
        {"servo_voltage_v": voltage, "position_m": simulated.position_m + noise * 1e-5 * rng.normal(size=samples)},
    )


def test_all_three_features_of_the_pressure_path_are_read_off():
    spec = SPEC.with_effect(Channel.PRESSURE, "hysteresis", {"half_width_v": 0.15})
    spec = spec.with_effect(Channel.PRESSURE, "dead_zone", {"half_width_v": 0.4})
    spec = spec.with_effect(Channel.PRESSURE, "saturation", {"upper_v": 3.5, "lower_v": 0.0})
    run = slow_run(spec, Channel.PRESSURE, Waveform(Shape.TRIANGLE, 2.5, 2.5, 1.0 / 40.0))
    found = static_characteristic(run, Channel.PRESSURE, lag_s=0.05)
    assert found.gain.value == pytest.approx(1.0, rel=0.01)
    assert found.rest.value == pytest.approx(1.0, abs=0.01)
    assert found.hysteresis_half_width_v.value == pytest.approx(0.15, abs=0.01)
    assert found.dead_zone_half_width_v.value == pytest.approx(0.4, abs=0.02)
    assert found.saturation_upper_v.value == pytest.approx(3.5, abs=0.02)
    assert found.fit_percent > 98.0
    patched = with_characteristic(SPEC, found)
    assert [e.name for e in patched.paths[Channel.PRESSURE].effects] == ["hysteresis", "dead_zone", "saturation"]


def test_a_straight_path_shows_nothing():
    run = slow_run(SPEC, Channel.PRESSURE, Waveform(Shape.TRIANGLE, 2.5, 2.5, 1.0 / 40.0))
    found = static_characteristic(run, Channel.PRESSURE, lag_s=0.05)
    assert characteristic_effects(found) == {}
    assert found.gain.value == pytest.approx(1.0, rel=0.005)


def test_the_branches_lie_a_hysteresis_width_apart():
    spec = SPEC.with_effect(Channel.PRESSURE, "hysteresis", {"half_width_v": 0.2})
    run = slow_run(spec, Channel.PRESSURE, Waveform(Shape.TRIANGLE, 2.5, 2.5, 1.0 / 40.0), noise=0.0)
    found = static_characteristic(run, Channel.PRESSURE, lag_s=0.05)
    at = np.interp(3.0, found.rising.output, found.rising.voltage_v)
    back = np.interp(3.0, found.falling.output, found.falling.voltage_v)
    assert at - back == pytest.approx(0.4, abs=0.02)


def test_an_integrating_path_is_read_by_its_rate_with_dead_zone_and_null():
    spec = SPEC.with_effect(Channel.POSITION, "bias", {"bias_v": -0.05})
    spec = spec.with_effect(Channel.POSITION, "dead_zone", {"half_width_v": 0.1})
    run = slow_run(spec, Channel.POSITION, Waveform(Shape.TRIANGLE, 1.0, 0.0, 0.125, 0.5 * np.pi))
    found = static_characteristic(run, Channel.POSITION, lag_s=1.0 / 23.0)
    assert found.integrating
    assert found.gain.value == pytest.approx(8.8, rel=0.01)
    assert found.dead_zone_half_width_v.value == pytest.approx(0.1, abs=0.01)
    assert found.null_v.value == pytest.approx(0.05, abs=0.005)
    assert found.saturation_upper_v is None
    assert characteristic_effects(found)["bias"]["bias_v"] == pytest.approx(-0.05, abs=0.005)


def test_a_run_that_only_rises_is_refused():
    run = Run(STEP_S, {"load_voltage_v": np.linspace(0.0, 5.0, 500), "pressure_pa": np.linspace(1e6, 6e6, 500)})
    with pytest.raises(IdentificationError, match="does not go up and down"):
        static_characteristic(run, Channel.PRESSURE)


def test_play_stays_within_its_width_and_moves_only_when_pushed():
    signal = np.cumsum(np.random.default_rng(0).normal(size=500))
    followed = play(signal, 0.7)
    assert np.abs(followed - signal).max() <= 0.7 + 1e-12
    moved = np.diff(followed) != 0.0
    assert np.abs(np.abs(followed - signal)[1:][moved] - 0.7).max() < 1e-12
    assert magnetised(signal, 0.7, 0.0) == pytest.approx(followed)
    assert np.abs(magnetised(signal, 0.7, 1.0) - signal).max() <= 1.4
