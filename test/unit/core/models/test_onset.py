"""What begins in the course of a run: none of it before, all of it in the end, whatever the step of the simulation."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dt_station_nodes.core.models.compiled import SUBSTEP, TIME
from dt_station_nodes.core.models.onset import come


def shares(step_s: float, time_s: float, lag_s: float, even: float, until_s: float = 12.0) -> np.ndarray:
    c = np.zeros(64)
    c[SUBSTEP] = step_s
    found = []
    for index in range(round(until_s / step_s)):
        c[TIME] = index * step_s
        found.append(come(c, time_s, lag_s, even))
    return np.array(found)


@given(st.floats(1.0, 4.0), st.floats(0.0, 0.5), st.floats(0.0, 1.0))
def test_it_comes_once_and_stays(time_s: float, lag_s: float, even: float) -> None:
    share = shares(0.01, time_s, lag_s, even)
    assert np.all(np.diff(share) > -1e-9)
    assert share[0] == pytest.approx(0.0, abs=0.2)
    assert share[-1] == pytest.approx(1.0, abs=1e-6)


@given(st.floats(1.0, 4.0), st.floats(0.0, 0.5), st.floats(0.0, 1.0))
def test_a_step_holds_the_mean_of_its_parts(time_s: float, lag_s: float, even: float) -> None:
    fine = shares(0.01, time_s, lag_s, even)
    assert shares(0.05, time_s, lag_s, even) == pytest.approx(fine.reshape(-1, 5).mean(axis=1), abs=1e-9)


def test_by_first_order_it_begins_at_its_time_and_evenly_it_is_half_there() -> None:
    by_first_order, evenly = shares(0.01, 3.0, 0.4, 0.0), shares(0.01, 3.0, 0.4, 1.0)
    assert by_first_order[:300] == pytest.approx(np.zeros(300), abs=1e-12)
    assert by_first_order[339:341].mean() == pytest.approx(1.0 - np.exp(-1.0), rel=1e-4)
    assert evenly[299:301].mean() == pytest.approx(0.5, rel=1e-4)
    assert evenly[:300] == pytest.approx(1.0 - evenly[300:600][::-1], abs=1e-9)
