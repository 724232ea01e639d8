"""Sets of effects grown from single ones."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from cases import Case, make

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import ModelSpec
from dt_station_nodes.discovery import growth
from dt_station_nodes.discovery.choice import take_measure
from dt_station_nodes.discovery.growth import Growth
from dt_station_nodes.discovery.problem import make_problem
from dt_station_nodes.discovery.search import scan
from dt_station_nodes.discovery.selection import Bench, Explanation, fit_null
from dt_station_nodes.discovery.settings import DiscoverySettings
from dt_station_nodes.discovery.terms import nominal_terms

MODEL = Path(__file__).parents[3] / "config" / "models" / "paper.yaml"
PAPER = ModelSpec.from_yaml(MODEL.read_text(encoding="utf-8"))
PAIR = Case((("dead_zone", "position", 1.0), ("delay", "position", 1.0)), seconds=24.0)


@pytest.fixture(scope="module")
def singles() -> tuple[Bench, Explanation, list[Explanation]]:
    problem = make_problem(make(PAIR), PAPER, Channel.POSITION, DiscoverySettings())
    path = PAPER.paths[Channel.POSITION]
    bench = Bench(problem, nominal_terms(path, problem.signal))
    null = fit_null(bench, path)
    return bench, null, [null, *scan(bench, [null], 6, 2)]


def test_one_effect_at_most_leaves_single_ones_as_they_are(
    singles: tuple[Bench, Explanation, list[Explanation]],
) -> None:
    bench, null, found = singles
    known = list(found)
    Growth(bench, null, known, 1).run()
    assert [e.added for e in known] == [e.added for e in found]


def test_the_pair_in_the_run_is_grown_and_nothing_known_gets_worse(
    singles: tuple[Bench, Explanation, list[Explanation]],
) -> None:
    bench, null, found = singles
    known = list(found)
    Growth(bench, null, known, 2).run()
    measure = take_measure(bench, known)
    leader = min((e for e in known if e.inside and e.added), key=measure.score)
    assert set(leader.added) == {"dead_zone", "delay"}
    after = {tuple(sorted(e.added)): measure.score(e) for e in known}
    assert all(after[tuple(sorted(e.added))] <= measure.score(e) + 1e-9 for e in found)


def test_what_has_been_grown_is_not_grown_again(
    singles: tuple[Bench, Explanation, list[Explanation]], monkeypatch: pytest.MonkeyPatch
) -> None:
    bench, null, found = singles
    bases: list[Explanation] = []

    def fruitless(_bench: Bench, chosen: list[Explanation], _most: int, _finest: int) -> list[Explanation]:
        bases.extend(chosen)
        return []

    monkeypatch.setattr(growth, "scan", fruitless)
    Growth(bench, null, list(found), 3).run()
    assert bases
    assert len({id(base) for base in bases}) == len(bases)
