"""Which explanations the next experiment is to tell apart."""

from types import SimpleNamespace
from typing import cast

import pytest

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import EffectSpec, PathSpec
from dt_station_nodes.core.models.effects import Attachment, Quantity
from dt_station_nodes.discovery import verdict
from dt_station_nodes.discovery.channel import Finding
from dt_station_nodes.discovery.contenders import AS_LITTLE, contenders
from dt_station_nodes.discovery.result import Verdict


def explained(*names: str, rss: float = 1.0, effects: tuple[EffectSpec, ...] = ()) -> SimpleNamespace:
    path = PathSpec.model_construct(effects=effects)
    return SimpleNamespace(added=names, inside=True, fit=SimpleNamespace(rss=rss, path=path))


NULL, FRICTION, DEAD_ZONE, PAIR = explained(), explained("friction"), explained("dead_zone"), explained("delay", "bias")
FAR = explained("leakage", rss=1.1 * AS_LITTLE)


def finding(
    verdict: Verdict, *ranked: tuple[SimpleNamespace, float], names: tuple[str, ...] = (), rival: str = ""
) -> Finding:
    """A channel whose best explanation is the one that is behind by nothing."""
    made = SimpleNamespace(
        verdict=verdict,
        best=next(e for e, behind in ranked if behind == 0.0),
        ranking=tuple(e for e, _ in ranked),
        scores=tuple(behind for _, behind in ranked),
        alternatives=(names,),
        rival=rival,
        problem=SimpleNamespace(channel=Channel.PRESSURE, scales={Quantity.INPUT_PEAK: 4.0}),
    )
    return cast("Finding", made)


def test_a_larger_set_that_is_ahead_and_does_without_the_name_is_to_be_told_from_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(verdict, "sensible", lambda *_: True)
    found = finding(Verdict.NAMED, (PAIR, -30.0), (FRICTION, 0.0), (DEAD_ZONE, 50.0))
    assert contenders(found, Verdict.NAMED) == [PAIR]
    alone = finding(Verdict.NAMED, (FRICTION, 0.0), (DEAD_ZONE, 50.0))
    assert contenders(alone, Verdict.NAMED) == []


def test_of_names_that_could_stand_in_its_place_the_sets_as_large_are_told_apart() -> None:
    found = finding(Verdict.NAMED, (PAIR, -30.0), (FRICTION, 0.0), (FAR, 3.0), (DEAD_ZONE, 4.0), names=("dead_zone",))
    assert contenders(found, Verdict.NAMED) == [DEAD_ZONE]


def test_names_that_no_run_tells_apart_need_no_experiment() -> None:
    play = explained(
        "backlash", effects=(EffectSpec(name="backlash", at=Attachment.INPUT, parameters={"half_width": 0.1}),)
    )
    loop, valve = explained("hysteresis"), explained("dead_zone")
    found = finding(Verdict.NAMED, (play, 0.0), (loop, 1.0), (valve, 2.0), names=("hysteresis", "friction"))
    assert contenders(found, Verdict.NAMED) == []
    more = finding(Verdict.NAMED, (play, 0.0), (loop, 1.0), (valve, 2.0), names=("hysteresis", "dead_zone"))
    assert contenders(more, Verdict.NAMED) == [valve]


@pytest.mark.parametrize(("overall", "open_"), [(Verdict.PARAMETERS_ONLY, [DEAD_ZONE]), (Verdict.NAMED, [])])
def test_what_else_parameters_could_be_is_asked_where_nothing_is_named(
    overall: Verdict, open_: list[SimpleNamespace]
) -> None:
    found = finding(Verdict.PARAMETERS_ONLY, (NULL, 0.0), (DEAD_ZONE, 2.0), (FRICTION, 9.0), names=("dead_zone",))
    assert contenders(found, overall) == open_


@pytest.mark.parametrize(
    ("others", "rival", "open_"),
    [
        ([(DEAD_ZONE, 2.0)], "", [DEAD_ZONE]),
        ([(FAR, 1.0), (DEAD_ZONE, 2.0)], "", [DEAD_ZONE]),
        ([(FAR, 1.0)], "", []),
        ([(DEAD_ZONE, 2.0)], "memory", []),
    ],
)
def test_where_nothing_is_sure_the_next_that_leaves_as_little_is_told_from_the_best(
    others: list[tuple[SimpleNamespace, float]], rival: str, open_: list[SimpleNamespace]
) -> None:
    found = finding(Verdict.UNEXPLAINED, (FRICTION, 0.0), *others, rival=rival)
    assert contenders(found, Verdict.UNEXPLAINED) == open_


def test_where_nothing_is_missing_there_is_nothing_to_tell() -> None:
    assert contenders(finding(Verdict.NOTHING_MISSING, (NULL, 0.0), (FRICTION, 1.0)), Verdict.NOTHING_MISSING) == []
