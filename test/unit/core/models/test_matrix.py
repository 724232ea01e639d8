"""The matrix exponential against scipy's, and its group property."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

from dt_station_nodes.core.models.matrix import exponential


@settings(deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 8), st.floats(0.01, 8.0))
def test_agrees_with_scipy(seed, n, size):
    a = np.random.default_rng(seed).normal(size=(n, n)) * size / n
    theirs = expm(a)
    assert np.abs(exponential(a) - theirs).max() <= 1e-11 * max(1.0, np.abs(theirs).max())


def test_twice_the_time_is_the_square():
    a = np.array([[0.0, 1.0], [-400.0, -4.0]])
    assert np.allclose(exponential(0.02 * a), exponential(0.01 * a) @ exponential(0.01 * a), rtol=1e-13)


@pytest.mark.parametrize("n", [1, 3])
def test_nothing_moves_in_no_time(n):
    assert np.array_equal(exponential(np.zeros((n, n))), np.eye(n))
