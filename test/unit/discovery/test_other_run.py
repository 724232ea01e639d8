"""What the validation run is asked where it shows more of what is missing."""

from types import SimpleNamespace
from typing import cast

import pytest

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import PathSpec
from dt_station_nodes.discovery import DiscoverySettings, Verdict, other_run
from dt_station_nodes.discovery.channel import Finding
from dt_station_nodes.discovery.other_run import found_only_there, found_there
from dt_station_nodes.discovery.problem import Problem
from dt_station_nodes.workers import ALONE

PATH = PathSpec(numerator=[1.0], denominator=[1.0])


@pytest.mark.parametrize(
    ("names", "most"), [(("delay",), 2), (("delay", "bias"), 3), (("delay", "bias", "friction"), 3)]
)
def test_the_validation_run_is_asked_for_one_name_more_at_most(
    monkeypatch: pytest.MonkeyPatch, names: tuple[str, ...], most: int
) -> None:
    asked: list[int] = []

    def unexplained(_problem: Problem, _path: PathSpec, settings: DiscoverySettings, *_: object) -> SimpleNamespace:
        asked.append(settings.max_effects)
        return SimpleNamespace(verdict=Verdict.UNEXPLAINED)

    monkeypatch.setattr(other_run, "examine", unexplained)
    problem = cast("Problem", SimpleNamespace(channel=Channel.POSITION))
    best = SimpleNamespace(added=names)
    stub = SimpleNamespace(problem=problem, best=best, verdict=Verdict.NAMED, interrupted=False, over_noise=(1.0, 9.0))
    finding = cast("Finding", stub)
    said = found_there(finding, problem, PATH, DiscoverySettings(max_effects=3), None, ALONE)
    assert said == (finding, "")
    assert asked == [most]


@pytest.mark.parametrize(
    ("here", "there", "asked", "taken"),
    [
        ((1.2, 9.0), (1.0, 1.1), True, True),
        ((1.2, 9.0), (1.0, 1.6), True, False),  # it would do where this run's name was believed
        ((1.6, 9.0), (1.0, 1.1), False, False),
        ((1.2, 1.3), (1.0, 1.1), False, False),
    ],
)
def test_what_explains_this_run_alone_and_is_not_believed_is_held_against_the_other(
    monkeypatch: pytest.MonkeyPatch,
    here: tuple[float, float],
    there: tuple[float, float],
    asked: bool,
    taken: bool,
) -> None:
    examined: list[Problem] = []
    monkeypatch.setattr(other_run, "_brought_here", lambda found, _: found)
    monkeypatch.setattr(other_run, "replace", lambda of, **changed: SimpleNamespace(**{**vars(of), **changed}))

    def named(problem: Problem, *_: object) -> SimpleNamespace:
        examined.append(problem)
        return SimpleNamespace(verdict=Verdict.NAMED, over_noise=there)

    monkeypatch.setattr(other_run, "examine", named)
    problem, other = (cast("Problem", SimpleNamespace(channel=Channel.PRESSURE)) for _ in range(2))
    stub = SimpleNamespace(
        problem=problem,
        best=SimpleNamespace(added=("backlash",)),
        verdict=Verdict.UNEXPLAINED,
        interrupted=False,
        over_noise=here,
        given=None,
        null=None,
        sigma=1.0,
    )
    settings = cast("DiscoverySettings", SimpleNamespace(max_effects=3))
    found, note = found_there(cast("Finding", stub), other, PATH, settings, None, ALONE)
    assert examined == [other] * asked
    assert (found.verdict is Verdict.NAMED) is bool(note) is taken


@pytest.mark.parametrize(
    ("penalty", "bent", "asked"), [(0.5, False, 1), (0.5, True, 0), (70.0, False, 0), (70.0, True, 1)]
)
def test_a_run_that_needs_parameters_far_off_is_asked_first_itself(
    monkeypatch: pytest.MonkeyPatch, penalty: float, bent: bool, asked: int
) -> None:
    examined: list[Problem] = []
    null = SimpleNamespace(fit=SimpleNamespace(penalty=penalty, residual=None), unseen=None)
    monkeypatch.setattr(other_run, "null_and_noise", lambda *_: (null, 1.0))
    monkeypatch.setattr(other_run, "shows_only", lambda *_: True)

    def unexplained(problem: Problem, *_: object) -> SimpleNamespace:
        examined.append(problem)
        return SimpleNamespace(verdict=Verdict.UNEXPLAINED, interrupted=False)

    monkeypatch.setattr(other_run, "examine", unexplained)
    here, there = (cast("Problem", SimpleNamespace(channel=Channel.POSITION)) for _ in range(2))
    found, note = found_only_there(here, there, PATH, DiscoverySettings(), None, ALONE, bent=bent)
    assert found is None
    assert examined == [there] * asked
    assert bool(note) is bool(asked)
