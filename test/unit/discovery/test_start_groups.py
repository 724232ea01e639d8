"""Groups of starts: one for each form, one for each frequency."""

import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).parent))

from cases import Case, make

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import ModelSpec
from dt_station_nodes.discovery.candidates import Candidate, hypothesis, plain_starts
from dt_station_nodes.discovery.hypothesis_fit import Costs, Fit, fit_hypothesis
from dt_station_nodes.discovery.problem import Problem, make_problem
from dt_station_nodes.discovery.settings import DiscoverySettings
from dt_station_nodes.discovery.stairs import beginning
from dt_station_nodes.discovery.start_groups import by_form, promising, unlike
from dt_station_nodes.discovery.terms import Hypothesis, nominal_terms

MODEL = Path(__file__).parents[3] / "config" / "models" / "paper.yaml"
PAPER = ModelSpec.from_yaml(MODEL.read_text(encoding="utf-8"))
PATH = PAPER.paths[Channel.POSITION]
PROBLEM = make_problem(make(Case(seconds=12.0)), PAPER, Channel.POSITION, DiscoverySettings())


def begun(name: str) -> list[Hypothesis]:
    candidate = Candidate(name)
    paths = plain_starts(PROBLEM, PATH, candidate, PROBLEM.residual(PATH))
    nominal = nominal_terms(PATH, PROBLEM.signal)
    return [hypothesis(PROBLEM, path, nominal, {name: candidate.required}) for path in paths]


def test_a_glance_follows_each_form_and_no_more_than_one_frequency() -> None:
    bands = begun("dead_zone")
    groups = by_form(bands[0], [h.start() for h in bands], tuned=False)
    assert len(groups) == 2
    assert sum(map(len, groups)) == len(bands)
    place = next(i for i, term in enumerate(bands[0].terms) if term.name == "restored")
    assert all(np.ptp([x[place] for x in group]) == 0.0 for group in groups)
    modes = begun("resonance")
    starts = [h.start() for h in modes]
    assert by_form(modes[0], starts, tuned=False) == []
    assert len(by_form(modes[0], starts)) > 1


def test_ends_in_different_forms_are_unlike() -> None:
    def as_begun(h: Hypothesis) -> Fit:
        return fit_hypothesis(PROBLEM, h, iterations=0)

    def band(restored: float, wider_v: float) -> Hypothesis:
        numbers = ((h, h.path.effects[-1].parameters) for h in begun("dead_zone"))
        return next(h for h, p in numbers if p["restored"] == restored and p["half_width_v"] > wider_v)

    plain, wider, jumping = band(0.0, 0.0), band(0.0, 0.5), band(1.0, 0.0)
    assert not unlike(as_begun(plain), as_begun(wider))
    assert unlike(as_begun(plain), as_begun(jumping))
    bias = begun("bias")
    assert not unlike(as_begun(bias[0]), as_begun(bias[-1]))


def test_of_many_starts_the_runs_beginning_tells_which_to_keep(monkeypatch: pytest.MonkeyPatch) -> None:
    """Those that fit it best stay, of each form, in their order; asked again nothing is simulated again."""
    band = next(h for h in begun("dead_zone") if h.path.effects[-1].parameters["restored"] == 0.0)
    width, form = (next(i for i, t in enumerate(band.terms) if t.name == n) for n in ("half_width_v", "restored"))
    starts = [band.start() for _ in range(240)]
    for number, x in enumerate(starts):
        x[width] = 0.002 * (1 + (7 * number) % 240)
        x[form] = float(number % 2)
    lengths: list[int] = []
    residual = Problem.residual

    def counted(problem: Problem, path: object) -> object:
        lengths.append(len(problem.measured))
        return residual(problem, path)  # type: ignore[arg-type]

    monkeypatch.setattr(Problem, "residual", counted)
    known: Costs = {}
    kept = promising(PROBLEM, band, starts, known)
    assert len(lengths) == len(starts)
    assert max(lengths) <= len(PROBLEM.measured) // 4
    assert [promising(PROBLEM, band, starts, known), len(lengths)] == [kept, len(starts)]
    places = [next(i for i, x in enumerate(starts) if x is one) for one in kept]
    assert places == sorted(places)
    part = beginning(PROBLEM, 0.25)

    def misfit(x: NDArray[np.float64]) -> float:
        return float(np.sum(np.square(residual(part, band.path_at(x)))))

    for value in (0.0, 1.0):
        best, others = (
            [x for x in starts if x[form] == value and any(x is k for k in kept) is so] for so in (True, False)
        )
        assert len(best) == len(kept) // 2
        assert max(map(misfit, best)) <= min(map(misfit, others))
    few = starts[:100]
    assert promising(PROBLEM, band, few, {}) is few
