"""The flat of a valve's curve shows in a residual, wherever it lies."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))

from valves import BARE, SPEC, WAVES, answered

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.run import Run
from dt_station_nodes.discovery import Verdict, discover
from dt_station_nodes.discovery.problem import make_problem
from dt_station_nodes.discovery.settings import DiscoverySettings
from dt_station_nodes.discovery.valve_curve import flattest_v, kinks_v


def run(centre_v: float, half_width_v: float, wave: int) -> Run:
    """Pressure of a valve whose curve has a flat about a voltage, written as a clipped difference."""
    given = 2.0 + 1.2 * WAVES[wave]
    return answered(given, given - np.clip(given - centre_v, -half_width_v, half_width_v), wave)


@pytest.mark.parametrize(("centre_v", "half_width_v"), [(1.3, 0.2), (2.0, 0.05), (2.6, 0.4)])
def test_the_flat_is_where_it_was_made(centre_v: float, half_width_v: float) -> None:
    problem = make_problem(run(centre_v, half_width_v, 0), SPEC, Channel.PRESSURE, DiscoverySettings())
    found = flattest_v(problem, BARE, problem.residual(BARE), 1)
    assert all(abs(volts - centre_v) < half_width_v + 0.06 for volts in found)


@pytest.mark.parametrize("wave", [0, 1])
@pytest.mark.parametrize(("kink_v", "more"), [(1.5, 0.3), (2.4, -0.1)])
def test_the_kink_is_where_it_was_made(kink_v: float, more: float, wave: int) -> None:
    given = 2.0 + 1.2 * WAVES[wave]
    bent = answered(given, given + more * np.maximum(given - kink_v, 0.0), wave)
    problem = make_problem(bent, SPEC, Channel.PRESSURE, DiscoverySettings())
    assert min(abs(volts - kink_v) for volts in kinks_v(problem, BARE, problem.residual(BARE))) < 0.15


def test_a_dead_zone_about_a_working_voltage_is_named() -> None:
    found = discover(run(2.3, 0.06, 0), SPEC, validation=run(2.3, 0.06, 1))
    assert found.verdict is Verdict.NAMED
    assert [effect.name for effect in found.effects] == ["dead_zone"]
    numbers = found.effects[0].parameters
    assert numbers["half_width_v"].value == pytest.approx(0.06, rel=0.1)
    assert numbers["centre_v"].value == pytest.approx(2.3, abs=0.02)


def test_between_two_levels_a_kink_is_looked_for_in_the_middle() -> None:
    """A square wave dwells on either side of a kink and shows nothing of the curve between: fits near a level stay."""
    given = 2.0 + 1.2 * np.sign(WAVES[0])
    bent = answered(given, given - 0.06 * np.maximum(given - 2.3, 0.0), 0)
    problem = make_problem(bent, SPEC, Channel.PRESSURE, DiscoverySettings())
    assert min(abs(volts - 2.0) for volts in kinks_v(problem, BARE, problem.residual(BARE))) < 0.05
