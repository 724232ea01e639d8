import os
from pathlib import Path

import numpy as np
import pytest

from dt_station_nodes.core.models import ModelSpec
from dt_station_nodes.core.run import Run
from dt_station_nodes.identification import IdentificationError
from dt_station_nodes.identification.inverse_dynamics import (
    FrictionModel,
    fit_axis,
    force_error_percent,
    regression,
)
from dt_station_nodes.identification.modelfile import axis_model
from dt_station_nodes.records import load_run

ROOT = Path(__file__).resolve().parents[3]
DATA = Path(os.environ.get("DT_STATION_DATA", ROOT / ".." / "shared" / "data"))
FORCE_PER_VOLT = 35.15065188


def axis_run(noise=1e-6, samples=8000, step_s=1e-3):
    """A smooth motion and the force it takes: 20 kg, 50 N s/m, 8 N, offset -2 N."""
    time_s = step_s * np.arange(samples)
    omega = 2.0 * np.pi * np.array([0.4, 1.1])
    phase = omega[:, None] * time_s
    position = 0.05 * np.sin(phase[0]) + 0.02 * np.sin(phase[1])
    velocity = 0.05 * omega[0] * np.cos(phase[0]) + 0.02 * omega[1] * np.cos(phase[1])
    acceleration = -0.05 * omega[0] ** 2 * np.sin(phase[0]) - 0.02 * omega[1] ** 2 * np.sin(phase[1])
    force = 20.0 * acceleration + 50.0 * velocity + 8.0 * np.sign(velocity) - 2.0
    rng = np.random.default_rng(0)
    return Run(
        step_s,
        {
            "servo_voltage_v": (force + 0.3 * rng.normal(size=samples)) / 4.0,
            "position_m": position + noise * rng.normal(size=samples),
        },
        source="axis",
    )


def test_a_made_axis_comes_back_inside_its_intervals():
    found = fit_axis(regression(axis_run(), 4.0))
    truth = {"mass": 20.0, "viscous": 50.0, "coulomb": 8.0, "offset": -2.0}
    for name, value in truth.items():
        assert found.values[name].value == pytest.approx(value, rel=0.02)
    assert sum(found.values[name].holds(value) for name, value in truth.items()) >= 3


def test_without_coulomb_friction_the_viscous_coefficient_hides_it():
    data = regression(axis_run(), 4.0)
    linear, whole = (fit_axis(data, f) for f in (FrictionModel.LINEAR, FrictionModel.COULOMB))
    assert linear.values["viscous"].value > 1.2 * whole.values["viscous"].value
    assert whole.force_error_percent < linear.force_error_percent


def test_the_axis_becomes_a_model_with_friction():
    spec = axis_model(fit_axis(regression(axis_run(), 4.0)), 4.0, 0.01, "axis", "a test")
    path = next(iter(ModelSpec.from_yaml(spec.to_yaml()).paths.values()))
    assert path.numerator[0] == pytest.approx(100.0 * 4.0 / 20.0, rel=0.02)
    effects = {effect.name: effect.parameters for effect in path.effects}
    assert effects["friction"]["coulomb_v"] == pytest.approx(2.0, rel=0.02)
    assert effects["bias"]["bias_v"] == pytest.approx(0.5, rel=0.05)


def test_a_wrong_sign_is_noticed():
    run = axis_run()
    turned = Run(run.sample_time_s, {**run.signals, "servo_voltage_v": -run.signals["servo_voltage_v"]})
    with pytest.raises(IdentificationError, match="sign of the voltage"):
        axis_model(fit_axis(regression(turned, 4.0)), 4.0, 0.01, "axis", "a test")


def test_a_short_run_and_a_wrong_cut_off_are_refused():
    with pytest.raises(IdentificationError, match="too few"):
        regression(axis_run(samples=200))
    with pytest.raises(IdentificationError, match="cut-off"):
        regression(axis_run(), cutoff_hz=900.0)


@pytest.mark.measured
@pytest.mark.skipif(not (DATA / "emps.mat").is_file(), reason="emps.mat is not in DT_STATION_DATA")
def test_emps_comes_out_as_published():
    maps = ROOT / "config" / "maps"
    data = regression(load_run(DATA / "emps.mat", maps / "emps.yaml"), FORCE_PER_VOLT)
    other = regression(load_run(DATA / "emps_pulses.mat", maps / "emps_pulses.yaml"), FORCE_PER_VOLT)
    found = {friction: fit_axis(data, friction) for friction in FrictionModel}
    coulomb = found[FrictionModel.COULOMB]
    published = {"mass": 95.11, "viscous": 203.5, "coulomb": 20.39, "offset": -3.165}
    for name, value in published.items():
        assert coulomb.values[name].value == pytest.approx(value, rel=0.01)
        assert coulomb.values[name].holds(value)
    assert found[FrictionModel.LINEAR].force_error_percent == pytest.approx(17.0, abs=1.1)
    assert coulomb.force_error_percent == pytest.approx(4.1, abs=0.2)
    assert force_error_percent(other, FrictionModel.COULOMB, coulomb.values) <= 6.0
    assert found[FrictionModel.ASYMMETRIC].force_error_percent == pytest.approx(3.1, abs=0.2)
