"""Runs of a piston, as on two voltage levels, which hide what another waveform shows, and sets fitted to them."""

from collections.abc import Mapping
from pathlib import Path
from typing import cast

import numpy as np

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import ModelSpec, PathSimulator, PathSpec
from dt_station_nodes.core.run import Run
from dt_station_nodes.discovery import DiscoverySettings
from dt_station_nodes.discovery.candidates import Candidate, Freed, add_effect, hypothesis
from dt_station_nodes.discovery.hypothesis_fit import fit_hypothesis
from dt_station_nodes.discovery.problem import Problem, make_problem
from dt_station_nodes.discovery.selection import Bench, Explanation

MODEL = Path(__file__).parents[3] / "config" / "models" / "paper.yaml"
PAPER = ModelSpec.from_yaml(MODEL.read_text(encoding="utf-8"))
PATH = PAPER.paths[Channel.POSITION]
NOISE_M = 2e-4
TIME_S = np.arange(1200) * 0.02
TWO_LEVELS = 1.3 * np.where(TIME_S % 4.0 < 2.0, 1.0, -1.0)


def problem_of(path: PathSpec, given: np.ndarray, acts: np.ndarray, seed: int) -> Problem:
    """The paper's model before the run of a piston at which a voltage acts as another is given."""
    position = PathSimulator(Channel.POSITION, 0.02, acts, np.zeros(0), 1e6, 0.0).simulate(path)
    position += NOISE_M * np.random.default_rng(seed).standard_normal(TIME_S.size)
    run = Run(0.02, {"servo_voltage_v": given, "position_m": position})
    return make_problem(run, PAPER, Channel.POSITION, DiscoverySettings())


def fitted(bench: Bench, numbers: Mapping[str, Mapping[str, float]]) -> Explanation:
    """A set fitted from these numbers, which alone are free."""
    path, freed = PATH, cast("Freed", {name: tuple(own) for name, own in numbers.items()})
    for name, own in numbers.items():
        path = add_effect(path, Candidate(name), own)
    begin = hypothesis(bench.problem, path, bench.nominal, freed)
    return bench.explained(fit_hypothesis(bench.problem, begin, [begin.start()], bench.iterations), tuple(freed), freed)
