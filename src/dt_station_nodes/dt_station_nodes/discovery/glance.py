"""What the plain form of a candidate does at a glance, and where its fits begin."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from .candidates import hypothesis, plain_starts
from .hypothesis_fit import Costs, Group, fit_groups, fit_hypothesis
from .measure import FAR_OFF
from .selection import Bench
from .start_groups import by_form, promising, unbent
from .stick_slip import sticks
from .tasks import Task
from .terms import Hypothesis
from .timing import coming_in_run, with_numbers

Array = NDArray[np.float64]

_GLANCES = 3, 8  # steps
_FAR_OUTSIDE = 1e4  # times noise's power


def glance(bench: Bench, task: Task) -> Task:
    """A few steps of the plain form: enough to see which candidates deserve the whole."""
    known: Costs = {}
    starts, near, like = starts_of(bench, task, known)
    forms = [] if bench.rough else by_form(like, starts, tuned=False)
    # Far outside, the least of starts may be the one that leads nowhere.
    far = task.base.fit.rss > _FAR_OUTSIDE * len(task.base.fit.residual)
    groups = [Group(apart, 2 if far else 1) for apart in forms or [starts]]
    # From where the given parameters are, the way to below a base that they were bent for is longer.
    steps = _GLANCES[task.base.fit.penalty > FAR_OFF]
    # Beside a further effect the numbers that the base has do about what they did without it.
    lasting = sum(term.effect < len(like.path.effects) - 1 for term in like.terms) if task.base.added else 0
    groups, anew = spared(task, groups, [Group(near, 1)])
    fit, *_ = fit_groups(bench.problem, like, groups, anew, steps, known=known, lasting=lasting)
    coming = {} if bench.rough else coming_in_run(bench.problem, like.path, task.candidate.name, bench.nominal)
    if coming:
        # What comes in the course of the run does next to nothing as long as it is there from the start.
        whole = replace(like, path=with_numbers(like.path, like.path.effect(task.candidate.name), coming))
        fit = min(fit, fit_hypothesis(bench.problem, whole, [*starts, *near], steps, 1), key=lambda f: f.fitted.cost)
    seen = bench.explained(fit, task.added, {**task.freed, task.candidate.name: ()}, glance=True)
    return replace(task, seen=seen, known=known)


def starts_of(bench: Bench, task: Task, known: Costs) -> tuple[list[Array], list[Array], Hypothesis]:
    """Starts from the base's nominal parameters, and from the given ones where it may have bent them to hide it."""
    base = task.base
    freed = {**task.freed, task.candidate.name: task.candidate.required}
    # Beside other effects a spool's stairs begin from its few plain starts: a grid of them is dear.
    fine = not (base.added and sticks(bench.problem, (task.candidate.name,)))
    paths = plain_starts(bench.problem, base.fit.path, task.candidate, base.fit.residual, fine)
    hypotheses = [hypothesis(bench.problem, path, bench.nominal, freed) for path in paths]
    starts = [h.start() for h in hypotheses]
    few, near = (promising(bench.problem, hypotheses[0], s, known) for s in (starts, unbent(bench.nominal, starts)))
    return few, near, hypotheses[0]


def spared(task: Task, groups: list[Group], anew: list[Group]) -> tuple[list[Group], list[Group]]:
    """Groups to follow anyhow, and those that a further effect is spared where it leaves nothing but noise.

    A single one is named with its numbers: the best of all its starts counts, however little the others leave.
    """
    return (groups, anew) if task.base.added else ([*groups, *anew], [])
