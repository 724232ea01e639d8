"""Free numbers of an effect: bounds by what the run shows, units by what a parameter measures."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))

from cases import Case, make

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import ModelSpec
from dt_station_nodes.core.models.effects import Attachment, Parameter, Quantity, registry
from dt_station_nodes.core.run import Run
from dt_station_nodes.discovery.effect_terms import effect_term, unit_of
from dt_station_nodes.discovery.problem import Problem, make_problem
from dt_station_nodes.discovery.settings import DiscoverySettings

PAPER = ModelSpec.from_yaml((Path(__file__).resolve().parents[3] / "config/models/paper.yaml").read_text())


def problem_of(run: Run) -> Problem:
    return make_problem(run, PAPER, Channel.POSITION, DiscoverySettings())


def test_modes_are_looked_for_up_to_what_the_samples_can_show():
    """The same rows, said to come ten times as fast or a hundred times as slow, on the path that they had."""
    run = make(Case())
    frequency = registry()["resonance"].parameter("frequency_hz")

    def highest_hz(sample_s: float) -> float:
        problem = problem_of(Run(sample_s, run.signals))
        return effect_term(problem, 0, frequency, Attachment.OUTPUT).bounds[1]

    as_usual = highest_hz(run.sample_time_s)
    assert np.isclose(np.exp(as_usual), 20.0)
    assert np.isclose(np.exp(highest_hz(0.1 * run.sample_time_s)), 200.0)
    assert np.exp(highest_hz(100.0 * run.sample_time_s)) < 2.0


@pytest.mark.parametrize(
    ("quantity", "power"), [(Quantity.SIGNAL, 1), (Quantity.PER_SIGNAL, -1), (Quantity.PER_SIGNAL_SQUARED, -2)]
)
def test_what_a_signal_measures_is_the_voltage_at_the_input_and_the_output_behind_the_path(quantity, power):
    problem = problem_of(make(Case()))
    parameter = Parameter("some", quantity, "something", 0.0, 1.0, (0.5,))
    at_input, behind = (unit_of(problem, parameter, at) for at in (Attachment.INPUT, Attachment.OUTPUT))
    assert np.isclose(at_input, problem.scales[Quantity.INPUT] ** power)
    assert np.isclose(behind, problem.scales[Quantity.OUTPUT] ** power)
    assert parameter.unit(Channel.POSITION, Attachment.INPUT) == {1: "V", -1: "1/V", -2: "1/V^2"}[power]
    assert parameter.unit(Channel.POSITION, Attachment.OUTPUT) == {1: "m", -1: "1/m", -2: "1/m^2"}[power]
