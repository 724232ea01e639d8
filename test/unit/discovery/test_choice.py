"""Which set is named, by what each leaves of a run: the explanations here leave what the tests say."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))

from cases import Case, make

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import ModelSpec
from dt_station_nodes.discovery import Verdict, channel, choice
from dt_station_nodes.discovery.channel import _decide
from dt_station_nodes.discovery.choice import ENOUGH_TO_NAME, LIKELIER, UNSEEN, best_set, enough
from dt_station_nodes.discovery.measure import Measure
from dt_station_nodes.discovery.problem import make_problem
from dt_station_nodes.discovery.selection import Bench, Explanation, fit_null
from dt_station_nodes.discovery.settings import DiscoverySettings
from dt_station_nodes.discovery.terms import nominal_terms
from dt_station_nodes.discovery.timing import PERIODIC

PAPER = ModelSpec.from_yaml((Path(__file__).resolve().parents[3] / "config/models/paper.yaml").read_text())
TWO = ("delay", "rate_limit")


@pytest.fixture(autouse=True)
def numbered(monkeypatch: pytest.MonkeyPatch) -> None:
    """The sets here have names and no numbers: none is taken for one in name only."""
    monkeypatch.setattr(Explanation, "hollow", False)


@pytest.fixture(scope="module")
def fitted() -> tuple[Measure, Explanation]:
    """A run in which nothing is missing, its null, and the measure that this gives."""
    path = PAPER.paths[Channel.POSITION]
    problem = make_problem(make(Case(seconds=12.0)), PAPER, Channel.POSITION, DiscoverySettings())
    bench = Bench(problem, nominal_terms(path, problem.signal))
    null = fit_null(bench, path)
    return Measure(bench, bench.floors(null), float(len(problem.measured)), rough=False), null


def leaving(fitted: tuple[Measure, Explanation], noises: float, *names: str) -> Explanation:
    """A set that leaves so many times the noise power."""
    measure, null = fitted
    problem = measure.bench.problem
    unit = measure.floors[0] + problem.negligible**2
    power = measure.noise * (1.0 + noises) * unit - len(problem.measured) * problem.negligible**2
    found = replace(null, added=names, powers=(power,))
    assert measure.left(found) == pytest.approx(noises * measure.noise)
    return found


@pytest.mark.parametrize(("left", "both"), [(0.0, True), (0.05, True), (0.1, False), (0.45, False)])
def test_beside_a_large_effect_a_faint_one_is_named_where_it_takes_most_of_what_was_left(
    fitted: tuple[Measure, Explanation], left: float, both: bool
) -> None:
    null, one = leaving(fitted, 1000.0), leaving(fitted, 0.5, "delay")
    two = leaving(fitted, left, "delay", "rate_limit")
    best = best_set(null, [null, one, two], fitted[0])
    assert best.added == (("delay", "rate_limit") if both else ("delay",))


@pytest.mark.parametrize(("other", "beside"), [(("hysteresis",), True), (("friction",), False)])
def test_a_loop_bent_beyond_what_one_is_stands_for_a_gap(
    fitted: tuple[Measure, Explanation], monkeypatch: pytest.MonkeyPatch, other: tuple[str, ...], beside: bool
) -> None:
    monkeypatch.setattr(choice, "certain", lambda *_: False)
    gap, ahead = leaving(fitted, 0.5, "backlash"), leaving(fitted, 0.1, *other)
    assert choice.rivals_with(gap, ahead, fitted[0]) is beside
    both = leaving(fitted, 0.1, "hysteresis", "delay")
    assert not choice.rivals_with(gap, both, fitted[0])


@pytest.mark.parametrize(("before", "both"), [(0.2, False), (0.4, True)])
def test_what_explains_little_of_the_noise_power_is_the_form_of_the_effect_before(
    fitted: tuple[Measure, Explanation], before: float, both: bool
) -> None:
    null, one = leaving(fitted, 1000.0), leaving(fitted, before, "delay")
    two = leaving(fitted, 0.0, "delay", "rate_limit")
    best = best_set(null, [null, one, two], fitted[0])
    assert best.added == (("delay", "rate_limit") if both else ("delay",))


@pytest.mark.parametrize(
    ("before", "after", "fewer", "both"),
    [(0.2, 0.02, 1, True), (0.2, 0.02, 0, False), (0.2, 0.04, 1, False), (0.04, 0.0, 1, False)],
)
def test_the_form_of_one_effect_takes_no_more_numbers_than_a_second_that_explains_it(
    fitted: tuple[Measure, Explanation], before: float, after: float, fewer: int, both: bool
) -> None:
    null, one = leaving(fitted, 1000.0), leaving(fitted, before, "delay")
    two = leaving(fitted, after, "delay", "rate_limit")
    kept, fit = slice(two.fit.freedoms - fewer), two.fit
    plainer = replace(
        fit,
        hypothesis=replace(fit.hypothesis, terms=fit.hypothesis.terms[kept]),
        fitted=replace(fit.fitted, x=fit.fitted.x[kept], jacobian=fit.fitted.jacobian[:, kept]),
    )
    best = best_set(null, [null, one, replace(two, fit=plainer)], fitted[0])
    assert best.added == (("delay", "rate_limit") if both else ("delay",))


@pytest.mark.parametrize(("after", "both"), [(0.02, True), (0.04, False)])
def test_a_tone_is_no_form_of_the_effect_before_however_many_numbers_it_takes(
    fitted: tuple[Measure, Explanation], monkeypatch: pytest.MonkeyPatch, after: float, both: bool
) -> None:
    monkeypatch.setattr(choice, "sensible", lambda *_: True)
    null, one = leaving(fitted, 1000.0), leaving(fitted, 0.2, "delay")
    two = leaving(fitted, after, "delay", PERIODIC)
    best = best_set(null, [null, one, two], fitted[0])
    assert best.added == (("delay", PERIODIC) if both else ("delay",))


@pytest.mark.parametrize(("times", "seen"), [(1.5, False), (2.5, True)])
def test_a_gap_of_the_size_of_what_is_neglected_is_none(
    fitted: tuple[Measure, Explanation], times: float, seen: bool
) -> None:
    measure, null = fitted
    problem = measure.bench.problem
    power = (measure.floors[0] + (times * problem.negligible) ** 2) * len(problem.measured)
    assert measure.seen(replace(null, powers=(power,))) is seen


@pytest.mark.parametrize(("widths", "gain"), [(3.0, UNSEEN * ENOUGH_TO_NAME), (8.0, ENOUGH_TO_NAME), (20.0, LIKELIER)])
def test_where_a_refit_leaves_no_gap_a_name_has_to_gain_less_the_stranger_its_parameters(
    fitted: tuple[Measure, Explanation], widths: float, gain: float
) -> None:
    measure, null = fitted
    x = null.fit.fitted.x.copy()
    x[0] = null.fit.hypothesis.terms[0].centre + widths * null.fit.hypothesis.terms[0].prior
    refitted = replace(null, fit=replace(null.fit, fitted=replace(null.fit.fitted, x=x)))
    assert enough(refitted, measure) == gain
    # Where a gap is left, or the whole path is refitted anyway, parameters say nothing.
    assert enough(replace(refitted, powers=(1e6,)), measure) == ENOUGH_TO_NAME
    assert enough(refitted, replace(measure, rough=True)) >= ENOUGH_TO_NAME


def test_what_is_missed_is_a_share_of_the_signal(fitted: tuple[Measure, Explanation]) -> None:
    measure, null = fitted
    problem = measure.bench.problem
    power = len(problem.measured) * (measure.floors[0] + (0.2 * problem.signal) ** 2)
    assert measure.missed(replace(null, powers=(power,))) == pytest.approx(0.2)
    assert measure.missed(replace(null, powers=(0.5 * len(problem.measured) * measure.floors[0],))) == 0.0
    assert np.isfinite(measure.missed(null))


@pytest.mark.parametrize(("share", "verdict"), [(0.1, Verdict.NAMED), (0.15, Verdict.UNEXPLAINED)])
def test_what_misses_an_eighth_of_the_signal_is_not_named(
    fitted: tuple[Measure, Explanation], share: float, verdict: Verdict
) -> None:
    measure, null = fitted
    problem = measure.bench.problem
    before, after = (
        replace(null, added=names, powers=(len(problem.measured) * (gap * problem.signal) ** 2,))
        for names, gap in (((), 5.0), (("delay",), share))
    )
    assert _decide(measure.bench, null.fit.residual, before, [before, after], interrupted=False).verdict is verdict


@pytest.mark.parametrize(
    ("left", "bending", "verdict"),
    [(3.0, 0.0, Verdict.NAMED), (3.0, 10.0, Verdict.UNEXPLAINED), (1.0, 10.0, Verdict.NAMED)],
)
def test_several_effects_that_bend_the_model_explain_all_of_the_gap(
    fitted: tuple[Measure, Explanation], left: float, bending: float, verdict: Verdict
) -> None:
    null, one = leaving(fitted, 100.0), leaving(fitted, 70.0, "delay")
    two = leaving(fitted, left, "delay", "rate_limit")
    known = [null, one, replace(two, fit=replace(two.fit, penalty=bending))]
    found = _decide(fitted[0].bench, null.fit.residual, null, known, interrupted=False)
    assert found.verdict is verdict


@pytest.mark.parametrize(("alone", "verdict"), [(4.0, Verdict.UNEXPLAINED), (12.0, Verdict.NAMED)])
def test_it_is_no_further_effect_that_bends_a_model_bent_by_one_of_them(
    fitted: tuple[Measure, Explanation], alone: float, verdict: Verdict
) -> None:
    null, one, two = (leaving(fitted, left, *names) for left, names in ((100.0, ()), (70.0, ("delay",)), (3.0, TWO)))
    known = [null, replace(one, fit=replace(one.fit, penalty=alone)), replace(two, fit=replace(two.fit, penalty=10.0))]
    assert _decide(fitted[0].bench, null.fit.residual, null, known, interrupted=False).verdict is verdict


@pytest.mark.parametrize(("others", "named"), [(2, TWO), (3, ("delay",))])
def test_what_three_others_would_do_as_well_beside_an_effect_is_its_form(
    fitted: tuple[Measure, Explanation], monkeypatch: pytest.MonkeyPatch, others: int, named: tuple[str, ...]
) -> None:
    monkeypatch.setattr(choice, "certain", lambda *_: True)
    monkeypatch.setattr(channel, "sensible", lambda *_: True)
    null, one, two = (leaving(fitted, left, *names) for left, names in ((100.0, ()), (5.0, ("delay",)), (0.5, TWO)))
    as_well = [leaving(fitted, 0.5, "delay", name) for name in ("bias", "backlash", "hysteresis")[:others]]
    monkeypatch.setattr(channel, "best_set", lambda _, known, __: two if two in known else one)
    found = _decide(fitted[0].bench, null.fit.residual, null, [null, one, two, *as_well], interrupted=False)
    assert found.verdict is Verdict.NAMED
    assert found.best.added == named


@pytest.mark.parametrize(
    ("beside", "left", "named"),
    [
        (("delay", "memory"), 0.55, ("delay",)),
        (("delay", "memory"), 0.8, TWO),
        (("fatigue", "memory"), 0.55, TWO),
    ],
)
def test_what_a_form_without_a_name_would_do_as_well_beside_an_effect_is_its_form(
    fitted: tuple[Measure, Explanation],
    monkeypatch: pytest.MonkeyPatch,
    beside: tuple[str, str],
    left: float,
    named: tuple[str, ...],
) -> None:
    monkeypatch.setattr(channel, "stranger", lambda *_, **__: "")
    null, one, two = (leaving(fitted, left, *names) for left, names in ((100.0, ()), (5.0, ("delay",)), (0.5, TWO)))
    monkeypatch.setattr(channel, "best_set", lambda _, known, __: two if two in known else one)
    known = [null, one, two, leaving(fitted, left, *beside)]
    found = _decide(fitted[0].bench, null.fit.residual, null, known, interrupted=False)
    assert found.verdict is Verdict.NAMED
    assert found.best.added == named


@pytest.mark.parametrize(("alone", "verdict"), [(5.0, Verdict.NAMED), (40.0, Verdict.UNEXPLAINED)])
def test_a_larger_set_that_a_stranger_makes_doubtful_leaves_the_name_that_is_believed(
    fitted: tuple[Measure, Explanation], monkeypatch: pytest.MonkeyPatch, alone: float, verdict: Verdict
) -> None:
    monkeypatch.setattr(channel, "stranger", lambda best, *_, **__: "memory" if len(best.added) > 1 else "")
    null, one, two = (leaving(fitted, left, *names) for left, names in ((100.0, ()), (alone, ("delay",)), (0.1, TWO)))
    monkeypatch.setattr(channel, "best_set", lambda _, known, __: two if two in known else one)
    found = _decide(fitted[0].bench, null.fit.residual, null, [null, one, two], interrupted=False)
    assert found.verdict is verdict
    assert found.best.added == (("delay",) if verdict is Verdict.NAMED else TWO)


@pytest.mark.parametrize(("widths", "named"), [(4.5, False), (5.5, True)])
def test_a_parameter_further_off_than_models_are_needs_no_more_evidence_than_a_gap(
    fitted: tuple[Measure, Explanation], monkeypatch: pytest.MonkeyPatch, widths: float, named: bool
) -> None:
    monkeypatch.setattr(choice, "_stands", lambda *_: True)
    measure, given = fitted
    terms, x = given.fit.hypothesis.terms, given.fit.fitted.x.copy()
    place = next(i for i, term in enumerate(terms) if term.name == "time_scale")
    x[place] = terms[place].centre + widths * terms[place].prior
    bent = replace(given.fit, fitted=replace(given.fit.fitted, x=x), penalty=10.0)
    null = replace(leaving(fitted, 0.0), fit=bent)
    one = leaving(fitted, 0.0, "delay")
    score = measure.score(null) - measure.score(one)
    told = replace(one, fit=replace(one.fit, penalty=score - 1.2 * ENOUGH_TO_NAME))
    best = best_set(null, [null, told], measure)
    assert bool(best.added) is named


@pytest.mark.parametrize(("still_bent", "verdict"), [(9.0, Verdict.NOTHING_MISSING), (1.0, Verdict.NAMED)])
def test_where_no_gap_shows_a_name_has_to_straighten_the_parameters(
    fitted: tuple[Measure, Explanation], monkeypatch: pytest.MonkeyPatch, still_bent: float, verdict: Verdict
) -> None:
    measure, _ = fitted
    bent, one = leaving(fitted, 0.0), leaving(fitted, 0.0, "delay")
    null = replace(bent, fit=replace(bent.fit, penalty=10.0))
    named = replace(one, fit=replace(one.fit, penalty=still_bent))
    monkeypatch.setattr(channel, "best_set", lambda *_: named)
    found = _decide(measure.bench, null.fit.residual, null, [null, named], interrupted=False)
    assert found.verdict is verdict


@pytest.mark.parametrize(
    ("left", "other_leaves", "told_together"), [(0.1, 0.3, True), (0.1, 0.5, False), (0.02, 0.06, False)]
)
def test_a_name_that_leaves_a_little_is_told_with_one_that_leaves_not_much_more(
    fitted: tuple[Measure, Explanation],
    monkeypatch: pytest.MonkeyPatch,
    left: float,
    other_leaves: float,
    told_together: bool,
) -> None:
    measure, _ = fitted
    null, named, other = (leaving(fitted, *one) for one in ((5.0,), (left, "dead_zone"), (other_leaves, "friction")))
    monkeypatch.setattr(channel, "best_set", lambda *_: named)
    monkeypatch.setattr(channel, "sensible", lambda *_: True)
    found = _decide(measure.bench, null.fit.residual, null, [null, named, other], interrupted=False)
    assert found.alternatives == ((("friction",),) if told_together else ((),))


@pytest.mark.parametrize(("behind", "equal"), [(30.0, True), (50.0, False)])
@pytest.mark.parametrize("swapped", [False, True])
def test_two_limits_are_told_apart_by_more_than_how_they_bend(
    fitted: tuple[Measure, Explanation],
    monkeypatch: pytest.MonkeyPatch,
    behind: float,
    equal: bool,
    swapped: bool,
) -> None:
    measure, _ = fitted
    more = float(np.expm1(behind / measure.samples))
    names = ("overflow", "saturation")[:: -1 if swapped else 1]
    null, named, limit, loop = (
        leaving(fitted, *one) for one in ((5.0,), (0.0, names[0]), (more, names[1]), (more, "backlash"))
    )
    assert measure.score(limit) - measure.score(named) == pytest.approx(behind, rel=0.05)
    monkeypatch.setattr(channel, "best_set", lambda *_: named)
    monkeypatch.setattr(channel, "sensible", lambda *_: True)
    found = _decide(measure.bench, null.fit.residual, null, [null, named, limit, loop], interrupted=False)
    assert found.alternatives == (((names[1],),) if equal else ((),))


def test_what_is_there_in_name_only_stands_for_no_name(
    fitted: tuple[Measure, Explanation], monkeypatch: pytest.MonkeyPatch
) -> None:
    measure, _ = fitted
    null, named, other = leaving(fitted, 5.0), leaving(fitted, 0.1, "dead_zone"), leaving(fitted, 0.3, "friction")
    monkeypatch.setattr(channel, "best_set", lambda *_: named)
    monkeypatch.setattr(channel, "sensible", lambda *_: True)
    monkeypatch.setattr(Explanation, "hollow", property(lambda self: self is other))
    found = _decide(measure.bench, null.fit.residual, null, [null, named, other], interrupted=False)
    assert found.verdict is Verdict.NAMED
    assert found.alternatives == ((),)


@pytest.mark.parametrize(("alone", "named"), [(29.0, ("delay",)), (80.0, TWO)])
def test_a_second_name_that_could_be_many_has_to_mend_much_where_the_first_is_not_believed(
    fitted: tuple[Measure, Explanation], monkeypatch: pytest.MonkeyPatch, alone: float, named: tuple[str, ...]
) -> None:
    monkeypatch.setattr(choice, "certain", lambda *_: True)
    monkeypatch.setattr(channel, "sensible", lambda *_: True)
    null, one, two = (leaving(fitted, left, *names) for left, names in ((150.0, ()), (alone, ("delay",)), (15.0, TWO)))
    as_well = [leaving(fitted, 15.0, "delay", name) for name in ("bias", "backlash", "hysteresis")]
    monkeypatch.setattr(channel, "best_set", lambda _, known, __: two if two in known else one)
    found = _decide(fitted[0].bench, null.fit.residual, null, [null, one, two, *as_well], interrupted=False)
    assert found.best.added == named


@pytest.mark.parametrize(
    ("other", "verdict"), [(("dead_zone", "delay"), Verdict.NAMED), (("delay", "friction"), Verdict.UNEXPLAINED)]
)
def test_what_a_larger_set_with_the_name_explains_besides_mends_its_form_and_what_others_do_doubts_it(
    fitted: tuple[Measure, Explanation],
    monkeypatch: pytest.MonkeyPatch,
    other: tuple[str, ...],
    verdict: Verdict,
) -> None:
    measure, _ = fitted
    null, named, larger = leaving(fitted, 10.0), leaving(fitted, 1.0, "dead_zone"), leaving(fitted, 0.1, *other)
    monkeypatch.setattr(channel, "best_set", lambda *_: named)
    known = [null, named, larger, leaving(fitted, 3.0, "friction")]
    found = _decide(measure.bench, null.fit.residual, null, known, interrupted=False)
    assert found.verdict is verdict
