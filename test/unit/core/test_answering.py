"""A controller among samples and set-points."""

from dataclasses import replace

import pytest

from dt_station_nodes.core.answering import Answering
from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.control import ControlInput, LoopConfig, LoopController
from dt_station_nodes.core.samples import ControlMode, PlantSample, Setpoint

CONFIG = LoopConfig.from_yaml(
    "mode: pi\nlimits: {lower_v: 0.0, upper_v: 5.0}\npi: {gain: 0.2861, integral_time_s: 0.0452, error_scale: 1.0e-6}\n"
)


def sample(sequence, pressure=1e6):
    return PlantSample(sequence, sequence * 20, 0.0, pressure, 0.0, 0.0)


def streaming(sequence, value=2e6):
    return Setpoint(sequence, 0, value, True)


@pytest.fixture
def answering():
    return Answering(Channel.PRESSURE, CONFIG, 0.02)


def test_without_setpoints_the_initial_one_stands_and_the_answer_is_immediate(answering):
    _, commands = answering.on_sample(answering.initial_state(1.5e6), sample(0))
    assert [c.sequence for c in commands] == [0]
    assert commands[0].setpoint == 1.5e6
    assert commands[0].mode is ControlMode.PI


def test_the_order_of_sample_and_setpoint_does_not_matter(answering):
    def play(setpoint_first):
        state, out = answering.initial_state(0.0), []
        for k in range(50):
            sample_k, setpoint_k = sample(k, 1e6 + 1e4 * k), streaming(k, 2e6 + 1e3 * k)
            steps = [(answering.on_setpoint, setpoint_k), (answering.on_sample, sample_k)]
            for offer, given in steps if setpoint_first or k == 0 else reversed(steps):
                state, commands = offer(state, given)
                out += commands
        return out

    assert play(True) == play(False)
    controller = LoopController(CONFIG, 0.02)
    loop = controller.initial_state()
    for k, command in enumerate(play(True)):
        pressure = 1e6 + 1e4 * k
        loop, output = controller.step(loop, ControlInput(2e6 + 1e3 * k, pressure, pressure))
        assert command.voltage_v == output.voltage_v


def test_a_setpoint_that_does_not_come_is_held_and_counted(answering):
    state, _ = answering.on_setpoint(answering.initial_state(0.0), streaming(0))
    state, _ = answering.on_sample(state, sample(0))
    state, none = answering.on_sample(state, sample(1))
    assert none == []
    state, commands = answering.on_sample(state, sample(2))
    assert [(c.sequence, c.setpoint) for c in commands] == [(1, 2e6)]
    assert state.late == 1


def test_a_publisher_known_but_not_yet_heard_is_waited_for(answering):
    state, commands = answering.on_sample(answering.initial_state(0.0), sample(0), awaited=True)
    assert commands == []
    state, commands = answering.on_setpoint(state, streaming(0))
    assert [c.setpoint for c in commands] == [2e6]


def test_the_same_sample_twice_is_answered_once_and_a_new_run_starts_from_rest(answering):
    state = answering.initial_state(2e6)
    first = []
    for k in range(5):
        state, commands = answering.on_sample(state, sample(k))
        first += commands
    assert answering.on_sample(state, sample(4)) == (state, [])
    _, again = answering.on_sample(state, replace(sample(0), stamp_ns=7))
    assert [(c.sequence, c.voltage_v) for c in again] == [(0, first[0].voltage_v)]


def test_switching_to_manual_is_bumpless(answering):
    state = answering.initial_state(2e6)
    for k in range(5):
        state, commands = answering.on_sample(state, sample(k))
    manual = CONFIG.changed(mode="manual", manual_voltage_v=0.0)
    changed, state = answering.reconfigured(manual, state)
    _, after = changed.on_sample(state, sample(5))
    assert after[0].mode is ControlMode.MANUAL
    assert after[0].voltage_v == pytest.approx(commands[0].voltage_v, rel=0.2)
