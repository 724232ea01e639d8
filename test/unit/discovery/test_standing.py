"""What stands because its loop holds it is told from a sensor that froze."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import ModelSpec, PathSimulator
from dt_station_nodes.core.run import Run
from dt_station_nodes.discovery import DiscoverySettings
from dt_station_nodes.discovery.problem import make_problem
from dt_station_nodes.discovery.standing import stands

MODEL = Path(__file__).parents[3] / "config" / "models" / "paper.yaml"
PAPER = ModelSpec.from_yaml(MODEL.read_text(encoding="utf-8"))


def test_repeated_samples_are_a_frozen_sensor_unless_the_path_repeats_them() -> None:
    voltage = 2.0 + 1.5 * np.sin(np.arange(800) / 30.0)
    path = PAPER.with_effect(Channel.PRESSURE, "hysteresis", {"half_width_v": 0.6}).paths[Channel.PRESSURE]
    pressure = PathSimulator(Channel.PRESSURE, 0.02, voltage, np.zeros(0), 1e6, 1e6).simulate(path)
    frozen = np.abs(np.diff(pressure, prepend=0.0)) < 1e-3 * float(np.std(pressure))
    assert frozen.sum() > 50
    held = pressure.copy()
    held[300:360] = held[300]
    for measured, explained in ((pressure, True), (held, False)):
        run = Run(0.02, {"load_voltage_v": voltage, "pressure_pa": measured})
        problem = make_problem(run, PAPER, Channel.PRESSURE, DiscoverySettings())
        left_out = frozen if explained else np.arange(800) // 60 == 5
        assert stands(replace(problem, weights=np.where(left_out, 0.0, 1.0)), path) is explained
