"""Where a mode begins: narrow ones, whose phase a fit from beside them never finds."""

import numpy as np

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import ModelSpec, PathSpec, PlantModel
from dt_station_nodes.core.models.effects import Attachment
from dt_station_nodes.core.run import Run
from dt_station_nodes.discovery import DiscoverySettings
from dt_station_nodes.discovery.candidates import Candidate, add_effect
from dt_station_nodes.discovery.mode_starts import mode_starts
from dt_station_nodes.discovery.problem import make_problem

PATH = PathSpec(numerator=[6.0], denominator=[1.0, 3.0])
ARM = ModelSpec(name="arm", paths={Channel.PRESSURE: PATH})
MODE = Candidate("resonance", Attachment.OUTPUT)
STEP_S = 0.05
TRUE = {"frequency_hz": 0.71, "damping": 0.012, "share": 0.03, "riding": 0.05}


def shaken(path: PathSpec) -> Run:
    """A path under steps of a seeded size each second."""
    volts = np.repeat(np.random.default_rng(5).uniform(-1.0, 1.0, 30), 20)
    plant = PlantModel(ARM.model_copy(update={"paths": {Channel.PRESSURE: path}}), STEP_S)
    out = plant.simulate(volts, np.zeros(len(volts)), state=plant.initial_state())
    return Run(STEP_S, {"load_voltage_v": volts, "pressure_pa": out.pressure_pa})


def test_a_narrow_mode_begins_where_it_is_with_its_size_and_phase() -> None:
    problem = make_problem(shaken(add_effect(PATH, MODE, TRUE)), ARM, Channel.PRESSURE, DiscoverySettings())
    bare = problem.residual(PATH)
    starts = mode_starts(problem, PATH, MODE)
    best = min(starts, key=lambda start: float(np.sum(np.square(problem.residual(start)))))
    left = problem.residual(best)
    assert float(left @ left) < 0.2 * float(bare @ bare)
    numbers = best.effect("resonance").parameters
    assert abs(numbers["frequency_hz"] - TRUE["frequency_hz"]) < 0.5 / problem.length_s
    assert numbers["share"] * TRUE["share"] > 0.0
    assert numbers["riding"] * TRUE["riding"] > 0.0


def test_only_a_mode_within_the_path_begins_so() -> None:
    problem = make_problem(shaken(PATH), ARM, Channel.PRESSURE, DiscoverySettings())
    assert mode_starts(problem, PATH, Candidate("dead_zone")) == []
    assert mode_starts(problem, PATH, Candidate("resonance", Attachment.OUTPUT, apart=True)) == []
