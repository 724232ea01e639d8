"""The twin's two feeds against whole-run simulation and against each other."""

import math

import numpy as np
import pytest

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.control import LoopConfig, LoopController
from dt_station_nodes.core.models import ModelSpec, PlantModel
from dt_station_nodes.core.samples import PlantSample, Setpoint
from dt_station_nodes.core.twin import CommandTwin, SetpointTwin
from dt_station_nodes.core.twin_loops import TwinLoops
from dt_station_nodes.nodes.configuration import find_config


def text(kind, name):
    return find_config(kind, name).read_text(encoding="utf-8")


SPEC = ModelSpec.from_yaml(text("models", "paper"))
LOAD = LoopConfig.from_yaml(text("controllers", "pressure_pi"))
POSITION = LoopConfig.from_yaml(text("controllers", "position_pid"))
N = 200


@pytest.fixture(scope="module")
def model():
    return PlantModel(SPEC, 0.02)


def samples(load, servo, pressure, start=0):
    """Voltages of row k act from k on, so that sample k + 1 carries them."""
    yield PlantSample(start, 0, 0.01, pressure[0], 0.0, 0.0)
    for k in range(1, N):
        yield PlantSample(start + k, 20 * k, 0.0, pressure[k], load[k - 1], servo[k - 1])


def test_fed_with_commands_it_is_the_whole_run_simulation_bit_for_bit(model):
    k = np.arange(N)
    load, servo = np.where(k % 50 < 25, 1.0, 3.0), 0.3 * np.sin(0.1 * k)
    pressure = 1.5e6 + 1e5 * np.sin(0.2 * k)
    twin = CommandTwin(model, measured_pressure=True)
    state, out = twin.initial_state(), []
    for each in samples(load, servo, pressure):
        state, simulated = twin.step(state, each)
        out.append((simulated.pressure_pa, simulated.position_m))
        assert (simulated.sequence, simulated.stamp_ns) == (each.sequence, each.stamp_ns)
    whole = model.simulate(load, servo, pressure, model.initial_state(0.01, pressure[0]))
    assert np.array_equal(np.array(out), np.column_stack([whole.pressure_pa, whole.position_m]))


def test_a_gap_is_crossed_with_the_voltages_applied_and_a_restart_stands_anew(model):
    twin = CommandTwin(model, measured_pressure=False)
    ends = []
    for numbers in ((0, 1, 2, 3), (0, 3)):
        state = twin.initial_state()
        for number in numbers:
            state, last = twin.step(state, PlantSample(number, 0, 0.0, 1e6, 2.0, 0.5))
        ends.append(last.position_m)
    assert ends[0] == ends[1]
    state, last = twin.step(state, PlantSample(0, 0, 0.2, 1e6, 0.0, 0.0))
    assert last.position_m == pytest.approx(0.2)


def test_a_channel_without_a_model_is_no_number():
    alone = SPEC.model_copy(update={"paths": {Channel.POSITION: SPEC.paths[Channel.POSITION]}})
    twin = CommandTwin(PlantModel(alone, 0.02))
    _, out = twin.step(twin.initial_state(), PlantSample(0, 0, 0.1, math.nan, 0.0, 0.0))
    assert math.isnan(out.pressure_pa)
    assert out.position_m == pytest.approx(0.1)


def loops(model, patience=20):
    return TwinLoops(model, LoopController(LOAD, 0.02), LoopController(POSITION, 0.02), patience)


def test_its_own_loops_reach_their_setpoints_and_act_within_the_sample(model):
    twin = SetpointTwin(model, LoopController(LOAD, 0.02), LoopController(POSITION, 0.02))
    state = twin.initial_state()
    for k in range(300):
        before = state
        state, out = twin.step(state, PlantSample(k, 0, 0.0, 1e6, 0.0, 0.0), 2e6, 0.02)
        if k:
            assert out.servo_voltage_v == before.servo_voltage_v
    assert out.pressure_pa == pytest.approx(2e6, rel=1e-3)
    assert out.position_m == pytest.approx(0.02, abs=1e-4)


def test_any_order_of_setpoints_and_samples_gives_the_same_bits(model):
    def play(order):
        twins = loops(model)
        state, out = twins.initial_state(), []
        for k in range(60):
            events = {
                "sample": lambda s, k=k: twins.on_sample(s, PlantSample(k, k, 0.0, 1e6, 0.0, 0.0)),
                "load": lambda s, k=k: twins.on_setpoint(s, Channel.PRESSURE, Setpoint(k, 0, 2e6, True)),
                "position": lambda s, k=k: twins.on_setpoint(s, Channel.POSITION, Setpoint(k, 0, 1e-4 * k, True)),
            }
            for name in order if k else ("load", "position", "sample"):
                state, done = events[name](state)
                out += done
        assert state.late == 0
        return out

    first = play(("load", "position", "sample"))
    assert len(first) == 60
    assert play(("sample", "position", "load")) == first
    assert play(("position", "sample", "load")) == first


def test_a_setpoint_that_never_comes_is_held_after_a_while(model):
    twins = loops(model, patience=3)
    state, _ = twins.on_setpoint(twins.initial_state(), Channel.PRESSURE, Setpoint(0, 0, 2e6, True))
    out = []
    for k in range(10):
        state, done = twins.on_sample(state, PlantSample(k, 0, 0.0, 1e6, 0.0, 0.0))
        out += done
    assert [each.sequence for each in out] == list(range(7))
    assert state.late == 6


def test_its_controllers_change_without_a_bump(model):
    twins = loops(model)
    state = twins.initial_state()
    for k in range(100):
        state, _ = twins.on_sample(state, PlantSample(k, 0, 0.0, 1e6, 0.0, 0.0))
    slower = LOAD.changed(pi=LOAD.pi.model_copy(update={"gain": 0.1}))
    changed, after = twins.reconfigured(slower, POSITION, state)
    assert after.twin.load_voltage_v == state.twin.load_voltage_v
    _, done = changed.on_sample(after, PlantSample(100, 0, 0.0, 1e6, 0.0, 0.0))
    assert done[0].sequence == 100
