"""Running figures against whole-array ones, and sums against exact ones."""

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dt_station_nodes.core.comparison import Comparison, score
from dt_station_nodes.core.errors import StationError
from dt_station_nodes.core.summation import CompensatedSum, WindowSum

VALUES = st.lists(st.floats(-1e9, 1e9), min_size=1, max_size=60)


def run(measured, simulated, sample_time_s=0.02, window_s=1.0):
    comparison = Comparison(sample_time_s, window_s)
    state = comparison.initial_state()
    for pair in zip(measured, simulated, strict=True):
        state, last = comparison.step(state, *map(float, pair))
    return last


def test_running_and_whole_agree_on_a_large_level():
    rng = np.random.default_rng(3)
    measured = 1e7 + 1e5 * rng.normal(size=5000).cumsum()
    simulated = measured + rng.normal(size=5000)
    running, whole = run(measured, simulated, window_s=2.0), score(measured, simulated, 0.02)
    assert running.ise == pytest.approx(whole.ise, rel=1e-14)
    assert running.fit_percent == pytest.approx(whole.fit_percent, rel=1e-10)
    window = (measured - simulated)[-100:]
    assert running.window_rms == pytest.approx(float(np.sqrt(np.mean(window**2))), rel=1e-13)
    assert running.samples == 5000


def test_a_perfect_match_is_100_percent_and_a_constant_has_no_fit():
    assert run([1.0, 2.0], [1.0, 2.0]).fit_percent == 100.0
    assert math.isnan(run([1.0, 1.0], [1.0, 2.0]).fit_percent)


def test_nan_is_shown_and_left_out():
    last = run([1.0, math.nan, 3.0], [1.5, 2.0, 3.0])
    assert last.samples == 2
    assert last.ise == pytest.approx(0.25 * 0.02)
    assert math.isnan(run([math.nan], [1.0]).residual)


def test_arrays_that_do_not_fit_are_refused():
    with pytest.raises(StationError, match="cannot compare"):
        score(np.zeros(3), np.zeros(4), 0.02)
    with pytest.raises(StationError, match="nothing to compare"):
        score(np.full(3, np.nan), np.zeros(3), 0.02)
    with pytest.raises(StationError, match="window"):
        Comparison(0.02, 0.001)


@settings(max_examples=80, deadline=None)
@given(VALUES)
def test_the_compensated_sum_is_nearly_exact(values):
    total = CompensatedSum()
    for value in values:
        total = total.add(value)
    exact = math.fsum(values)
    assert abs(total.value - exact) <= 4e-16 * abs(exact) + 1e-28 * sum(map(abs, values))


@settings(max_examples=80, deadline=None)
@given(VALUES, st.integers(1, 20))
def test_the_window_sum_keeps_no_trace_of_what_left_it(values, length):
    window = WindowSum(length)
    for count, value in enumerate(values, 1):
        window = window.add(abs(value))
        inside = [Fraction(abs(each)) for each in values[max(0, count - length) : count]]
        assert window.count == len(inside)
        assert window.value == pytest.approx(float(sum(inside)), rel=1e-14)
