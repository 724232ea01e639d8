"""Forms that a run of two levels hides, found where another waveform shows them."""

from dataclasses import replace

import numpy as np
import pytest

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.discovery import retold as module
from dt_station_nodes.discovery.candidates import Candidate, add_effect, hypothesis
from dt_station_nodes.discovery.choice import best_set, certain
from dt_station_nodes.discovery.foretold import agreed
from dt_station_nodes.discovery.hypothesis_fit import fit_hypothesis
from dt_station_nodes.discovery.measure import take_measure
from dt_station_nodes.discovery.retold import retold, told
from dt_station_nodes.discovery.selection import Bench, Explanation, fit_null
from dt_station_nodes.discovery.terms import nominal_terms

from .far_workers import FarWorkers
from .pistons import NOISE_M, PAPER, PATH, TIME_S, TWO_LEVELS, problem_of

STRIBECK = {"coulomb_v": 0.25, "static_excess_v": 0.2, "stribeck_velocity": 0.015}
OBJECT = PAPER.with_effect(Channel.POSITION, "friction", STRIBECK).paths[Channel.POSITION]
WAVE = np.sin(0.4 * np.pi * TIME_S)


@pytest.fixture(scope="module")
def bench() -> Bench:
    """Dry friction that falls with speed: on two levels it is a smaller gain."""
    problem = problem_of(OBJECT, TWO_LEVELS, TWO_LEVELS, 1)
    return Bench(problem, nominal_terms(PATH, problem.signal), problem_of(OBJECT, WAVE, WAVE, 2))


@pytest.fixture(scope="module")
def null(bench: Bench) -> Explanation:
    return fit_null(bench, PATH)


def fitted(bench: Bench, name: str, value: float, there: bool) -> Explanation:
    """A plain form fitted to the run, or where it stands and then to both runs if `there`."""
    (required,) = (p for p in Candidate(name).required if p in ("coulomb_v", "half_width_v", "delay_s"))
    freed = {name: (required,)}
    begin = hypothesis(bench.problem, add_effect(PATH, Candidate(name), {required: value}), bench.nominal, freed)
    fit = fit_hypothesis(bench.problem, begin, [begin.start()], 0 if there else 10, 1)
    if there:
        assert bench.check is not None
        fit = agreed(bench.problem, bench.check, fit)
    return bench.explained(fit, (name,), freed, glance=True)


def test_what_two_levels_hide_is_told_by_both_runs_together(bench: Bench, null: Explanation) -> None:
    friction, gap = fitted(bench, "friction", 0.2, there=False), fitted(bench, "dead_zone", 0.3, there=True)
    known = [null, friction, gap]
    measure = take_measure(bench, known)
    assert best_set(null, known, measure) is gap
    far = replace(bench, workers=FarWorkers())
    found_by_both = retold(far, null, known, take_measure(far, known))
    assert [e.added for e in found_by_both] == [e.added for e in known]
    best = best_set(null, found_by_both, take_measure(bench, found_by_both))
    assert best.added == ("friction",)
    found = best.fit.path.effect("friction").parameters
    assert {name: found[name] for name in STRIBECK} == pytest.approx(STRIBECK, rel=0.05)
    assert certain(best, take_measure(bench, found_by_both))
    assert sum(best.powers) < 1.05 * NOISE_M**2 * 2 * TIME_S.size


def test_sets_are_refined_side_by_side(bench: Bench, null: Explanation) -> None:
    friction = fitted(bench, "friction", 0.2, there=False)
    asked, found = [], []
    for sets in ([friction], [friction, friction]):
        workers = FarWorkers()
        found += told(take_measure(replace(bench, workers=workers), [null, friction]), sets)
        asked.append(workers.asked)
    assert asked[1] == [2 * count for count in asked[0]]
    assert len({e.powers for e in found}) == 1
    assert found[0].powers != friction.powers


def test_what_comes_on_too_slowly_to_get_where_the_foremost_is_goes_no_further(
    monkeypatch: pytest.MonkeyPatch, bench: Bench, null: Explanation
) -> None:
    foremost = fitted(bench, "friction", 0.2, there=False)
    behind = [fitted(bench, name, 0.1, there=False) for name in ("dead_zone", "delay")]
    slow, quick = (replace(e, powers=tuple(1e3 * power for power in foremost.powers)) for e in behind)
    left = {foremost.added: 1.0, slow.added: 0.9, quick.added: 0.1}
    seen: list[list[tuple[str, ...]]] = []

    def refined(_: Bench, explanations: list[Explanation]) -> list[list[Explanation]]:
        seen.append([e.added for e in explanations])
        return [[replace(e, powers=tuple(left[e.added] * power for power in e.powers))] for e in explanations]

    monkeypatch.setattr(module, "_refined", refined)
    monkeypatch.setattr(module, "sensible", lambda *_: True)
    told(take_measure(bench, [null, foremost]), [foremost, slow, quick])
    assert seen == [[foremost.added, slow.added, quick.added], [quick.added], [quick.added]]


def test_what_the_run_tells_itself_stays_as_it_is(bench: Bench, null: Explanation) -> None:
    friction, gap = fitted(bench, "friction", 0.2, there=False), fitted(bench, "dead_zone", 0.3, there=True)
    worse = replace(friction, fit=replace(friction.fit, rss=1.2 * gap.fit.rss))
    known = [null, gap, worse]
    measure = take_measure(bench, [null, gap, friction])
    assert retold(bench, null, known, measure) == known
    assert retold(replace(bench, check=None), null, [null, gap, friction], measure) == [null, gap, friction]


def test_numbers_that_both_runs_agree_on_are_held_by_both(bench: Bench) -> None:
    assert bench.check is not None
    freed = {"friction": tuple(STRIBECK)}
    begin = hypothesis(bench.problem, OBJECT, bench.nominal, freed)
    stands = fit_hypothesis(bench.problem, begin, [begin.start()], 0, 1)
    both = agreed(bench.problem, bench.check, stands)
    count = len(both.residual)
    alone, together = (np.sqrt(np.diag(f.fitted.covariance(count, count))) for f in (stands, both))
    names = [term.name for term in begin.terms]
    at = names.index("stribeck_velocity")
    assert together[at] < 0.2 * alone[at]
    assert np.all(together < 1.02 * alone)
    numbers = both.path.effect("friction").parameters
    assert numbers["stribeck_velocity"] == pytest.approx(STRIBECK["stribeck_velocity"], rel=0.05)
