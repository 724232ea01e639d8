"""What only the whole of a run shows."""

import sys
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from cases import Case, make

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import ModelSpec, PathSpec
from dt_station_nodes.discovery import DiscoverySettings, Verdict, discover, drift
from dt_station_nodes.discovery.channel import Finding
from dt_station_nodes.discovery.problem import Problem, make_problem
from dt_station_nodes.workers import ALONE

MODEL = Path(__file__).parents[3] / "config" / "models" / "paper.yaml"
PAPER = ModelSpec.from_yaml(MODEL.read_text(encoding="utf-8"))


def test_a_null_off_by_a_few_millivolts_shows_as_drift_and_is_not_claimed_to_be_nothing_else() -> None:
    case = Case((("bias", "position", 0.004),), shape="sine", seconds=24.0, seed=3)
    result = discover(make(case), PAPER)
    assert result.verdict is Verdict.NAMED
    (effect,) = result.effects
    assert effect.channel is Channel.POSITION
    assert "bias" in {effect.name, *effect.alternatives}
    assert "asymmetric_gain" in {effect.name, *effect.alternatives}
    assert effect.confidence < 0.5
    assert any("drift" in note for note in result.data_notes)
    after, floor = result.gap.after[Channel.POSITION].rms, result.gap.noise_floor[Channel.POSITION].rms
    assert after < 1.2 * floor < result.gap.before[Channel.POSITION].rms


def test_a_model_that_does_not_drift_is_not_looked_at_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(drift, "examine", lambda *_: pytest.fail("looked at again"))
    for gain_error in (0.0, 0.02):
        case = Case(shape="sine", seconds=24.0, seed=4, gain_error=gain_error)
        result = discover(make(case), PAPER, settings=DiscoverySettings(jobs=1))
        assert result.verdict in (Verdict.NOTHING_MISSING, Verdict.PARAMETERS_ONLY)


def test_where_a_model_drifts_two_names_at_most_are_looked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    """Only one is believed, and a second tells that it is not all."""
    asked: list[int] = []

    def quiet(_problem: Problem, _path: PathSpec, settings: DiscoverySettings, *_: object) -> SimpleNamespace:
        asked.append(settings.max_effects)
        return SimpleNamespace(verdict=Verdict.NOTHING_MISSING)

    monkeypatch.setattr(drift, "examine", quiet)
    monkeypatch.setattr(drift, "_drifts", lambda *_: True)
    run, settings = make(Case(shape="sine", seconds=24.0)), DiscoverySettings(max_effects=3)
    problem = make_problem(run, PAPER, Channel.POSITION, settings)
    stub = SimpleNamespace(problem=problem, verdict=Verdict.NOTHING_MISSING, interrupted=False)
    finding = cast("Finding", stub)
    assert drift.found_adrift(finding, run, None, PAPER, settings, None, ALONE) == (finding, "")
    assert asked == [2]
