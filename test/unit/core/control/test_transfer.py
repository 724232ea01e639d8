"""Changes of mode and of settings while the loop runs make no bump."""

import time
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from dt_station_nodes.core.control import ControlInput, LoopConfig, LoopController
from dt_station_nodes.core.samples import ControlMode

SAMPLE_TIME_S = 0.02
CONTROLLERS = Path(__file__).resolve().parents[4] / "config" / "controllers"
SECTIONS = {
    name: LoopConfig.from_yaml((CONTROLLERS / f"{file}.yaml").read_text(encoding="utf-8"))
    for name, file in (("pid", "position_pid"), ("fuzzy", "position_fuzzy"))
}
ALL = LoopConfig.model_validate(
    {
        "mode": "pid",
        "manual_voltage_v": 1.5,
        "pi": {"gain": 2.0, "integral_time_s": 5.0, "error_scale": 100.0},
        "pid": SECTIONS["pid"].pid,
        "fuzzy": SECTIONS["fuzzy"].fuzzy,
    }
)
INTEGRATING = ALL.changed(
    pid={"p": 7.0, "i": 5.0, "d": 0.1, "error_scale": 100.0},
    fuzzy=SECTIONS["fuzzy"].fuzzy.model_copy(update={"integral_gain": 4.0}),
)


def run_up(config: LoopConfig, samples: int = 40):
    controller = LoopController(config, SAMPLE_TIME_S)
    state, out = controller.initial_state(), None
    given = ControlInput(0.01, 0.0, 2e6)
    for k in range(samples):
        given = ControlInput(0.01, 0.004 + 0.00005 * k, 2e6 + 1e4 * k)
        state, out = controller.step(state, given)
    return controller, state, given, out


@pytest.mark.parametrize(("base", "before", "after"), list(product([ALL, INTEGRATING], ControlMode, ControlMode)))
def test_any_mode_takes_over_without_a_bump(base, before, after) -> None:
    controller, state, given, out = run_up(base.with_mode(before))
    changed, state = controller.reconfigured(base.with_mode(after), state, given)
    _, first = changed.step(state, given)
    # What may move is the integral's own step (largest: 5 V/s/cm x 1 cm x 20 ms) and the offset's decay.
    assert first.mode is after
    assert abs(first.voltage_v - out.voltage_v) <= 0.1 + 1e-9


@pytest.mark.parametrize("mode", [ControlMode.PI, ControlMode.PID, ControlMode.FUZZY])
def test_live_gain_change_makes_no_bump(mode) -> None:
    controller, state, given, out = run_up(ALL.with_mode(mode))
    stronger = ALL.with_mode(mode).changed(
        pi=ALL.pi.model_copy(update={"gain": 6.0}),
        pid=ALL.pid.model_copy(update={"p": 20.0, "d": 0.3}),
        fuzzy=ALL.fuzzy.model_copy(update={"output_gain": 3.0}),
    )
    changed, state = controller.reconfigured(stronger, state, given)
    _, first = changed.step(state, given)
    assert first.voltage_v == pytest.approx(out.voltage_v, abs=0.02)


@pytest.mark.parametrize("mode", [ControlMode.PID, ControlMode.FUZZY])
def test_the_offset_of_a_law_without_integral_dies_out(mode) -> None:
    controller, state, given, _ = run_up(ALL.with_mode(ControlMode.MANUAL))
    changed, state = controller.reconfigured(ALL.with_mode(mode), state, given)
    steady = ControlInput(0.0, 0.0, 2e6)
    offsets = []
    for _ in range(1500):
        state, out = changed.step(state, steady)
        offsets.append(abs(state.offset_v))
    assert np.all(np.diff(offsets) <= 0.0)
    assert state.offset_v == 0.0
    assert abs(out.voltage_v) < 0.02


def test_back_to_the_published_pid_it_is_the_published_pid_again_bit_for_bit() -> None:
    controller, state, given, _ = run_up(ALL.with_mode(ControlMode.FUZZY))
    changed, state = controller.reconfigured(ALL.with_mode(ControlMode.PID), state, given)
    for _ in range(1500):
        state, _ = changed.step(state, given)
    memory = state.memory
    _, out = changed.step(state, ControlInput(0.01, 0.003))
    x = (0.01 - 0.003) * 100.0
    assert out.voltage_v == 7.1545 * x + memory.integral_v + 0.1473 / SAMPLE_TIME_S * (x - memory.slope_error)


def test_entering_manual_ends_at_the_operator_s_voltage_and_moving_it_acts_at_once() -> None:
    controller, state, given, _ = run_up(ALL.with_mode(ControlMode.PI))
    manual, state = controller.reconfigured(ALL.with_mode(ControlMode.MANUAL), state, given)
    for _ in range(1500):
        state, out = manual.step(state, given)
    assert out.voltage_v == 1.5
    moved, state = manual.reconfigured(ALL.changed(mode=ControlMode.MANUAL, manual_voltage_v=3.0), state, given)
    assert moved.step(state, given)[1].voltage_v == 3.0


def test_the_same_configuration_again_changes_nothing() -> None:
    controller, state, given, _ = run_up(ALL)
    same, after = controller.reconfigured(ALL, state, given)
    assert after is state
    assert same.step(after, given) == controller.step(state, given)


def test_a_dead_sensor_does_not_poison_the_new_law() -> None:
    controller, state, _, out = run_up(ALL)
    dead = ControlInput(0.01, float("nan"), 2e6)
    changed, state = controller.reconfigured(ALL.with_mode(ControlMode.PI), state, dead)
    assert changed.step(state, dead)[1].voltage_v == out.voltage_v
    assert np.isfinite(changed.step(state, ControlInput(0.01, 0.005, 2e6))[1].voltage_v)


def test_a_live_switch_to_fuzzy_takes_no_longer_than_a_sample() -> None:
    controller, state, given, _ = run_up(ALL)
    fuzzy = ALL.with_mode(ControlMode.FUZZY)
    start = time.process_time()
    controller.reconfigured(fuzzy, state, given)
    assert time.process_time() - start < SAMPLE_TIME_S
