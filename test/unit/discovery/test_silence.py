"""Where refitted parameters leave so little that no name is needed, and what is said then."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from cases import Case, make

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import ModelSpec
from dt_station_nodes.discovery import DiscoverySettings, Verdict
from dt_station_nodes.discovery.channel import take_measure
from dt_station_nodes.discovery.problem import make_problem
from dt_station_nodes.discovery.selection import Bench, fit_null
from dt_station_nodes.discovery.silence import as_parameters, silent_verdict
from dt_station_nodes.discovery.terms import nominal_terms

PAPER = ModelSpec.from_yaml((Path(__file__).resolve().parents[3] / "config/models/paper.yaml").read_text())
PATH = PAPER.paths[Channel.POSITION]


def examined(case: Case) -> tuple[Verdict, bool]:
    """What is said where no effect earns a name, and whether refitted parameters are all there is."""
    problem = make_problem(make(case), PAPER, Channel.POSITION, DiscoverySettings())
    bench = Bench(problem, nominal_terms(PATH, problem.signal))
    null = fit_null(bench, PATH)
    measure = take_measure(bench, [null])
    given = problem.residual(PATH)
    return silent_verdict(bench, given, null, measure), as_parameters(null, given, measure)


def test_a_right_model_lacks_nothing() -> None:
    assert examined(Case(seconds=24.0))[0] is Verdict.NOTHING_MISSING


@pytest.mark.parametrize(("gain", "time"), [(0.05, 0.0), (0.0, 0.1), (-0.08, 0.15)])
def test_a_model_that_is_off_is_its_parameters(gain: float, time: float) -> None:
    assert examined(Case(gain_error=gain, time_error=time, seconds=24.0)) == (Verdict.PARAMETERS_ONLY, True)


@pytest.mark.parametrize("effect", [("dead_zone", "position", 1.0), ("delay", "position", 1.0)])
def test_what_a_refit_does_not_take_away_is_no_parameter(effect: tuple[str, str, float]) -> None:
    verdict, parameters = examined(Case((effect,), gain_error=0.05, seconds=24.0))
    assert verdict is Verdict.UNEXPLAINED
    assert not parameters
