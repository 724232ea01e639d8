"""A ripple of the pressure, or what its sensor makes of it, is named once, on the pressure."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

sys.path.insert(0, str(Path(__file__).parent))

from cases import Case, make

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import ModelSpec
from dt_station_nodes.core.run import Run
from dt_station_nodes.discovery import DiscoverySettings, Verdict, discover
from dt_station_nodes.discovery.candidates import Candidate, add_effect, hypothesis
from dt_station_nodes.discovery.channel import Finding
from dt_station_nodes.discovery.echo import without_echo
from dt_station_nodes.discovery.hypothesis_fit import fit_hypothesis
from dt_station_nodes.discovery.problem import make_problem
from dt_station_nodes.discovery.selection import Bench, fit_null
from dt_station_nodes.discovery.terms import nominal_terms

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
    result = discover(rippled, PAPER)
    assert [(e.name, e.channel) for e in result.effects] == [("periodic_disturbance", Channel.PRESSURE)]
    assert result.effects[0].parameters["frequency_hz"].value == pytest.approx(HERTZ, rel=1e-2)


def test_a_disturbance_of_the_position_alone_is_named_there() -> None:
    result = discover(make(Case((("periodic_disturbance", "position", 1.0),), "square", seed=3)), PAPER)
    assert [(e.name, e.channel) for e in result.effects] == [("periodic_disturbance", Channel.POSITION)]


def test_a_pressure_read_too_high_is_no_drift_of_the_position() -> None:
    run = make(Case(shape="triangle", seed=3, seconds=24.0))
    high = Run(run.sample_time_s, {**run.signals, "pressure_pa": run.signals["pressure_pa"] + 2.0e6}, source="high")
    assert {e.channel for e in discover(high, PAPER).effects} == {Channel.PRESSURE}


def finding(run: Run, channel: Channel, name: str, **numbers: float) -> Finding:
    """What a channel says where it is named for one effect, begun at `numbers`."""
    bare = PAPER.paths[channel].model_copy(update={"effects": ()})
    problem = make_problem(run, PAPER, channel, DiscoverySettings())
    bench = Bench(problem, nominal_terms(bare, problem.signal))
    null, freed = fit_null(bench, bare), {name: tuple(numbers)}
    begun = hypothesis(problem, add_effect(bare, Candidate(name), numbers), bench.nominal, freed)
    best = bench.explained(fit_hypothesis(problem, begun), (name,), freed)
    given = problem.residual(bare)
    return Finding(problem, Verdict.NAMED, given, null, best, (best, null), (0.0, 1e3), ((),), 1e3, 1e3, 0.0, 1e-7)


def reading_late(run: Run, lag_s: float) -> Run:
    pressure, kept = run.signals["pressure_pa"], np.exp(-run.sample_time_s / lag_s)
    late = lfilter([1.0 - kept], [1.0, -kept], pressure - pressure[0]) + pressure[0]
    return Run(run.sample_time_s, {**run.signals, "pressure_pa": late}, source="late")


@pytest.mark.parametrize("reads_late", [True, False])
def test_only_what_a_pressure_read_late_makes_of_the_position_is_no_effect(reads_late: bool) -> None:
    """Whole discoveries named a dead zone on the position beside the sensor's lag."""
    case = Case((() if reads_late else (("dead_zone", "position", 1.0),)), "square", seed=3, seconds=24.0)
    run = reading_late(make(case), 0.4)
    earlier = finding(run, Channel.PRESSURE, "extra_lag", time_constant_s=0.3)
    there = finding(run, Channel.POSITION, "dead_zone", half_width_v=0.05)
    said = without_echo(there, [earlier])
    assert said.verdict is (Verdict.NOTHING_MISSING if reads_late else Verdict.NAMED)
    assert said.best is (there.null if reads_late else there.best)


def test_a_faint_effect_stays_where_the_pressure_read_right_explains_nothing_of_it() -> None:
    run = make(Case((("dead_zone", "position", 0.05),), "square", seed=3, seconds=24.0))
    earlier = finding(reading_late(run, 0.02), Channel.PRESSURE, "extra_lag", time_constant_s=0.02)
    there = finding(run, Channel.POSITION, "dead_zone", half_width_v=0.01)
    assert there.null.fit.rss < 1.1 * there.best.fit.rss
    assert without_echo(there, [earlier]) is there


@pytest.mark.parametrize("reads_late", [True, False])
def test_a_pressure_that_nothing_explains_may_be_what_its_sensor_makes_up(reads_late: bool) -> None:
    case = Case((() if reads_late else (("dead_zone", "position", 1.0),)), "square", seed=3, seconds=24.0)
    run = reading_late(make(case), 0.4)
    named = finding(run, Channel.PRESSURE, "extra_lag", time_constant_s=0.3)
    unclear = replace(named, verdict=Verdict.UNEXPLAINED, best=named.null)
    there = finding(run, Channel.POSITION, "dead_zone", half_width_v=0.05)
    assert without_echo(there, [unclear]).verdict is (Verdict.NOTHING_MISSING if reads_late else Verdict.NAMED)
