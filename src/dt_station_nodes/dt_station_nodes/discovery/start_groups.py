"""Starts of a fit in groups: between them there is no way down, so each group is begun from its own best."""

import math
from collections.abc import Sequence
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from ..core.models.effects import registry
from .hypothesis_fit import Costs, Fit, costs_of_part
from .problem import Problem
from .stairs import beginning
from .terms import Hypothesis, Term

Array = NDArray[np.float64]
T = TypeVar("T")

_MANY, _KEPT = 200, 30  # starts of which a run's beginning tells most apart, and of each form those it leaves
_BEGINNING = 0.25  # of the run

_EITHER = (0.0, 1.0)  # starts of a choice between two forms
NEAR = 0.5  # of their priors' widths: nominal parameters bent no further are where they were given


def unbent(nominal: Sequence[Term], starts: list[Array]) -> list[Array]:
    """The same starts with the nominal parameters as given; none where they are there already."""
    centres = np.array([term.centre for term in nominal])
    widths = np.array([term.prior for term in nominal])
    if np.all(np.abs(starts[0][: len(centres)] - centres) <= NEAR * widths):
        return []
    return [np.concatenate([centres, x[len(centres) :]]) for x in starts]


def promising(problem: Problem, like: Hypothesis, starts: list[Array], known: Costs) -> list[Array]:
    """Of many starts, those of each form that fit the run's beginning best, in their order; `known` is added to."""
    if len(starts) < _MANY:
        return starts
    part = beginning(problem, _BEGINNING)
    kept: set[int] = set()
    for form in by_form(like, starts, tuned=False) or [starts]:
        costs = costs_of_part(part, like, form, known)
        best = sorted(range(len(form)), key=lambda i: (costs[i], i))[:_KEPT]
        kept |= {id(form[i]) for i in best}
    return [x for x in starts if id(x) in kept]


def by_form(like: Hypothesis, starts: list[Array], tuned: bool = True) -> list[list[Array]]:
    """Starts of one form each, or of one frequency if `tuned`, where the candidate has several.

    Between them there is no way down.
    """
    place = _choice(like, {"frequency_hz"} if tuned else set())
    if place is None:
        return []
    apart: dict[float, list[Array]] = {}
    for x in starts:
        apart.setdefault(float(x[place]), []).append(x)
    return list(apart.values())


def unlike(one: Fit, other: Fit) -> bool:
    """Whether two fits of one hypothesis end in different forms of the candidate, where it has two."""
    place = _choice(one.hypothesis, set())
    return place is not None and round(float(one.fitted.x[place])) != round(float(other.fitted.x[place]))


def _choice(like: Hypothesis, forms: set[str]) -> int | None:
    """Which term of the candidate's sets starts apart: one of `forms`, or what chooses between two of them."""
    last = len(like.path.effects) - 1
    effect = registry()[like.path.effects[last].name]
    forms = forms | {p.name for p in effect.parameters if p.apart and p.starts == _EITHER}
    return next((i for i, t in enumerate(like.terms) if t.effect == last and t.name in forms), None)


def drawn(combinations: list[T], most: int) -> list[T]:
    """At most so many, evenly; a step that shares a factor with a grid would leave out values of it."""
    step = -(-len(combinations) // most)
    while math.gcd(step, len(combinations)) > 1:
        step += 1
    return combinations[::step]
