"""A ripple or an offset of the pressure is named once, on the pressure."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))

from cases import Case, make

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import ModelSpec
from dt_station_nodes.core.run import Run
from dt_station_nodes.discovery import discover

HERTZ = 2.3
MODEL = Path(__file__).parents[3] / "config" / "models" / "paper.yaml"
PAPER = ModelSpec.from_yaml(MODEL.read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def rippled() -> Run:
    """A run whose pressure sensor carries a ripple, which drives the model of the position too."""
    run = make(Case(shape="triangle", seed=3, seconds=24.0))
    time_s = np.arange(len(run)) * run.sample_time_s
    ripple = 4.0e5 * np.sin(2.0 * np.pi * HERTZ * time_s + 0.4)
    return Run(run.sample_time_s, {**run.signals, "pressure_pa": run.signals["pressure_pa"] + ripple}, source="ripple")


def test_a_ripple_of_the_pressure_is_not_named_on_the_position(rippled: Run) -> None:
    result = discover(rippled, PAPER, jobs=2)
    assert [(e.name, e.channel) for e in result.effects] == [("periodic_disturbance", Channel.PRESSURE)]
    assert result.effects[0].parameters["frequency_hz"].value == pytest.approx(HERTZ, rel=1e-2)


def test_a_disturbance_of_the_position_alone_is_named_there() -> None:
    result = discover(make(Case((("periodic_disturbance", "position", 1.0),), "square", seed=3)), PAPER, jobs=2)
    assert [(e.name, e.channel) for e in result.effects] == [("periodic_disturbance", Channel.POSITION)]


def test_a_pressure_read_too_high_is_no_drift_of_the_position() -> None:
    run = make(Case(shape="triangle", seed=3, seconds=24.0))
    high = Run(run.sample_time_s, {**run.signals, "pressure_pa": run.signals["pressure_pa"] + 2.0e6}, source="high")
    assert {e.channel for e in discover(high, PAPER, jobs=2).effects} == {Channel.PRESSURE}
