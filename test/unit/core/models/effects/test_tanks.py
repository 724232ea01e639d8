"""Two stores in a row against their own equations, integrated finely here: overflow, spill and square-root outflow."""

import math

import numpy as np
import pytest

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import ModelSpec, Outlet, PathSpec, PlantModel

TS = 0.5
SLOW, FAST = 20.0, 8.0
TIME = np.arange(600) * TS
INFLOW = 2.0 + 2.0 * np.sin(2 * math.pi * TIME / 120.0)


def tanks(upper: float, lower: float, rim: float, spill_share: float) -> np.ndarray:
    """Upper store (time constant `upper`) with a rim over a lower one; explicit Euler at a hundredth of a sample."""
    a = y = 0.0
    h = TS / 100
    levels = []
    for inflow in INFLOW:
        levels.append(y)
        for _ in range(100):
            filled = a + h / upper * (inflow - a)
            spilled = max(filled - rim, 0.0)
            y += h / lower * (a - y) + spill_share * spilled * upper / lower
            a = filled - spilled
    return np.array(levels)


def simulate(outlet: Outlet, name: str, parameters: dict[str, float], inflow: np.ndarray = INFLOW) -> np.ndarray:
    path = PathSpec(numerator=[1.0], denominator=[SLOW * FAST, SLOW + FAST, 1.0], outlet=outlet)
    spec = ModelSpec(name="tanks", paths={Channel.POSITION: path}).with_effect(Channel.POSITION, name, parameters)
    return PlantModel(spec, TS).simulate(0 * inflow, inflow).position_m


@pytest.mark.parametrize("share", [0.0, 0.6])
@pytest.mark.parametrize("outlet", list(Outlet))
def test_the_upper_store_overflows_and_spills(outlet, share):
    upper, lower = (SLOW, FAST) if outlet is Outlet.FASTEST else (FAST, SLOW)
    ours = simulate(outlet, "overflow", {"limit": 1e9, "inlet_limit": 2.5, "spill": share})
    theirs = tanks(upper, lower, 2.5, share)
    assert np.ptp(theirs) > 1.0
    assert np.abs(ours - theirs).max() < 0.02


def test_nothing_is_lost_where_all_spill_falls_into_the_next_store():
    until_empty = np.concatenate([INFLOW, np.zeros(600)])
    whole = simulate(Outlet.FASTEST, "overflow", {"limit": 1e9, "inlet_limit": 1e9}, until_empty)
    spilled = simulate(Outlet.FASTEST, "overflow", {"limit": 1e9, "inlet_limit": 2.5, "spill": 1.0}, until_empty)
    assert np.sum(spilled) == pytest.approx(np.sum(whole), rel=1e-4)


def test_a_store_empties_along_a_parabola():
    curvature, reference = 0.2, 1.0
    path = PathSpec(numerator=[1.0], denominator=[SLOW, 1.0])
    spec = ModelSpec(name="tank", paths={Channel.POSITION: path})
    spec = spec.with_effect(Channel.POSITION, "square_root_outflow", {"curvature": curvature, "reference": reference})
    model = PlantModel(spec, TS)
    state = model.initial_state(position_m=6.0)
    # no inflow but the one that keeps the law's datum: the linear outflow at the reference level
    level = model.simulate(np.zeros(40), np.full(40, reference - 1 / curvature), state=state).position_m
    head = level - (reference - 1 / (2 * curvature))
    assert np.allclose(np.diff(np.sqrt(head), n=2), 0.0, atol=1e-5)
    assert np.diff(np.sqrt(head))[0] < -0.01


@pytest.mark.parametrize("inflow", [0.0, 1.0, 3.0])
def test_stores_empty_at_rest_settle_at_the_square_of_their_inflow(inflow):
    curvature = 0.4
    numbers = {"curvature": curvature, "reference": 0.5 / curvature, "inlet_curvature": curvature, "empty": 1.0}
    level = simulate(Outlet.SLOWEST, "square_root_outflow", numbers, np.full(2000, inflow))
    assert level[-1] == pytest.approx(0.5 * curvature * inflow**2, abs=1e-3)
