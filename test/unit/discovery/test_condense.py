"""A run made short enough to search in: what it keeps, and what is said of it."""

import numpy as np
import pytest

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import PathSpec
from dt_station_nodes.core.run import Run
from dt_station_nodes.discovery.condense import condensed, fastest_s

STEP_S = 0.001
QUICK = PathSpec(numerator=[1.0], denominator=[0.001, 1.0])
SLOW = PathSpec(numerator=[1.0], denominator=[1.0, 1.0])
MOST = 400


def run_of(count: int, lively: slice = slice(0, 0)) -> Run:
    rng = np.random.default_rng(1)
    voltage = rng.standard_normal(count)
    voltage[lively] *= 5.0
    return Run(STEP_S, {"servo_voltage_v": voltage, "position_m": rng.standard_normal(count)})


@pytest.mark.parametrize("count", [MOST - 1, MOST, MOST * 5 // 4])
def test_a_run_that_is_short_enough_stays_as_it_is_and_nothing_is_said(count: int) -> None:
    run = run_of(count)
    short = condensed(run, Channel.POSITION, QUICK, MOST)
    assert short.run is run
    assert short.note == ""
    assert np.array_equal(short.rows, np.arange(count))


@pytest.mark.parametrize("factor", [2, 3, 8])
def test_a_slow_path_is_searched_in_longer_steps_whose_voltage_drives_it_alike(factor: int) -> None:
    run = run_of(MOST * factor)
    short = condensed(run, Channel.POSITION, SLOW, MOST)
    assert short.run.sample_time_s == pytest.approx(factor * STEP_S)
    assert short.run.sample_time_s < fastest_s(SLOW)
    assert len(short.run) == MOST
    assert np.array_equal(short.run.signals["position_m"], run.signals["position_m"][short.rows])
    mean = short.run.signals["servo_voltage_v"].mean()
    assert mean == pytest.approx(run.signals["servo_voltage_v"].mean(), abs=1e-12)
    assert f"steps of {factor} ms" in short.note


@pytest.mark.parametrize("begin", [0, 600, 1500])
def test_a_quick_path_is_searched_where_its_voltage_moves_most(begin: int) -> None:
    run = run_of(2000, slice(begin, begin + MOST))
    short = condensed(run, Channel.POSITION, QUICK, MOST)
    assert short.run.sample_time_s == STEP_S
    assert abs(int(short.rows[0]) - begin) <= MOST // 8
    for name, values in short.run.signals.items():
        assert np.array_equal(values, run.signals[name][short.rows])
    assert f"from {short.run.start_s - run.start_s:.3g} to" in short.note
