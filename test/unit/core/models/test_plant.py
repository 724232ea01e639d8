"""The model as a whole: steady state, the paper's figures, and the same bits however it is run."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import ModelError, ModelInput, ModelSpec, PathSpec, PlantModel

PAPER = ModelSpec.from_yaml((Path(__file__).parents[4] / "config" / "models" / "paper.yaml").read_text())
LINEAR = PAPER.without_effect(Channel.PRESSURE, "dead_zone").without_effect(Channel.PRESSURE, "saturation")


def test_static_gain_of_the_pressure_path():
    result = PlantModel(LINEAR, 0.02).simulate(np.full(200, 2.0), np.zeros(200))
    assert result.pressure_pa[0] == 1e6
    assert result.pressure_pa[-1] == pytest.approx(1e6 + 2e6 * 3.217 / 3.242, rel=1e-6)


def test_integrator_gain_of_the_position_path():
    result = PlantModel(LINEAR, 0.02).simulate(np.zeros(200), np.ones(200))
    assert np.diff(result.position_m)[-1] / 0.02 == pytest.approx(0.01 * 206.4 / 23.34, rel=1e-6)


def test_a_load_step_kicks_and_then_drifts_as_the_paper_says():
    measured = np.full(1000, 2e6)
    position = PlantModel(LINEAR, 0.02).simulate(np.zeros(1000), np.zeros(1000), measured).position_m
    assert position.max() > 1e-4
    assert np.diff(position)[-1] / 0.02 == pytest.approx(-0.01 * 16.45 / 2009, rel=1e-6)


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 2**32 - 1), st.sampled_from([0.001, 0.02, 0.05]), st.booleans())
def test_stepping_and_simulating_give_the_same_bits(seed, sample_time, drive_with_measured):
    rng = np.random.default_rng(seed)
    load, servo = rng.uniform(0, 5, 40), rng.uniform(-2, 2, 40)
    measured = rng.uniform(1e6, 4e6, 40) if drive_with_measured else None
    spec = PAPER.with_effect(Channel.POSITION, "friction", {"coulomb_v": 0.2})
    spec = spec.with_effect(Channel.PRESSURE, "delay", {"delay_s": 0.013})
    model = PlantModel(spec, sample_time)
    whole = model.simulate(load, servo, measured)
    state = model.initial_state()
    for k in range(40):
        pressure = None if measured is None else float(measured[k])
        state, output = model.step(state, ModelInput(float(load[k]), float(servo[k]), pressure))
        assert (output.pressure_pa, output.position_m) == (whole.pressure_pa[k], whole.position_m[k])
    assert np.array_equal(state.values, whole.state.values)
    assert state.sequence == 40


def test_a_state_is_never_written_to():
    model = PlantModel(PAPER, 0.02)
    state = model.initial_state()
    before = state.values.copy()
    model.step(state, ModelInput(3.0, 1.0))
    assert np.array_equal(state.values, before)
    with pytest.raises(ValueError, match="read-only"):
        state.values[0] = 1.0


def test_standing_still_stays_still():
    model = PlantModel(LINEAR, 0.02)
    state = model.initial_state(position_m=0.1, pressure_pa=3e6)
    hold = 2e6 / 1e6 * 3.242 / 3.217
    result = model.simulate(np.full(100, hold), np.zeros(100), np.full(100, 1e6), state)
    assert np.allclose(result.pressure_pa, 3e6, rtol=1e-6)
    assert np.allclose(result.position_m, 0.1, rtol=1e-9)


def test_sub_steps_do_not_change_a_linear_path():
    coarse = PlantModel(LINEAR, 0.02)
    load = np.repeat([0.0, 3.0, 1.0, 4.0], 25)
    alone = ModelSpec(name="p", paths={Channel.PRESSURE: LINEAR.paths[Channel.PRESSURE]})
    single = PlantModel(alone, 0.02)
    assert (coarse.substeps, single.substeps) == (4, 1)
    a = coarse.simulate(load, np.zeros(100)).pressure_pa
    b = single.simulate(load, np.zeros(100)).pressure_pa
    assert np.allclose(a, b, rtol=1e-9)


def test_sub_steps_resolve_what_is_fed_back_but_not_what_only_paces_the_path():
    linear = ModelSpec(name="p", paths={Channel.PRESSURE: PathSpec(numerator=[1.0], denominator=[0.001, 1.0])})
    leaking = linear.with_effect(Channel.PRESSURE, "leakage", {"coefficient": 0.1})
    softened = linear.with_effect(Channel.PRESSURE, "trapped_air", {"softness_s": 0.05, "stiffening": 1.0})
    assert PlantModel(leaking, 0.02).substeps > PlantModel(softened, 0.02).substeps > 1


def test_what_holds_is_sub_stepped_where_a_lag_of_the_path_comes_before_it():
    lags = ModelSpec(name="p", paths={Channel.PRESSURE: PathSpec(numerator=[1.0], denominator=[0.001, 0.07, 1.0])})
    limits = {"upper_v": 3.0, "lower_v": -3.0}
    in_front = lags.with_effect(Channel.PRESSURE, "saturation", limits)
    behind = lags.with_effect(Channel.PRESSURE, "saturation", {**limits, "behind_s": 0.02})
    assert (PlantModel(in_front, 0.02).substeps, PlantModel(behind, 0.02).substeps) == (1, 4)


def test_an_absent_path_gives_zero():
    alone = ModelSpec(name="p", paths={Channel.POSITION: LINEAR.paths[Channel.POSITION]})
    result = PlantModel(alone, 0.02).simulate(np.ones(10), np.ones(10))
    assert np.all(result.pressure_pa == 0.0)
    assert result.position_m[-1] > 0.0


@pytest.mark.parametrize("sample_time", [0.0, -1.0, float("nan"), float("inf")])
def test_a_sample_time_must_be_positive(sample_time):
    with pytest.raises(ModelError, match="sample time"):
        PlantModel(PAPER, sample_time)
