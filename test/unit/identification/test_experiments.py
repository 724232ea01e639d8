from dataclasses import replace

import numpy as np
import pytest

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.waveforms import Shape, Waveform
from dt_station_nodes.identification import IdentificationError
from dt_station_nodes.identification.experiments import Drive, ExperimentDriver, experiments, run_in_process


def played(plan, samples=None, pressure_pa=1e6, position_m=0.0):
    driver = ExperimentDriver(plan, 0.02)
    state = driver.initial_state()
    outputs = []
    while not driver.finished(state) and (samples is None or len(outputs) < samples):
        state, output = driver.step(state, pressure_pa, position_m)
        outputs.append((output.voltage_v[Channel.PRESSURE], output.voltage_v[Channel.POSITION]))
    return np.array(outputs)


@pytest.mark.parametrize("name", experiments())
def test_every_plan_stays_in_the_valves_ranges_and_lasts_its_time(name):
    plan = experiments()[name]
    volts = played(plan)
    assert len(volts) == round(plan.duration_s / 0.02)
    assert volts[:, 0].min() >= 0.0
    assert volts[:, 0].max() <= 5.0
    assert np.abs(volts[:, 1]).max() <= 10.0
    assert np.ptp(volts) > 0.0


def test_the_pressure_square_goes_from_0_to_5_volts_at_several_frequencies():
    load = played(experiments(duration_s=40.0)["pressure-square"])[:, 0]
    assert set(load) == {0.0, 5.0}
    quarters = np.array_split(np.abs(np.diff(load)) > 0.0, 4)
    assert [q.sum() for q in quarters] == sorted(q.sum() for q in quarters)


def test_amplitude_and_centre_scale_the_plan():
    half = experiments(centre_m=0.05, amplitude=0.5)
    assert played(half["pressure-square"], 50)[:, 0].max() == pytest.approx(2.5)
    assert half["position-square"].position.setpoint.offset == 0.05


def test_a_proportional_drive_is_just_that():
    drive = Drive(setpoint=Waveform(Shape.CONSTANT, offset=0.01), gain_v_per_unit=200.0)
    plan = replace(experiments()["position-square"], position=drive)
    assert played(plan, 1, position_m=0.002)[0, 1] == pytest.approx(1.6)
    assert played(plan, 1, position_m=-0.2)[0, 1] == 10.0


def test_a_piston_that_leaves_its_travel_stops_the_experiment():
    with pytest.raises(IdentificationError, match=r"at 0.00 s: the piston is at 0.260 m"):
        played(experiments()["joint"], 1, position_m=0.26)


@pytest.mark.parametrize(
    "wrong", [{"amplitude": 0.0}, {"amplitude": 1.5}, {"duration_s": -1.0}, {"duration_s": float("nan")}]
)
def test_nonsense_is_refused(wrong):
    with pytest.raises(IdentificationError):
        experiments(**wrong)
    with pytest.raises(IdentificationError, match="too fast"):
        ExperimentDriver(experiments()["pressure-square"], 0.5)


def test_a_run_pairs_each_row_with_the_voltages_applied_from_it():
    written = []

    def write(load, servo):
        written.append((load, servo))
        return load, servo + 0.5

    plan = experiments(duration_s=1.0)["disturbance"]
    run = run_in_process(plan, 0.02, lambda: (1e6 + len(written), 0.0), write, "made")
    assert len(run) == 50
    assert run.signals["pressure_pa"].tolist() == [1e6 + k for k in range(50)]
    assert run.signals["load_voltage_v"].tolist() == [load for load, _ in written]
    assert run.signals["servo_voltage_v"].tolist() == [0.5] * 50
    assert run.get("position_setpoint_m") is None
