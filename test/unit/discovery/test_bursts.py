"""Bursts read off a residual: what was put in comes out, and what is always there, or noise, shows none."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dt_station_nodes.discovery.bursts import burst_start_s, bursts

STEP_S, SAMPLES = 0.02, 1200
TIME_S = np.arange(SAMPLES) * STEP_S


def sine(hertz: float) -> np.ndarray:
    return np.sin(2.0 * np.pi * hertz * TIME_S + 1.0) + 0.2 * np.random.default_rng(1).standard_normal(SAMPLES)


def on(period_s: float, share: float, start_s: float) -> np.ndarray:
    return ((TIME_S - start_s) / period_s) % 1.0 < share


@settings(max_examples=40, deadline=None)
@given(st.floats(3.0, 9.0), st.floats(0.25, 0.7), st.floats(0.0, 1.0), st.floats(1.5, 8.0))
def test_bursts_are_found_where_they_were_put(period_s: float, share: float, begin: float, hertz: float) -> None:
    start_s = begin * period_s
    found = bursts(sine(hertz) * on(period_s, share, start_s), STEP_S, hertz)
    assert found is not None
    there = on(found.period_s, found.share, found.start_s)
    assert np.mean(there == on(period_s, share, start_s)) > 0.9


@pytest.mark.parametrize("residual", [sine(2.0), np.random.default_rng(3).standard_normal(SAMPLES), 0.0 * TIME_S])
def test_what_never_pauses_has_no_bursts(residual: np.ndarray) -> None:
    assert bursts(residual, STEP_S, 2.0) is None


def test_the_start_of_known_bursts_is_found() -> None:
    residual = sine(2.0) * on(5.0, 0.4, 1.3)
    assert burst_start_s(residual, STEP_S, 2.0, 5.0, 0.4) == pytest.approx(1.3, abs=0.1)
