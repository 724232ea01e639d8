"""What looks like a disturbance of its own and comes with what excites the run."""

import sys
from dataclasses import replace
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from cases import Case, make

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import ModelSpec
from dt_station_nodes.discovery.measure import Measure
from dt_station_nodes.discovery.problem import make_problem
from dt_station_nodes.discovery.recurring import recurring
from dt_station_nodes.discovery.selection import Bench, Explanation, fit_null
from dt_station_nodes.discovery.settings import DiscoverySettings
from dt_station_nodes.discovery.terms import nominal_terms

PAPER = ModelSpec.from_yaml((Path(__file__).resolve().parents[3] / "config/models/paper.yaml").read_text())


@pytest.fixture(scope="module")
def fitted() -> tuple[Measure, Explanation]:
    """A run in which nothing is missing that is excited at 0.5 Hz, its null, and the measure that this gives."""
    path = PAPER.paths[Channel.POSITION]
    problem = make_problem(make(Case(seconds=12.0)), PAPER, Channel.POSITION, DiscoverySettings())
    bench = Bench(replace(problem, excitations_hz=(0.5,)), nominal_terms(path, problem.signal))
    null = fit_null(bench, path)
    return Measure(bench, bench.floors(null), float(len(problem.measured)), rough=False), null


def shaken(null: Explanation, **numbers: float) -> Explanation:
    """The null with a disturbance of these numbers."""
    sine = {"amplitude": 0.01, "phase_rad": 0.0, **numbers}
    path = PAPER.with_effect(Channel.POSITION, "periodic_disturbance", sine).paths[Channel.POSITION]
    return replace(null, added=("periodic_disturbance",), fit=replace(null.fit, path=path))


@pytest.mark.parametrize(
    ("order", "turns", "kept"), [(3, 0.0, False), (3, 0.1, False), (3, 0.4, True), (3, 2.0, True), (2.5, 0.0, True)]
)
def test_a_disturbance_is_told_from_a_harmonic_by_part_of_a_turn(
    fitted: tuple[Measure, Explanation], order: float, turns: float, kept: bool
) -> None:
    measure, null = fitted
    found = shaken(null, frequency_hz=0.5 * order + turns / measure.bench.problem.length_s)
    assert recurring([found], [null], measure) == ([found] if kept else [])


@pytest.mark.parametrize(("period_s", "kept"), [(2.0, False), (1.0, False), (2.4, True)])
def test_bursts_with_each_period_of_the_excitation_are_its_answer(
    fitted: tuple[Measure, Explanation], period_s: float, kept: bool
) -> None:
    measure, null = fitted
    found = shaken(null, frequency_hz=6.43, burst_period_s=period_s, burst_share=0.1)
    assert recurring([found], [null], measure) == ([found] if kept else [])
