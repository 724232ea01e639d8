"""What bends or ends a valve's curve about the voltage it works at is named by itself, with its numbers."""

from pathlib import Path

import numpy as np
import pytest

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import ModelSpec, PathSimulator
from dt_station_nodes.core.run import Run
from dt_station_nodes.discovery import discover

PAPER = ModelSpec.from_yaml((Path(__file__).parents[3] / "config" / "models" / "paper.yaml").read_text("utf-8"))
LINEAR = PAPER.paths[Channel.PRESSURE].model_copy(update={"effects": ()})
VALVE = PAPER.model_copy(update={"paths": {Channel.PRESSURE: LINEAR}})


def run(hidden: ModelSpec, hertz: float, seed: int) -> Run:
    path, second = hidden.paths[Channel.PRESSURE], 0.02 * np.arange(900)
    voltage = 2.0 + 0.7 * np.sin(2.0 * np.pi * hertz * second) + 0.3 * np.sin(2.0 * np.pi * 1.7 * hertz * second)
    pressure = PathSimulator(Channel.PRESSURE, 0.02, voltage, np.zeros(0), path.rest, path.rest).simulate(path)
    noise = 0.003 * pressure.std() * np.random.default_rng(seed).standard_normal(pressure.size)
    return Run(0.02, {"load_voltage_v": voltage, "pressure_pa": pressure + noise})


@pytest.mark.parametrize(
    ("name", "numbers"),
    [
        ("saturation", {"upper_v": 1e9, "lower_v": 1.4}),
        ("saturation", {"upper_v": 5.1, "lower_v": -0.9, "straight": 0.0, "centre_v": 2.1}),
        ("asymmetric_gain", {"asymmetry": -0.3, "centre_v": 1.6, "rounding_v": 0.2, "of_slope": 1.0}),
        ("asymmetric_gain", {"asymmetry": 0.13, "centre_v": 1.9, "through_zero": -1.0}),
        ("asymmetric_gain", {"asymmetry": 0.13, "centre_v": 1.7, "through_zero": -0.3}),
    ],
    ids=["a lower limit above zero", "a soft limit", "a rounded slope", "less below", "more and less"],
)
def test_a_curve_about_a_working_voltage_has_one_name(name: str, numbers: dict[str, float]) -> None:
    hidden = VALVE.with_effect(Channel.PRESSURE, name, numbers)
    result = discover(run(hidden, 0.35, 1), VALVE, validation=run(hidden, 0.23, 2))
    (effect,) = result.effects
    assert effect.name == name
    after, floor = (gaps[Channel.PRESSURE].rms for gaps in (result.gap.after, result.gap.noise_floor))
    assert after < 1.1 * floor
