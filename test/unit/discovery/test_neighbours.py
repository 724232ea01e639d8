"""A set led by a form come upon on a larger set's way, less each of its effects."""

from types import SimpleNamespace
from typing import cast

import pytest

from dt_station_nodes.discovery import neighbours
from dt_station_nodes.discovery.choice import Measure
from dt_station_nodes.discovery.neighbours import lessened
from dt_station_nodes.discovery.selection import Bench, Explanation


def explained(score: float, *names: str, inside: bool = True) -> Explanation:
    return cast("Explanation", SimpleNamespace(added=names, inside=inside, behind=score))


NULL, SINGLE, STRANGE = explained(90.0), explained(50.0, "gain_drift"), explained(0.0, "memory", "bias", inside=False)
OLD, NEW = explained(40.0, "gain_drift", "bias"), explained(20.0, "gain_drift", "bias")
LESS, TRIPLE = explained(10.0, "gain_drift"), explained(5.0, "gain_drift", "bias", "delay")
BETTER = explained(4.0, "gain_drift", "bias")
PARTS = {3: BETTER, 2: LESS}
MEASURE = cast("Measure", SimpleNamespace(score=lambda e: e.behind))


@pytest.mark.parametrize(
    ("before", "known", "rough", "looked_into"),
    [
        ([NULL, SINGLE, OLD], [NULL, SINGLE, NEW], False, [NEW]),
        ([NULL, SINGLE, OLD], [NULL, SINGLE, NEW, STRANGE], False, [NEW]),
        ([NULL, SINGLE], [NULL, SINGLE, TRIPLE], False, [TRIPLE, BETTER]),
        ([NULL, SINGLE, OLD], [NULL, SINGLE, OLD], False, []),
        ([NULL, SINGLE, OLD], [NULL, LESS, OLD], False, []),
        ([NULL, SINGLE, OLD], [NULL, SINGLE, NEW], True, []),
        ([NULL], [NULL], False, []),
    ],
)
def test_a_larger_set_that_leads_in_a_new_form_is_taken_apart(
    before: list[Explanation],
    known: list[Explanation],
    rough: bool,
    looked_into: list[Explanation],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    taken: list[Explanation] = []

    def parts(_bench: Bench, explanations: list[Explanation]) -> list[Explanation]:
        taken.extend(explanations)
        return [PARTS[len(e.added)] for e in explanations]

    monkeypatch.setattr(neighbours, "reduced", parts)
    monkeypatch.setattr(neighbours, "distinct", lambda _bench, listed: listed)
    found = lessened(cast("Bench", SimpleNamespace(rough=rough)), before, known, MEASURE)
    assert taken == looked_into
    assert found == [*known, *(PARTS[len(e.added)] for e in looked_into)]
