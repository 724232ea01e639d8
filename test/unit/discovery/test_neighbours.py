"""A set led by a form come upon on a larger set's way, less each of its effects."""

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from dt_station_nodes.discovery import neighbours
from dt_station_nodes.discovery.measure import Measure
from dt_station_nodes.discovery.neighbours import lessened, reduced, told_there
from dt_station_nodes.discovery.problem import Problem
from dt_station_nodes.discovery.selection import Bench, Explanation
from dt_station_nodes.discovery.terms import nominal_terms

from .pistons import NOISE_M, PATH, TIME_S, TWO_LEVELS, fitted, problem_of


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


WAVE = 1.3 * np.sin(0.8 * np.pi * TIME_S) + 0.1
NULL_OFF = {"bias": {"bias_v": -0.11}}
RIPPLE = {"periodic_disturbance": {"amplitude": 0.3, "frequency_hz": 8.1, "phase_rad": -2.5}}
LIMITED = {"saturation": {"upper_v": 0.91, "lower_v": -1.12}}


def limited(voltage: np.ndarray, seed: int) -> Problem:
    """A servo valve whose flow bends towards its limits, with its null off."""
    flow = voltage / (1.0 + np.abs(voltage / 1.03) ** 6.7) ** (1.0 / 6.7) - 0.11
    return problem_of(PATH, voltage, flow, seed)


@pytest.fixture(scope="module")
def bench() -> Bench:
    """On two levels no form of a limit is told from another, on a wave it is."""
    problem = limited(TWO_LEVELS, 1)
    return Bench(problem, nominal_terms(PATH, problem.signal), limited(WAVE, 2))


def test_what_only_the_other_run_tells_is_sought_one_refinement_at_a_time(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = fitted(bench, NULL_OFF | RIPPLE | LIMITED)

    def least(told: bool) -> float:
        monkeypatch.setattr(neighbours, "told_there", lambda *_: told)
        pairs = [e for e in reduced(bench, [whole]) if set(e.added) == {"bias", "saturation"}]
        return float(min(sum(e.powers) for e in pairs) / (2.0 * TIME_S.size)) ** 0.5

    assert least(False) > 1.2 * NOISE_M
    assert least(True) < 1.05 * NOISE_M


def test_the_other_run_alone_tells_what_two_levels_hide(bench: Bench) -> None:
    sharp = fitted(bench, NULL_OFF | LIMITED)
    bent = fitted(bench, {"saturation": {"upper_v": 1.03, "lower_v": -1.03, "knee": 0.15}} | NULL_OFF)
    late = fitted(bench, {"delay": {"delay_s": 0.01}})
    assert told_there(bench, sharp, bent)
    assert not told_there(bench, bent, sharp)
    assert not told_there(bench, late, bent)  # the run itself tells that the null is off
    assert not told_there(replace(bench, check=None), sharp, bent)
