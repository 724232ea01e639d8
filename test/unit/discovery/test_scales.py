"""What drives a run: the set-points that move, else open-loop voltages, never a loop that only holds its place."""

import numpy as np
import pytest

from dt_station_nodes.core.run import Run
from dt_station_nodes.discovery.scales import excitations_hz

TIME_S = 0.02 * np.arange(1500)
WAVE = np.sin(2.0 * np.pi * 0.4 * TIME_S)
STILL = np.zeros(1500)


def run(**signals: np.ndarray) -> Run:
    return Run(0.02, {"position_m": WAVE, **signals})


def test_a_set_point_that_moves_is_what_drives() -> None:
    assert excitations_hz(run(position_setpoint_m=WAVE, servo_voltage_v=STILL)) == pytest.approx([0.4], rel=0.02)


def test_in_an_open_loop_the_voltage_is() -> None:
    for setpoint in ({}, {"position_setpoint_m": STILL}):
        assert excitations_hz(run(servo_voltage_v=3.0 * WAVE, **setpoint)) == pytest.approx([0.4], rel=0.02)


def test_a_loop_that_holds_against_a_disturbance_excites_nothing() -> None:
    hiss = 0.05 * np.random.default_rng(1).standard_normal(1500)
    assert excitations_hz(run(position_setpoint_m=STILL, servo_voltage_v=WAVE + hiss)) == ()
