"""What drives a run: the set-points that move, else open-loop voltages, never a loop that only holds its place."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import signal

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import PathSpec
from dt_station_nodes.core.models.effects import Quantity
from dt_station_nodes.core.run import Run
from dt_station_nodes.discovery.recurring import SAME_TURNS
from dt_station_nodes.discovery.scales import excitations_hz, scales

Array = NDArray[np.float64]
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


@pytest.mark.parametrize("hertz", [0.2179, 0.3237, 0.4013, 0.6551])
@pytest.mark.parametrize("shape", [np.sin, np.sign, signal.sawtooth], ids=["sine", "square", "sawtooth"])
def test_its_frequency_is_read_between_the_lines_of_the_spectrum(shape: Callable[[Array], Array], hertz: float) -> None:
    turn = 2.0 * np.pi * hertz * TIME_S + 0.7
    (found,) = excitations_hz(run(position_setpoint_m=shape(np.sin(turn) if shape is np.sign else turn)))
    # Of its fifth harmonic less than half of what counts as another frequency.
    assert 5.0 * abs(found - hertz) * TIME_S[-1] < 0.5 * SAME_TURNS


def times(sample_s: float, lag_s: float, samples: int = 1500) -> tuple[float, float]:
    """Scales of times of a path and of a run."""
    rig = Run(sample_s, {"position_m": WAVE[:samples], "servo_voltage_v": WAVE[:samples]})
    path = PathSpec(numerator=(1.0,), denominator=(lag_s, 1.0))
    found = scales(rig, Channel.POSITION, path, np.zeros(0))
    assert found[Quantity.RATE] * found[Quantity.TIME] == pytest.approx(1.0)
    assert found[Quantity.RUN_RATE] * found[Quantity.RUN_TIME] == pytest.approx(1.0)
    assert found[Quantity.FREQUENCY] == found[Quantity.RATE]
    return found[Quantity.TIME], found[Quantity.RUN_TIME]


def test_times_stand_as_written_for_a_servo_valve() -> None:
    assert times(0.02, 0.05) == (1.0, 1.0)
    assert times(0.01, 0.3) == (1.0, 1.0)


def test_times_go_with_the_slower_of_sample_and_lag_and_with_the_length_of_the_run() -> None:
    slow, long = times(2.0, 5.0)
    assert times(0.2, 50.0)[0] == pytest.approx(2.0 * slow)
    assert times(4.0, 10.0) == pytest.approx((2.0 * slow, 2.0 * long))
    fast, short = times(2e-4, 5e-4)
    assert fast < 0.1
    assert short < 0.1
    assert times(1e-4, 2.5e-4) == pytest.approx((0.5 * fast, 0.5 * short))
