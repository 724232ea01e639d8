"""What a search follows of all that it tries at once."""

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from dt_station_nodes.discovery.candidates import Candidate
from dt_station_nodes.discovery.further_forms import AT_REST, WORN
from dt_station_nodes.discovery.selection import Bench, Explanation
from dt_station_nodes.discovery.tasks import (
    FOREMOST,
    HOPELESS,
    OUTRUN,
    SETTLED,
    StoppedError,
    Task,
    against,
    best_of,
    done_again,
    each,
    forlorn,
    in_turn,
    to_settle,
    told_apart,
    within_reach,
)
from dt_station_nodes.workers import ALONE


def explained(
    cost: float, held: bool = False, added: tuple[str, ...] = (), full: bool = False, inside: bool = True
) -> Explanation:
    fit = SimpleNamespace(fitted=SimpleNamespace(cost=cost), path=SimpleNamespace(effects=added), full=full)
    return cast("Explanation", SimpleNamespace(fit=fit, held=held, added=added, inside=inside))


BASE = explained(1e3)


def bench_of(rough: bool = False) -> Bench:
    bench = SimpleNamespace(rough=rough, workers=ALONE, progress=None)
    bench.alone = bench
    return cast("Bench", bench)


def task(
    name: str, cost: float, *finer: float, apart: bool = False, rival: float = np.inf, base: Explanation = BASE
) -> Task:
    forms = tuple(explained(one) for one in finer)
    return Task(base, Candidate(name, apart=apart), seen=explained(cost), finer=forms, rival=rival)


def test_what_is_tried_is_held_against_the_best_form_of_all() -> None:
    tasks = [task("friction", 9.0), task("dead_zone", 7.0, 5.0), task("bias", 6.0, rival=3.0)]
    assert [t.rival for t in against(tasks)] == [SETTLED * 5.0, SETTLED * 5.0, 3.0]
    assert [t.rival for t in against(tasks, 1.3)] == [1.3 * 5.0, 1.3 * 5.0, 3.0]
    assert against([]) == []


@pytest.mark.parametrize(("reached", "rival"), [(np.inf, SETTLED * 5.0), (4.0, SETTLED * 4.0)])
def test_what_was_followed_no_further_is_settled_all_the_same(reached: float, rival: float) -> None:
    tasks = [task("dead_zone", 7.0, 5.0, rival=3.0), task("bias", 6.0)]
    assert [t.rival for t in to_settle(tasks, reached)] == [rival, rival]


def test_the_best_keep_their_order_and_a_form_apart_takes_no_ones_place() -> None:
    tasks = [task("friction", 9.0), task("leakage", 3.0, apart=True), task("bias", 4.0), task("delay", 5.0)]
    chosen, others = best_of(tasks, 2)
    assert [t.candidate.name for t in chosen] == ["leakage", "bias", "delay"]
    assert [t.candidate.name for t in others] == ["friction"]


def test_a_further_form_takes_no_ones_place() -> None:
    more = [Task(BASE, Candidate("leakage", also=form), seen=explained(3.0)) for form in (AT_REST, WORN)]
    tasks = [task("friction", 9.0), *more, task("bias", 4.0), task("delay", 5.0)]
    chosen, others = best_of(tasks, 2)
    assert [t.candidate.name for t in chosen] == ["leakage", "leakage", "bias", "delay"]
    assert [t.candidate.name for t in others] == ["friction"]


def test_a_single_effects_form_apart_brings_its_plain_one_along() -> None:
    """A wander is sought in both: where neither explains anything yet, the dispersed delay may not keep out the other.

    The same on a base with effects of its own is left to the costs.
    """
    costs = (("bias", 4.0, False), ("delay", 5.0, True), ("friction", 6.0, False), ("delay", 7.0, False))
    chosen, others = best_of([task(name, cost, apart=apart) for name, cost, apart in costs], 1)
    assert [(t.candidate.name, t.candidate.apart) for t in chosen] == [
        ("bias", False),
        ("delay", True),
        ("delay", False),
    ]
    assert [t.candidate.name for t in others] == ["friction"]
    more = explained(1e3, added=("leakage",))
    chosen, _ = best_of([task(name, cost, apart=apart, base=more) for name, cost, apart in costs], 1)
    assert [(t.candidate.name, t.candidate.apart) for t in chosen] == [("bias", False), ("delay", True)]


@pytest.mark.parametrize(
    ("first", "other"),
    [
        ("dead_zone", "friction"),
        ("friction", "dead_zone"),
        ("backlash", "hysteresis"),
        ("delay", "extra_lag"),
        ("load_dependent_gain", "asymmetric_gain"),
        ("load_dependent_gain", "leakage"),
        ("rate_limit", "saturation"),
    ],
)
def test_the_foremost_single_effect_brings_along_what_it_is_most_easily_taken_for(first: str, other: str) -> None:
    """A dead zone whose edges differ leaves less at a glance than the friction that a refined form tells it from."""
    costs = ((first, 3.0), ("bias", 4.0), (other, 9.0), ("cubic_stiffness", 8.0))
    chosen, _ = best_of([task(*cost) for cost in costs], 2)
    assert [t.candidate.name for t in chosen] == [first, "bias", other]
    chosen, _ = best_of([task(*cost) for cost in (("bias", 2.0), *costs)], 2)
    assert [t.candidate.name for t in chosen] == ["bias", first]
    more = explained(1e3, added=("bias",))
    chosen, _ = best_of([task(*cost, base=more) for cost in costs], 1)
    assert [t.candidate.name for t in chosen] == [first]


@pytest.mark.parametrize(
    ("full", "inside", "hopeless"), [(True, True, True), (False, True, False), (True, False, False)]
)
def test_only_a_name_that_leaves_noise_leaves_others_hopeless(full: bool, inside: bool, hopeless: bool) -> None:
    """Where each leaves a gap, how large it is says nothing of how much a refined form leaves."""
    best = Task(BASE, Candidate("bias"), seen=explained(1.0, full=full, inside=inside))
    tasks = [task("friction", 1.1 * HOPELESS), best, task("dead_zone", 1.1 * HOPELESS, 0.9 * HOPELESS)]
    near, far = within_reach(tasks)
    assert [t.candidate.name for t in near] == (
        ["bias", "dead_zone"] if hopeless else ["friction", "bias", "dead_zone"]
    )
    assert [t.candidate.name for t in far] == (["friction"] if hopeless else [])
    assert {t.ahead for t in near} == {1.0 if hopeless else np.inf}


@pytest.mark.parametrize("full", [True, False])
def test_the_foremost_two_are_refined_first_and_the_others_held_against_what_these_come_to(full: bool) -> None:
    tasks = [task("friction", 9.0), task("bias", 5.0), task("backlash", 8.0), task("dead_zone", 6.0)]
    seen: list[tuple[str, float]] = []

    def work(_: Bench, one: Task) -> Task:
        seen.append((one.candidate.name, one.ahead))
        cost = 2.0 if one.candidate.name == "dead_zone" else 4.0
        return replace(one, finer=(explained(cost, full=full),))

    done = in_turn(bench_of(), work, tasks, [])
    ahead = 2.0 if full else np.inf
    assert seen == [("bias", np.inf), ("dead_zone", np.inf), ("friction", ahead), ("backlash", ahead)]
    assert [one.candidate.name for one in done] == [one.candidate.name for one in tasks]
    assert all(one.finer for one in done)
    assert in_turn(bench_of(), work, [], []) == []


def test_what_the_foremost_came_to_is_kept_when_the_others_are_interrupted() -> None:
    tasks = [task("friction", 9.0), task("bias", 5.0), task("dead_zone", 6.0)]

    def work(_: Bench, one: Task) -> Task:
        if one.candidate.name == "friction":
            raise KeyboardInterrupt
        return replace(one, seen=explained(1.0))

    with pytest.raises(StoppedError) as stop:
        in_turn(bench_of(), work, tasks, tasks)
    assert [e.fit.fitted.cost for e in stop.value.found] == [9.0, 5.0, 6.0, 1.0, 1.0]


@pytest.mark.parametrize("full", [True, False])
def test_what_is_behind_many_names_is_given_up_sooner(full: bool) -> None:
    best = Task(BASE, Candidate("bias"), seen=explained(1.0, full=full))
    others = [task(f"name {i}", 1.1 * OUTRUN + i) for i in range(FOREMOST - 1)]
    last, again = task("friction", 0.9 * HOPELESS), task("name 1", 0.9 * HOPELESS)
    assert within_reach([last, *others, again, best])[1] == ([last] if full else [])
    assert within_reach([last, *others[1:], best])[1] == []


@pytest.mark.parametrize(("rough", "known"), [(False, [5.0, 4.0]), (True, [4.0])])
def test_a_search_that_is_stopped_gives_what_it_knew(rough: bool, known: list[float]) -> None:
    """On rough data a glance judges nothing: only what blocks held out have judged is known."""
    results = {"friction": explained(5.0), "dead_zone": explained(4.0, held=True)}

    def work(_: Bench, one: Task) -> Task:
        if one.candidate.name not in results:
            raise KeyboardInterrupt
        return Task(BASE, one.candidate, seen=results[one.candidate.name])

    tasks = [Task(BASE, Candidate(name)) for name in ("friction", "dead_zone", "bias", "delay")]
    with pytest.raises(StoppedError) as stopped:
        each(bench_of(rough), work, tasks)
    assert [e.fit.fitted.cost for e in stopped.value.found] == known


def test_what_was_done_before_is_known_when_it_is_stopped() -> None:

    def work(_: Bench, __: Task) -> Task:
        raise KeyboardInterrupt

    done = [task("bias", 3.0), task("delay", 4.0)]
    with pytest.raises(StoppedError) as stopped:
        each(bench_of(), work, done[:1], before=done)
    assert [e.fit.fitted.cost for e in stopped.value.found] == [3.0, 4.0]


@pytest.mark.parametrize("count", [1, 2])
def test_a_task_that_has_none_beside_it_may_share_its_own_work(count: int) -> None:
    bench, alone = bench_of(), bench_of()
    cast("SimpleNamespace", bench).alone = alone
    worked_on: list[Bench] = []

    def work(given: Bench, one: Task) -> Task:
        worked_on.append(given)
        return one

    each(bench, work, [task("friction", 1.0)] * count)
    assert worked_on == ([bench] if count == 1 else [alone, alone])


@pytest.mark.parametrize(("behind", "again"), [(0.9, True), (1.1, False)])
def test_what_another_name_outruns_is_not_done_again(behind: float, again: bool) -> None:
    best = Task(BASE, Candidate("bias"), seen=explained(1.0, full=True))
    before = [task("friction", 7.0), task("bias", 9.0), task("delay", 8.0)]
    done = [task("friction", behind * OUTRUN), best, task("delay", 2.0)]

    def work(_: Bench, one: Task) -> Task:
        assert one is before[0]
        return task("friction", 0.5)

    result = done_again(bench_of(), work, before, done, lambda _, t: t.candidate.name == "friction")
    costs = [t.seen.fit.fitted.cost for t in result if t.seen]
    assert costs == [0.5 if again else behind * OUTRUN, 1.0, 2.0]
    assert result[1:] == done[1:]


def test_of_two_bases_glances_that_are_the_same_go_on_once() -> None:
    """A set of effects has its own bases: what is added to one is no twin of what is added to another."""
    bare, more = explained(1e3), explained(1e3, added=("leakage",))
    kept, twin, other = task("friction", 5.0), task("friction", 5.0 + 1e-6, base=bare), task("bias", 4.0, base=bare)
    apart = task("friction", 5.0, apart=True, base=bare)
    assert told_apart([kept, twin, other, apart]) == [kept, other, apart]
    unlike = task("friction", 5.1, base=bare)
    assert told_apart([kept, unlike]) == [kept, unlike]
    beside = [task("friction", 5.0, base=more), task("friction", 5.0, base=more)]
    assert told_apart(beside) == beside


@pytest.mark.parametrize(("least", "lost"), [(7.9, False), (8.1, True)])
def test_where_each_refinement_is_far_behind_the_rival_all_of_them_are_forlorn(least: float, lost: bool) -> None:
    one = task("friction", 20.0, rival=2.0)
    assert forlorn(one, [explained(30.0), explained(least)]) is lost
    assert not forlorn(one, [])
    assert not forlorn(task("friction", 20.0), [explained(30.0)])
