"""What is fed back within a sample is neither early nor late."""

import numpy as np
import pytest
from numpy.typing import NDArray

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import EffectSpec, PathSpec
from dt_station_nodes.core.models.effects import registry
from dt_station_nodes.core.models.single import PathSimulator

Array = NDArray[np.float64]
TIME = np.arange(600) * 0.02
VOLTS = 2.0 * np.sin(1.9 * TIME) + np.where(np.sin(3.7 * TIME) > 0.0, 1.0, -1.0)
SWINGING = PathSpec(numerator=(900.0,), denominator=(1.0, 9.0, 900.0))
LAG = PathSpec(numerator=(5.0,), denominator=(1.0, 5.0))
PISTON = PathSpec(numerator=(20.0,), denominator=(1.0, 20.0, 0.0))
FED_BACK = [
    (Channel.PRESSURE, SWINGING, "leakage", {"coefficient": 2.0, "base": 1.0}),
    (Channel.PRESSURE, SWINGING, "cubic_stiffness", {"coefficient": 0.1}),
    (Channel.PRESSURE, SWINGING, "cubic_stiffness", {"coefficient": 0.1, "lead_s": 0.01, "stiffening": 0.05}),
    (Channel.PRESSURE, SWINGING, "load_dependent_gain", {"per_load": 0.05}),
    (Channel.PRESSURE, SWINGING, "trapped_air", {"softness_s": 0.1, "stiffening": 0.5}),
    (Channel.PRESSURE, SWINGING, "overflow", {"limit": 1.0, "weir_s": 0.02}),
    (Channel.PRESSURE, SWINGING, "overflow", {"limit": 1.0, "weir_s": 0.02, "opening_s": 0.03}),
    (Channel.PRESSURE, LAG, "leakage", {"coefficient": 2.0, "base": 1.0}),
    (Channel.PRESSURE, LAG, "cubic_stiffness", {"coefficient": 0.1}),
    (Channel.PRESSURE, LAG, "square_root_outflow", {"curvature": 0.1, "reference": 0.5}),
    (Channel.POSITION, PISTON, "cubic_stiffness", {"coefficient": 0.3}),
    (Channel.POSITION, PISTON, "leakage", {"sag_per_s": 0.5}),
    (Channel.POSITION, PISTON, "quadratic_damping", {"coefficient": 0.1}),
    (Channel.POSITION, PISTON, "stroke_dependent_gain", {"slope": 0.1}),
]


def simulator(channel: Channel) -> PathSimulator:
    return PathSimulator(channel, 0.02, VOLTS, np.zeros(0), 0.0, 0.0)


def with_effect(path: PathSpec, name: str, given: dict[str, float]) -> PathSpec:
    numbers = {parameter.name: parameter.neutral for parameter in registry()[name].parameters} | given
    return path.model_copy(update={"effects": (EffectSpec(name=name, parameters=numbers),)})


def off(simulate: PathSimulator, path: PathSpec, steps: int, exact: Array) -> float:
    return float(np.std(simulate._simulate(path, steps) - exact))


@pytest.mark.parametrize(("channel", "path", "name", "given"), FED_BACK)
def test_errors_fall_with_the_square_of_the_sub_step(
    channel: Channel, path: PathSpec, name: str, given: dict[str, float]
) -> None:
    simulate, bent = simulator(channel), with_effect(path, name, given)
    exact = simulate._simulate(bent, 128)
    assert off(simulate, bent, 8, exact) < 0.3 * off(simulate, bent, 4, exact)


@pytest.mark.parametrize(("channel", "path", "name", "given"), FED_BACK)
def test_the_usual_sub_steps_leave_next_to_nothing_of_an_effect_out(
    channel: Channel, path: PathSpec, name: str, given: dict[str, float]
) -> None:
    simulate, bent = simulator(channel), with_effect(path, name, given)
    exact = simulate._simulate(bent, 128)
    acts = float(np.std(exact - simulate.simulate(path)))
    assert float(np.std(simulate.simulate(bent) - exact)) < 0.02 * acts


@pytest.mark.parametrize(("channel", "path", "name", "given"), [row for row in FED_BACK if row[0] is Channel.PRESSURE])
def test_where_a_path_stands_does_not_depend_on_its_sub_steps(
    channel: Channel, path: PathSpec, name: str, given: dict[str, float]
) -> None:
    simulate = PathSimulator(channel, 0.02, np.full(600, 1.5), np.zeros(0), 0.0, 0.0)
    bent = with_effect(path, name, given)
    assert simulate._simulate(bent, 2)[-1] == pytest.approx(simulate._simulate(bent, 64)[-1], rel=1e-3)
