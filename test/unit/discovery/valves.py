"""Runs of a pressure valve at which another voltage acts than is given."""

from pathlib import Path

import numpy as np

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import ModelSpec, PathSimulator
from dt_station_nodes.core.run import Run

MODEL = Path(__file__).parents[3] / "config" / "models" / "paper.yaml"
PAPER = ModelSpec.from_yaml(MODEL.read_text(encoding="utf-8"))
BARE = PAPER.paths[Channel.PRESSURE].model_copy(update={"effects": ()})
SPEC = ModelSpec(name="valve", paths={Channel.PRESSURE: BARE})
TIME_S = 0.02 * np.arange(1200)
WAVES = (np.sin(2.0 * np.pi * 0.31 * TIME_S), np.abs((0.37 * TIME_S) % 2.0 - 1.0) * 2.0 - 1.0)


def answered(given: np.ndarray, acts: np.ndarray, wave: int) -> Run:
    """The run of a valve at which another voltage acts than is given."""
    pressure = PathSimulator(Channel.PRESSURE, 0.02, acts, np.zeros(0), 1e6, 1e6).simulate(BARE)
    noise = 0.01 * np.std(pressure) * np.random.default_rng(wave).standard_normal(pressure.size)
    return Run(0.02, {"load_voltage_v": given, "pressure_pa": pressure + noise})
