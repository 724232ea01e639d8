"""A second-order element over one step."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm

from dt_station_nodes.core.models.second_order import swing


@given(st.floats(0.0, 50.0), st.floats(0.1, 200.0), st.floats(1e-4, 0.1))
def test_a_step_is_that_of_the_state_matrix_however_damped(damping: float, natural: float, step: float) -> None:
    rate = damping * natural
    cosine, sine = swing(rate, natural, step)
    found = np.array([[cosine + rate * sine, sine], [-(natural**2) * sine, cosine - rate * sine]])
    exact = expm(step * np.array([[0.0, 1.0], [-(natural**2), -2.0 * rate]]))
    assert found == pytest.approx(exact, rel=1e-5, abs=1e-7 * max(natural, 1.0 / natural, 1.0))


def test_heavy_damping_neither_overflows_nor_moves() -> None:
    cosine, sine = swing(1e6, 1.0, 1.0)
    assert np.isfinite([cosine, sine]).all()
    assert cosine + 1e6 * sine == pytest.approx(1.0, rel=1e-5)
