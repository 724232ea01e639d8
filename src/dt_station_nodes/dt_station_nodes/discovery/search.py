"""Forward selection: every candidate fitted jointly with the nominal parameters, on bases that grow."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ..core.models import PathSpec
from .beginnings import BEGINS
from .candidates import Candidate, all_starts, hypothesis, library, pair_starts
from .distinct import distinct
from .further_forms import BELL
from .glance import glance, spared, starts_of
from .hypothesis_fit import Group, fit_groups, fit_hypothesis
from .mode_starts import mode_starts
from .parsimony import as_near, at_usual, without
from .refinements import ANSWER, GRIP, Refinements, refined_starts, refinements, step_starts
from .score_test import effects_of, far_behind, gain, hopeless, least_cost
from .selection import Bench, Explanation, penalised
from .sequence import in_sequence
from .start_groups import by_form, unbent, unlike
from .stick_slip import climbed, far_from_top
from .strangers import SAME
from .tasks import (
    SETTLED,
    Task,
    against,
    best_of,
    done_again,
    each,
    forlorn,
    forms_of,
    in_turn,
    to_settle,
    told_apart,
    within_reach,
)

Array = NDArray[np.float64]
_Names = tuple[str, ...]
_Steps = tuple[list[Explanation], dict[str, Explanation], bool]

SEEN = 1.3  # times the best glance's cost: what will not get below it is not worth its way
_MANY = 4  # starts to follow of a contact that grips


def _plain(bench: Bench, task: Task, far: bool = False) -> Task:
    """The plain form from several starts; `far`: on the best of all stairs that it may be on."""
    problem, base, candidate = bench.problem, task.base, task.candidate
    starts, near, like = starts_of(bench, task, task.known)
    groups = [Group(starts if task.seen is None else [task.seen.fit.fitted.x], 2)]
    groups += [Group(apart, 1) for apart in by_form(like, starts)]
    anew = [Group(near, 2), Group(starts, 1, passed=1)]
    if len(base.added) == 1:
        pairs = pair_starts(problem, base.fit.path, base.added[0], candidate, base.fit.residual, like)
        anew.append(Group(pairs, 2))
    fit, *others = fit_groups(problem, like, *spared(task, groups, anew), bench.iterations, task.rival, task.known)
    fit = climbed(problem, task.added, fit, base.fit, far, bench.workers)
    freed = {**task.freed, candidate.name: candidate.required}
    found, candidate = in_sequence(bench, bench.explained(fit, task.added, freed, glance=True), candidate)
    near_by = as_near(bench, found, others)
    if candidate.also:
        plainer = without(bench, found, candidate.name, candidate.also)
        # A form with more numbers that fits worse went astray: the way on begins where it did not.
        found, beaten = sorted((found, plainer), key=lambda e: e.fit.fitted.cost)
        near_by = (*near_by, bench.judged(beaten))
    apart = [] if bench.rough else [f for f in others if unlike(fit, f)]
    other = bench.explained(apart[0], task.added, freed, glance=True) if apart else None
    return replace(task, candidate=candidate, seen=bench.judged(found), other=other, finer=near_by)


def _on_wrong_stairs(bench: Bench, task: Task) -> bool:
    return task.seen is not None and far_from_top(bench.problem, task.added, task.seen.fit, task.base.fit)


def _refined(bench: Bench, task: Task) -> Task:
    """Refined forms around the plain one: with its best single refinement, and with all of them."""
    if task.seen is None:
        return task
    path = task.seen.fit.path
    left, timed = task.base.fit.residual, not bench.rough
    forms = refinements(bench.problem, path, task.candidate, left, timed, bench.nominal, not task.base.added)
    if not forms.names:
        return task
    ones, alone, hope = _stepped(bench, task, task.seen, forms)
    usual = at_usual(bench, task.candidate.name, alone)
    ones += [*usual, *(_begun(bench, task, forms, (), form.fit.path) for form in usual if forms.begins)]
    if task.other is not None:
        further, _, other_hope = _stepped(bench, task, task.other, forms)
        ones, hope = [*ones, *further], hope or other_hope
    # Where noise is all that is left, a mode is found without; else the base is bent and its minima are shallow.
    modes = mode_starts(bench.problem, task.base.fit.path, task.candidate) if bench.rough else []
    paths = [*(e.fit.path for e in ones), *refined_starts(path, forms), *modes]
    if bench.rough or (hope and not forlorn(task, ones)):
        ones.append(_form(bench, task, forms.names, paths, bench.iterations, 3))
    return replace(task, finer=(*task.finer, *(bench.judged(e) for e in ones)))


def _stepped(bench: Bench, task: Task, plain: Explanation, forms: Refinements) -> _Steps:
    """The best step of refinement from a plain form, others that it must not keep out; and those of one number.

    A step that could not bring a form that is far behind near what is ahead of it is not followed; at the end,
    whether all of them together could.
    """
    few = 1 if bench.rough else 2
    steps: dict[_Names, Explanation] = {}
    path, behind, gains = plain.fit.path, far_behind(bench, plain, task.ahead), 0.0
    timing, heat = tuple(forms.timing), tuple(forms.heat)
    for names in forms.steps:
        starts = step_starts(path, forms, names)
        if behind and names not in {timing, heat, GRIP} and ANSWER not in names:
            changes = effects_of(bench, plain.fit, task.candidate.name, names, starts)
            promised = gain(bench, plain, least_cost(plain.fit, changes))
            if hopeless(promised, behind):
                gains += promised
                continue
        # A few steps do not tell when something comes from how, nor lead from a spring to a stiffer one that is late.
        iterations = bench.iterations if names == timing or ANSWER in names else 4
        keep = _MANY if names in {GRIP, timing} else few
        steps[names] = _form(bench, task, names, starts, iterations, keep)
    gains += sum(gain(bench, plain, step.fit.fitted.cost) for step in steps.values()) if behind else 0.0
    # A grip has many starts: what a contact does otherwise is not to be lost behind it; and under a steady voltage what
    # heats nearly settles: which is the likelier is no matter of their costs.
    grip, warm = steps.pop(GRIP, None), steps.pop(heat, None)

    def followed(names: tuple[str, ...], step: Explanation) -> Explanation:
        return step if bench.rough else _form(bench, task, names, [step.fit.path], bench.iterations, 1)

    ones: list[Explanation] = []
    if steps:
        best = min(steps, key=lambda n: (steps[n].fit.fitted.cost, n))
        ones = [followed(best, steps[best])]
        told = best if task.base.added else _foretelling(bench, steps, best)
        ones += [followed(told, steps[told])] if told != best else []
    if forms.begins:
        ones.append(_begun(bench, task, forms, best if steps else (), ones[0].fit.path if steps else path))
    for other in (grip, warm and followed(heat, warm)):
        if other is not None and all(other.fit.fitted.cost < one.fit.fitted.cost for one in ones):
            ones.append(other)
    alone = {names[0]: e for names, e in steps.items() if len(names) == 1}
    return ones, alone, not (behind and hopeless(gains, behind))


def _begun(bench: Bench, task: Task, forms: Refinements, names: _Names, path: PathSpec) -> Explanation:
    """A form with these names free from where `path` stands, and with where it was when the run began."""
    return _form(bench, task, (*names, BEGINS), step_starts(path, forms, (BEGINS,)), bench.iterations, 1)


def _foretelling(bench: Bench, steps: Mapping[_Names, Explanation], best: _Names) -> _Names:
    """Of steps that the run does not tell from the `best`, the one that foretells the other run clearly better."""
    lead = steps[best]
    worth, floors, cost = bench.worth(lead), bench.floors(lead), max(lead.fit.fitted.cost, 1e-300)
    near = [n for n, e in steps.items() if worth * np.log(max(e.fit.fitted.cost, 1e-300) / cost) < SAME]
    if bench.check is None or bench.rough or len(near) < 2:
        return best
    score = {n: penalised(bench, bench.settled(steps[n]), worth, floors) for n in near}
    told = min(near, key=lambda n: (score[n], n))
    return told if score[told] < score[best] - SAME else best


def _form(
    bench: Bench, task: Task, optional: tuple[str, ...], paths: list[PathSpec], iterations: int, keep: int
) -> Explanation:
    """The form with some optional parameters free too, from where `paths` stand; not judged yet."""
    # A timing may begin with a number of the plain form at another value.
    free = tuple(dict.fromkeys(task.candidate.required + optional))
    freed = {**task.freed, task.candidate.name: free}
    hypotheses = [hypothesis(bench.problem, path, bench.nominal, freed) for path in paths]
    starts = [h.start() for h in hypotheses]
    near = unbent(bench.nominal, starts)
    # A plain fit to jumps leads the nominal parameters astray.
    starts = (near or starts) if optional == GRIP else [*starts, *near]
    fit = fit_hypothesis(bench.problem, hypotheses[0], starts, iterations, keep, rival=task.rival)
    fit = climbed(bench.problem, task.added, fit, task.base.fit)
    return bench.explained(fit, task.added, freed, glance=True)


def _settled(bench: Bench, task: Task) -> Task:
    """The form that earns its parameters; what misses the run by far has nothing to settle on the other."""
    forms = [bench.settled(form) if form.fit.fitted.cost <= task.rival else form for form in forms_of(task)]
    if not forms:
        return task
    nearest = forms[-1]
    samples, floors = bench.worth(nearest), bench.floors(nearest)
    best = min(forms, key=lambda e: (e.hollow, penalised(bench, e, samples, floors)))
    # What is as large as its refined form says may be felt by what comes behind it.
    other = best if bench.rough else in_sequence(bench, best, task.candidate)[0]
    return replace(task, seen=best if other is best else bench.settled(other))


def scan(
    bench: Bench, bases: Iterable[Explanation], most: int, finest: int, reached: float = np.inf
) -> list[Explanation]:
    """Candidates on each base, the best of each set of names, best first by cost.

    All are glanced at, the best `most` of them fitted, the best `finest` of these in their refined form too;
    `reached` is the cost of the best known before.
    """
    # Rough data have shallow minima: all that is fitted there is fitted refined, which a form apart would only disturb.
    pool = library(bench.problem.channel, not bench.rough, bench.problem.loaded)
    tasks = [Task(base, c, rival=SETTLED * reached) for base in bases for c in pool if _tried(base, c)]
    chosen = told_apart(best_of(each(bench, glance, tasks, told=False), most)[0])
    # A single effect may need all its way to be told from another; of larger sets far more are tried than can be one.
    chosen = [task if not task.base.added else held for task, held in zip(chosen, against(chosen, SEEN), strict=True)]
    plain = each(bench, _plain, chosen, before=chosen)
    plain = against(done_again(bench, partial(_plain, far=True), chosen, plain, _on_wrong_stairs))
    near, far = within_reach(plain)
    finer, others = best_of(near, finest) if finest < most else (near, [])
    found = to_settle([*in_turn(bench, _refined, finer, before=plain), *others, *far], reached)
    fitted = each(bench, _settled, found, before=found)
    return sorted(distinct(bench, [t.seen for t in fitted if t.seen]), key=lambda e: (e.fit.fitted.cost, e.added))


def _tried(base: Explanation, candidate: Candidate) -> bool:
    return candidate.name not in base.added and not (base.added and candidate.also == BELL)


def _whole(bench: Bench, task: Task, iterations: int, keep: int) -> Task:
    """The form with all its parameters free, from the best of all their starts."""
    paths = all_starts(bench.problem, task.base.fit.path, task.candidate, task.base.fit.residual)
    names = task.candidate.refining(bench.problem.channel)
    return replace(task, seen=bench.judged(_form(bench, task, names, paths, iterations, keep)))


def scan_whole(bench: Bench, bases: Iterable[Explanation], most: int) -> list[Explanation]:
    """Candidates with all their parameters free from the start, the best `most` fitted, best first by cost.

    Where the plain form of an effect explains nothing, no step leads from it to the form that does.
    """
    pool = [c for c in library(bench.problem.channel, apart=False) if c.optional]
    tasks = [Task(base, c) for base in bases for c in pool if c.name not in base.added]
    chosen, _ = best_of(each(bench, partial(_whole, iterations=3, keep=1), tasks), most)
    whole = each(bench, partial(_whole, iterations=bench.iterations, keep=3), against(chosen))
    fitted = each(bench, _settled, whole)
    return sorted(distinct(bench, [t.seen for t in fitted if t.seen]), key=lambda e: (e.fit.fitted.cost, e.added))
