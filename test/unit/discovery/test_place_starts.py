"""Where effects that belong to a place begin."""

import numpy as np
import pytest

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import ModelSpec, PathSpec
from dt_station_nodes.core.models.effects import registry
from dt_station_nodes.core.run import Run
from dt_station_nodes.discovery.place_starts import limit_starts, stop_starts, store_starts
from dt_station_nodes.discovery.problem import make_problem
from dt_station_nodes.discovery.settings import DiscoverySettings

TANK = ModelSpec(name="tank", paths={Channel.POSITION: PathSpec(numerator=[0.02], denominator=[1.0, 0.02], rest=0.0)})


@pytest.mark.parametrize("rest", [0.0, -4.0])
def test_a_store_begins_about_the_runs_levels_wherever_the_linear_path_rests(rest: float) -> None:
    """Between its lowest level and nothing: the outflow's root is real at every level of the run."""
    seconds = 2.0 * np.arange(600)
    level = 4.0 + 1.5 * np.sin(0.01 * seconds)
    run = Run(2.0, {"servo_voltage_v": 1.0 + 0.3 * np.sin(0.01 * seconds + 0.8), "position_m": level})
    problem = make_problem(run, TANK, Channel.POSITION, DiscoverySettings())
    path = TANK.paths[Channel.POSITION].model_copy(update={"rest": rest})
    effect = registry()["square_root_outflow"]
    (reference,) = store_starts(problem, path, effect.parameter("reference"))
    assert rest + reference == pytest.approx(float(level.mean()))
    for curvature in store_starts(problem, path, effect.parameter("curvature")):
        under_the_root = 1.0 + 2.0 * curvature * (level - rest - reference)
        assert 0.0 < under_the_root.min() < 0.9


@pytest.mark.parametrize(
    ("working_v", "lower", "upper"), [(2.0, True, False), (-2.0, False, True), (0.0, False, False)]
)
def test_a_limit_begins_within_the_voltages_of_a_run_on_one_side_of_zero(
    working_v: float, lower: bool, upper: bool
) -> None:
    """About a working voltage either limit may cut off a part of the range, about zero the usual ones do."""
    seconds = 0.02 * np.arange(900)
    voltage = working_v + np.sin(2.0 * seconds)
    run = Run(0.02, {"load_voltage_v": voltage, "pressure_pa": 1e6 * (3.0 + 0.3 * np.sin(2.0 * seconds - 0.2))})
    lag = ModelSpec(name="lag", paths={Channel.PRESSURE: PathSpec(numerator=[1e6], denominator=[0.1, 1.0], rest=0.0)})
    problem = make_problem(run, lag, Channel.PRESSURE, DiscoverySettings())
    saturation = registry()["saturation"]
    for name, cut_off in (("lower_v", lower), ("upper_v", upper)):
        limit = saturation.parameter(name)
        starts = limit_starts(problem, limit, 3.0)
        within = [start for start in starts if voltage.min() < start < voltage.max()]
        if cut_off:
            assert len(within) >= 4
        else:
            assert starts == [3.0 * start for start in limit.starts]
        side = 1.0 if name == "upper_v" else -1.0
        assert all(side * (start - voltage.mean()) > 0.0 for start in limit_starts(problem, limit, 3.0, about=True))


@pytest.mark.parametrize(("damping", "swings"), [(19.2, True), (30.0, False)])
def test_only_a_mass_on_a_spring_has_stops_about_the_ends_of_its_way(damping: float, swings: bool) -> None:
    """It stands still there; with real poles alone it may as well be a store."""
    path = PathSpec(numerator=[0.576], denominator=[1.0, damping, 144.0], rest=0.5)
    seconds = 0.02 * np.arange(900)
    way = 0.5 + 0.012 * np.sin(2.0 * seconds)
    run = Run(0.02, {"servo_voltage_v": 3.0 * np.sin(2.0 * seconds + 0.2), "position_m": way})
    axis = ModelSpec(name="axis", paths={Channel.POSITION: path})
    problem = make_problem(run, axis, Channel.POSITION, DiscoverySettings())
    limits, standing = (
        stop_starts(problem, path, registry()["overflow"].parameter(name), 1.0) for name in ("limit", "standing")
    )
    assert standing == ([1.0] if swings else [0.0])
    assert any(0.008 < limit < 0.012 for limit in limits) is swings


def test_a_pressure_that_swings_may_have_a_valve_that_lets_off() -> None:
    volts = 2.0 + np.sin(1.7 * 0.02 * np.arange(900))
    path = PathSpec(numerator=[144.0], denominator=[1.0, 6.0, 144.0])
    run = Run(0.02, {"load_voltage_v": volts, "pressure_pa": volts})
    spec = ModelSpec(name="valve", paths={Channel.PRESSURE: path})
    problem = make_problem(run, spec, Channel.PRESSURE, DiscoverySettings())
    assert stop_starts(problem, path, registry()["overflow"].parameter("standing"), 1.0) == [0.0, 1.0]
