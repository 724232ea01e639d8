import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

from dt_station_nodes.identification.propagation import exponential, filter_held, filter_smooth
from support.known_systems import DISTURBANCE, PRESSURE, response, switching


@settings(max_examples=40, deadline=None)
@given(st.integers(1, 9), st.floats(0.01, 20.0), st.integers(0, 2**31))
def test_exponential_is_scipys(size, scale, seed):
    matrix = scale * (np.random.default_rng(seed).normal(size=(size, size)) - 2.0 * np.eye(size))
    wanted = expm(matrix)
    assert np.abs(exponential(matrix) - wanted).max() <= 1e-10 * max(np.abs(wanted).max(), 1e-300)


@pytest.mark.parametrize(("transfer", "smooth"), [(PRESSURE, False), (DISTURBANCE, True)])
def test_filters_give_what_scipy_gives(transfer, smooth):
    signal = switching(400, 7, -1.0, 2.0, 5)
    bank = (filter_smooth if smooth else filter_held)(np.array(transfer.denominator), signal, 0.02)
    ours = np.array(transfer.numerator)[::-1] @ bank[: len(transfer.numerator)]
    assert ours == pytest.approx(response(transfer, signal, smooth), rel=1e-6, abs=1e-7)
