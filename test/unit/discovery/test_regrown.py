"""Sets whose form no step led to, grown again from where their effects are plain."""

import pickle
from dataclasses import replace

import numpy as np
import pytest

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.discovery import regrown as module
from dt_station_nodes.discovery.candidates import Candidate
from dt_station_nodes.discovery.choice import best_set
from dt_station_nodes.discovery.measure import Measure, take_measure
from dt_station_nodes.discovery.regrown import regrown
from dt_station_nodes.discovery.selection import Bench, Explanation, fit_null
from dt_station_nodes.discovery.terms import nominal_terms

from .far_workers import FarWorkers
from .pistons import PAPER, PATH, TIME_S, fitted, problem_of

ASYMMETRY = {"asymmetry": -0.3}
LAGS = {"time_constant_s": 0.08, "second_s": 0.06}
OBJECT = PAPER.with_effect(Channel.POSITION, "asymmetric_gain", ASYMMETRY).with_effect(
    Channel.POSITION, "extra_lag", LAGS
)
SLOW, QUICK = (1.3 * np.sin(w * TIME_S) for w in (0.8 * np.pi, 2.2 * np.pi))


@pytest.fixture(scope="module")
def bench() -> Bench:
    """A cylinder of unequal areas behind a valve and an amplifier that both lag."""
    path = OBJECT.paths[Channel.POSITION]
    problem = problem_of(path, SLOW, SLOW, 1)
    return Bench(problem, nominal_terms(PATH, problem.signal), problem_of(path, QUICK, QUICK, 2))


@pytest.fixture(scope="module")
def null(bench: Bench) -> Explanation:
    return fit_null(bench, PATH)


@pytest.fixture(scope="module")
def single(bench: Bench) -> Explanation:
    return fitted(bench, {"asymmetric_gain": ASYMMETRY})


@pytest.fixture(scope="module")
def rival(bench: Bench) -> Explanation:
    """A transport of which some parts take longer does nearly what two lags do."""
    return fitted(bench, {"asymmetric_gain": ASYMMETRY, "delay": {"delay_s": 0.1, "mixing": 0.3}})


def test_a_set_that_was_never_refined_is_found(
    bench: Bench, null: Explanation, single: Explanation, rival: Explanation
) -> None:
    bent = {**ASYMMETRY, "centre_v": 0.1, "rounding_v": 0.1}
    behind = fitted(bench, {"asymmetric_gain": bent, "extra_lag": {"time_constant_s": 0.14}})
    known = [null, single, rival, behind]
    measure = take_measure(bench, known)
    assert best_set(null, known, measure) is rival
    found, _ = regrown(bench, null, known, measure)
    assert [e.added for e in found] == [e.added for e in known]
    best = best_set(null, found, take_measure(bench, found))
    assert best.added == ("asymmetric_gain", "extra_lag")
    assert best.freed["asymmetric_gain"] == Candidate("asymmetric_gain").required
    lag = best.fit.path.effect("extra_lag").parameters
    own_s = [path.time_scale / path.denominator[-2] for path in (PATH, best.fit.path)]
    assert lag["time_constant_s"] + lag["second_s"] + own_s[1] == pytest.approx(sum(LAGS.values()) + own_s[0], rel=0.05)
    assert lag["second_s"] > 0.01
    gain = best.fit.path.effect("asymmetric_gain").parameters
    assert gain["asymmetry"] == pytest.approx(ASYMMETRY["asymmetry"], rel=0.02)


@pytest.mark.parametrize(("missed", "begun"), [(-0.05, 0), (0.1, 2)])
def test_single_effects_are_begun_anew_where_all_miss_much(
    monkeypatch: pytest.MonkeyPatch, bench: Bench, null: Explanation, single: Explanation, missed: float, begun: int
) -> None:
    seen: list[Explanation] = []
    monkeypatch.setattr(module, "told", lambda _, plain: seen.extend(plain) or plain)
    known = [null, single, fitted(bench, {"asymmetric_gain": ASYMMETRY, "extra_lag": LAGS})]
    measure = take_measure(bench, known)
    noise = [floor * len(p.measured) for floor, p in zip(measure.floors, bench.problems, strict=True)]
    one, other = (replace(single, powers=tuple((1.0 + k * missed) * n for n in noise)) for k in (1, 2))
    regrown(bench, null, [null, one, other], measure)
    assert len(seen) == begun


@pytest.mark.parametrize(("noises", "penalty", "anew"), [(1.0, 0.0, True), (1.3, 0.0, False), (1.0, 40.0, False)])
def test_a_single_effect_that_leaves_noise_of_the_run_alone_is_begun_anew_before_others_are_added(
    monkeypatch: pytest.MonkeyPatch,
    bench: Bench,
    null: Explanation,
    single: Explanation,
    noises: float,
    penalty: float,
    anew: bool,
) -> None:
    seen: list[Explanation] = []
    monkeypatch.setattr(module, "told", lambda _, plain: seen.extend(plain) or plain)
    fit = replace(single.fit, rss=noises * len(single.fit.residual), penalty=penalty)
    known = [null, replace(single, fit=fit)]
    measure = take_measure(bench, known)
    regrown(bench, null, known, measure, where_full=True)
    assert bool(seen) is anew
    regrown(bench, null, known, measure)
    assert len(seen) == 1 + anew


def test_what_comes_out_worse_is_not_kept(
    monkeypatch: pytest.MonkeyPatch, bench: Bench, null: Explanation, single: Explanation, rival: Explanation
) -> None:
    def worse(_: Measure, plain: list[Explanation]) -> list[Explanation]:
        return [replace(one, powers=tuple(2.0 * power for power in one.powers)) for one in plain]

    monkeypatch.setattr(module, "told", worse)
    known = [null, single, rival]
    assert regrown(bench, null, known, take_measure(bench, known))[0] == known


def test_what_begins_from_the_same_plain_form_is_not_begun_again(
    monkeypatch: pytest.MonkeyPatch, bench: Bench, null: Explanation, single: Explanation, rival: Explanation
) -> None:
    seen: list[tuple[str, ...]] = []
    monkeypatch.setattr(module, "told", lambda _, plain: seen.extend(e.added for e in plain) or plain)
    known = [null, single, rival]
    measure = take_measure(bench, known)
    _, begun = regrown(bench, null, known, measure)
    assert sorted(seen) == sorted([single.added, rival.added])
    seen.clear()
    found, again = regrown(bench, null, known, measure, begun=[pickle.loads(pickle.dumps(e)) for e in begun])
    assert not seen
    assert found == known
    assert len(again) == len(begun)
    elsewhere = replace(single, powers=tuple(1.1 * power for power in single.powers))
    _, more = regrown(bench, null, [null, elsewhere, rival], measure, begun=begun)
    assert seen == [single.added]
    assert len(more) == len(begun) + 1


def test_it_needs_another_run(bench: Bench, null: Explanation, single: Explanation, rival: Explanation) -> None:
    known = [null, single, rival]
    assert regrown(replace(bench, check=None), null, known, take_measure(bench, known))[0] == known


def test_other_processes_can_do_it(bench: Bench, null: Explanation, single: Explanation, rival: Explanation) -> None:
    known = [null, single, rival]
    far = replace(bench, workers=FarWorkers())
    found, _ = regrown(far, null, known, take_measure(far, known))
    near, _ = regrown(bench, null, known, take_measure(bench, known))
    assert [e.powers for e in found] == [e.powers for e in near]
    assert [e.powers for e in found] != [e.powers for e in known]
