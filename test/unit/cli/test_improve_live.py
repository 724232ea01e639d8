"""The rounds of `improve` on a station that is only noted down."""

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pytest

from dt_station_nodes.cli import improve_live
from dt_station_nodes.cli.improve_live import as_setpoint, experiments, play_next, settled
from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import ModelSpec
from dt_station_nodes.core.run import Run
from dt_station_nodes.discovery import NextExperiment, Verdict, discover
from dt_station_nodes.discovery.result import NamedEffect

PAPER = ModelSpec.from_yaml(
    (Path(__file__).resolve().parents[3] / "config" / "models" / "paper.yaml").read_text(encoding="utf-8")
)
SPEC = PAPER.model_copy(update={"paths": {Channel.PRESSURE: PAPER.paths[Channel.PRESSURE]}})


@dataclass
class NotedStation:
    """Its pressure does not move; each run's first voltage is the run's number."""

    runs: int = 0
    played: list = field(default_factory=list)

    def experiment(self, samples):
        self.runs += 1
        noise = np.random.default_rng(self.runs).normal(size=samples)
        signals = {"load_voltage_v": 2.0 + noise, "pressure_pa": 1e6 + 1e3 * noise}
        signals["load_voltage_v"][0] = self.runs
        return Run(0.02, signals, source="noted")

    def play(self, channel, changes):
        self.played.append((channel, dict(changes)))
        return dict(changes)


@pytest.fixture(scope="module")
def answer():
    """Any answer of discovery's: what matters is replaced."""
    return discover(NotedStation().experiment(600), SPEC)


PROPOSAL = NextExperiment("why", Channel.PRESSURE, "sine", 1.0, 2.0, 0.3, 0.5, 24.0, "voltage")


def named(answer, confidence, alternatives=()):
    effect = NamedEffect("dead_zone", Channel.PRESSURE, confidence, {}, alternatives)
    return replace(answer, verdict=Verdict.NAMED, effects=(effect,), next_experiment=None)


def searching(monkeypatch, answers):
    """Discovery gives these answers in turn; the list fills with what each was asked on and validated on."""
    asked, left = [], list(answers)

    def search(run, spec, validation, settings):
        asked.append(tuple(None if r is None else r.signals["load_voltage_v"][0] for r in (run, validation)))
        return left.pop(0)

    monkeypatch.setattr(improve_live, "search", search)
    return asked


def test_rounds_go_on_until_a_name_is_sure_each_validated_on_the_one_before(monkeypatch, tmp_path, answer):
    doubtful = replace(named(answer, 0.9, ("hysteresis",)), next_experiment=PROPOSAL)
    answers = [named(answer, 0.5), doubtful, named(answer, 0.9)]
    asked = searching(monkeypatch, answers)
    station, said = NotedStation(), []
    results, tables = experiments(station, SPEC, 5, 500, 1, tmp_path, said.append)
    assert asked == [(1.0, None), (2.0, 1.0), (3.0, 2.0)]
    assert [len(results), len(tables), len(station.played)] == [3, 3, 2]
    assert [result.run.source for result in results] == [str(table) for table in tables]
    assert all(table.is_file() for table in tables)
    assert [text.split(":")[0] for text in said] == ["round 1", "next", "round 2", "next", "round 3"]


def test_a_sure_name_is_confirmed_by_a_second_experiment(monkeypatch, tmp_path, answer):
    searching(monkeypatch, [named(answer, 0.99), named(answer, 0.99)])
    results, _ = experiments(NotedStation(), SPEC, 5, 500, 1, tmp_path, lambda _: None)
    assert len(results) == 2


def test_names_that_no_experiment_tells_apart_ask_for_none(answer):
    alike = replace(named(answer, 0.5, ("backlash",)), next_experiment=None)
    assert settled(alike, confirmed=True)
    assert not settled(alike, confirmed=False)
    assert not settled(replace(alike, next_experiment=PROPOSAL), confirmed=True)
    refitted = replace(alike, verdict=Verdict.PARAMETERS_ONLY)
    assert settled(refitted, confirmed=False)
    assert not settled(replace(refitted, next_experiment=PROPOSAL), confirmed=False)
    assert not settled(replace(named(answer, 0.5), next_experiment=None), confirmed=True)


def test_the_budget_ends_the_rounds(monkeypatch, tmp_path, answer):
    searching(monkeypatch, [named(answer, 0.1)] * 9)
    station = NotedStation()
    results, _ = experiments(station, SPEC, 2, 500, 1, tmp_path, lambda _: None)
    assert (len(results), station.runs, len(station.played)) == (2, 2, 1)


@pytest.mark.parametrize(
    ("verdict", "done"),
    [(Verdict.NOTHING_MISSING, True), (Verdict.PARAMETERS_ONLY, True), (Verdict.UNEXPLAINED, False)],
)
def test_only_what_is_not_explained_asks_for_more(answer, verdict, done):
    assert settled(replace(answer, verdict=verdict, effects=()), confirmed=False) is done


def test_without_a_proposal_each_round_plays_another_setpoint(answer):
    station = NotedStation()
    for number in range(3):
        play_next(station, named(answer, 0.1), number)
    shapes = [changes["shape"] for _, changes in station.played]
    assert len(set(shapes)) == 3


def test_a_proposed_voltage_becomes_the_setpoint_that_needs_it():
    path = PAPER.paths[Channel.PRESSURE]
    static = path.scale * path.gain * path.numerator[-1] / path.denominator[-1]
    middle = (3.0e6 - path.rest) / static
    amplitude = abs(1.0e6 / static)
    proposal = NextExperiment("why", Channel.PRESSURE, "sine", amplitude, middle, 0.3, 0.5, 24.0, "voltage")
    played = as_setpoint(proposal, path)
    assert (played["offset"], played["amplitude"]) == pytest.approx((3.0e6, 1.0e6))
    far = as_setpoint(replace(proposal, amplitude=abs(9.0e6 / static)), path)
    assert far["offset"] + far["amplitude"] <= 5.0e6
    assert far["offset"] - far["amplitude"] >= 1.2e6
