"""How sure a name is."""

from types import SimpleNamespace
from typing import cast

import pytest

from dt_station_nodes.discovery import verdict
from dt_station_nodes.discovery.channel import Finding
from dt_station_nodes.discovery.verdict import better_without, confidence, why


def finding(margin: float) -> Finding:
    """A finding that explains all of a gap and leads by `margin`."""
    sure = SimpleNamespace(margin=margin, gain=1e3, excess=0.0, interrupted=False, mimic="")
    return cast("Finding", SimpleNamespace(**vars(sure), best=None, ranking=(), scores=(), problem=None))


@pytest.mark.parametrize("margin", [6.0, 40.0, 4000.0])
def test_a_name_that_another_may_stand_for_is_no_surer_for_its_lead(margin: float) -> None:
    assert confidence(finding(margin), ("saturation",)) == confidence(finding(6.0), ("saturation",)) < 0.6
    assert confidence(finding(margin), ()) > 0.99


def test_what_has_no_name_and_explains_as_much_halves_the_confidence() -> None:
    mimicked = cast("Finding", SimpleNamespace(**{**vars(finding(40.0)), "mimic": "cross_coupling"}))
    assert confidence(mimicked, ()) == pytest.approx(0.5 * confidence(finding(40.0), ()), rel=0.01)


@pytest.mark.parametrize(("mimic", "said"), [("cross_coupling", True), ("", False)])
def test_the_evidence_names_what_explains_as_much(mimic: str, said: bool) -> None:
    mimicked = SimpleNamespace(**{**vars(finding(40.0)), "mimic": mimic, "over_noise": (1.0,)})
    assert ("cross coupling" in why(cast("Finding", mimicked), "leakage")) is said


def explained(*names: str, inside: bool = True, told: bool = True) -> SimpleNamespace:
    return SimpleNamespace(added=names, inside=inside, told=told)


@pytest.mark.parametrize(
    ("larger", "ahead", "doubts"),
    [
        (explained("delay", "bias"), 20.0, True),
        (explained("delay", "bias"), 4.0, False),
        (explained("friction", "bias"), 20.0, False),
        (explained("memory", "bias", inside=False), 20.0, False),
        (explained("delay", "bias", told=False), 20.0, False),
        (explained(), 20.0, False),
    ],
)
def test_a_set_that_does_without_a_name_and_is_ahead_puts_it_in_doubt(
    larger: SimpleNamespace, ahead: float, doubts: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(verdict, "sensible", lambda explanation, problem: explanation.told)
    best = explained("friction")
    ranked = {"best": best, "ranking": (larger, best), "scores": (-ahead, 0.0)}
    doubted = cast("Finding", SimpleNamespace(**{**vars(finding(40.0)), **ranked}))
    assert [vars(e) for e in better_without(doubted)] == ([vars(larger)] if doubts else [])
    assert (confidence(doubted, ()) < confidence(finding(40.0), ())) is doubts
