"""The station's paths from runs of the paper's model and of the virtual rig."""

import numpy as np
import pytest

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import ModelInput, ModelSpec, PlantModel
from dt_station_nodes.core.run import Run
from dt_station_nodes.core.waveforms import Shape, Waveform, waveform_samples
from dt_station_nodes.identification import (
    IdentificationError,
    identify_closed_loop,
    identify_direct,
    identify_disturbance,
)
from dt_station_nodes.identification.modelfile import commented, model_of
from dt_station_nodes.identification.summary import named_intervals, path_summary
from support.known_systems import switching

PAPER = {
    "name": "linear",
    "paths": {
        "pressure": {"numerator": [39.7 * 41.0], "denominator": [1.0, 60.0, 39.7 * 41.0], "scale": 1e6, "rest": 1e6},
        "position": {
            "numerator": [206.4],
            "denominator": [1.0, 23.34, 0.0],
            "scale": 0.01,
            "disturbance": {"numerator": [64.72, -16.45], "denominator": [1.0, 76.54, 2009.0, 0.0]},
        },
    },
}


def record(step_s=0.02, samples=3000, gain=100.0, bias=0.0, noise=1e-5, load_v=5.0):
    """A run of the linear station: load valve switched, position in a proportional loop."""
    model = PlantModel(ModelSpec.model_validate(PAPER), step_s)
    rng = np.random.default_rng(0)
    load = switching(samples, max(1, round(0.14 / step_s)), 0.0, load_v, 4)
    setpoint = waveform_samples(Waveform(Shape.SQUARE, 0.01, 0.0, 0.37), step_s, samples)
    state = model.initial_state()
    columns = {name: np.empty(samples) for name in ("servo_voltage_v", "pressure_pa", "position_m")}
    for k in range(samples):
        _, seen = model.step(state, ModelInput(0.0, 0.0))
        position = seen.position_m + noise * rng.normal()
        voltage = gain * (setpoint[k] - position)
        state, _ = model.step(state, ModelInput(load[k], voltage + bias))
        columns["servo_voltage_v"][k], columns["pressure_pa"][k] = voltage, seen.pressure_pa + 2e3 * rng.normal()
        columns["position_m"][k] = position
    return Run(step_s, {**columns, "load_voltage_v": load, "position_setpoint_m": setpoint}, source="made")


@pytest.fixture(scope="module")
def run():
    return record(bias=0.02)


@pytest.fixture(scope="module")
def pressure(run):
    return identify_direct(run, Channel.PRESSURE, poles=(1, 2), delay_s=0.0)


@pytest.fixture(scope="module")
def position(run):
    return identify_direct(run, Channel.POSITION, poles=(2,), zeros=(0,), rest_pressure_pa=1e6)


def test_the_pressure_path_comes_back_with_its_rest(pressure):
    assert pressure.transfer.denominator == pytest.approx((1.0, 60.0, 39.7 * 41.0), rel=0.03)
    assert pressure.rest == pytest.approx(1e6, rel=0.005)
    assert pressure.scale == 1e6


def test_position_and_disturbance_come_back_jointly_with_the_valves_bias(position):
    assert position.gain.value == pytest.approx(8.843, rel=0.01)
    assert position.transfer.denominator[1] == pytest.approx(23.34, rel=0.03)
    assert position.disturbance.gain() == pytest.approx(-0.0082, rel=0.1)
    assert position.bias_v.value == pytest.approx(0.02, abs=2e-3)


def test_the_model_loads_and_simulates_the_run(run, pressure, position):
    spec = model_of([pressure, position], "identified", "a test")
    text = commented(spec, {**named_intervals(pressure), **named_intervals(position)})
    again = ModelSpec.from_yaml(text)
    assert again == spec
    assert text.startswith("# Identified")
    simulated = PlantModel(again, run.sample_time_s).simulate(
        run.signals["load_voltage_v"], run.signals["servo_voltage_v"], run.signals["pressure_pa"]
    )
    assert np.std(simulated.pressure_pa - run.signals["pressure_pa"]) < 2e4
    assert np.std(simulated.position_m - run.signals["position_m"]) < 3e-4


def test_identified_channels_leave_the_others_as_they_were(pressure):
    base = ModelSpec.model_validate(PAPER)
    spec = model_of([pressure], "half", "a test", base)
    assert spec.paths[Channel.POSITION] == base.paths[Channel.POSITION]


def test_the_summary_is_plain(position):
    import json

    text = json.dumps(path_summary(position))
    assert "position integrator gain" in text
    assert "disturbance integrator gain" in text


def test_the_papers_way_finds_the_open_path_where_sampling_is_fast():
    found = identify_closed_loop(record(step_s=0.002, samples=8000, gain=200.0, load_v=0.0))
    assert found.transfer.integrators == 1
    assert found.gain.value == pytest.approx(8.843, rel=0.03)
    assert found.transfer.denominator[1] == pytest.approx(23.34, rel=0.1)
    assert found.gain.value == pytest.approx(found.transfer.gain())


def test_the_papers_way_says_what_the_hold_does_to_it():
    found = identify_closed_loop(record(load_v=0.0))
    assert found.gain.value > 1.05 * 8.843
    (note,) = (note for note in found.notes if "hold" in note)
    gain, pole = (
        float(part.split()[0]) for part in note.replace("gain is", "|").replace("pole at", "|").split("|")[1:]
    )
    assert gain == pytest.approx(8.843, rel=0.03)
    assert pole == pytest.approx(-23.34, rel=0.08)


def test_the_papers_way_asks_for_a_proportional_controller(run):
    strange = {**run.signals, "servo_voltage_v": np.random.default_rng(0).normal(size=len(run))}
    with pytest.raises(IdentificationError, match="proportional"):
        identify_closed_loop(Run(0.02, strange))


def test_the_disturbance_path_is_found_with_the_servo_valve_closed():
    model = PlantModel(ModelSpec.model_validate(PAPER), 0.02)
    load = switching(3000, 11, 0.0, 5.0, 9)
    simulated = model.simulate(load, np.zeros(3000))
    run = Run(0.02, {"load_voltage_v": load, "pressure_pa": simulated.pressure_pa, "position_m": simulated.position_m})
    found = identify_disturbance(run, 1e6)
    assert found.gain.value == pytest.approx(-16.45 / 2009.0, rel=0.01)
    spec = model_of([found], "aside", "a test", ModelSpec.model_validate(PAPER))
    assert spec.paths[Channel.POSITION].numerator == (206.4,)
    with pytest.raises(IdentificationError, match="--model paper"):
        model_of([found], "aside", "a test")


def test_more_integrators_than_poles_are_refused(run):
    with pytest.raises(IdentificationError, match="integrators"):
        identify_direct(run, Channel.POSITION, poles=(1,), integrators=2)


def test_a_disturbance_path_the_run_does_not_determine_stays_out_of_the_model(run):
    noise = np.random.default_rng(3).normal(size=len(run))
    unrelated = Run(run.sample_time_s, {**run.signals, "pressure_pa": 1e6 + 1e3 * noise}, source="made")
    found = identify_direct(unrelated, Channel.POSITION, poles=(2,), zeros=(0,), rest_pressure_pa=1e6)
    assert found.disturbance is None
    assert "experiment disturbance" in found.notes[0]
    assert model_of([found], "alone", "a test").paths[Channel.POSITION].disturbance is None
