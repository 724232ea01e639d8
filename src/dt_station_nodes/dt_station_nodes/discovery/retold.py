"""Forms that a run does not tell but both runs together do, of the sets that fit it as well as the best one."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import islice

import numpy as np

from ..core.models import PathSpec
from .candidates import Freed, hypothesis
from .choice import best_set
from .foretold import agreed, cost_of_both
from .hypothesis_fit import fit_hypothesis
from .measure import Measure
from .neighbours import also_free, refinable
from .refinements import step_starts
from .selection import Bench, Explanation, exchanged
from .sense import sensible
from .strangers import SAME

_MOST = 3  # sets looked into beside the best one,
_MISSED = 0.5  # of the gap, which they may leave at most
_STEPS = 3  # refinements that one may get
_PACE = 2.0  # times what the step before brought: a step brings no more
_FOLLOWED = 8  # of those of a step, followed to where both runs agree


@dataclass(frozen=True, slots=True)
class _Begun:
    """A step of refinement from the best of its starts, which costs so much on both runs."""

    cost: float
    freed: Freed
    path: PathSpec


def retold(bench: Bench, null: Explanation, known: Iterable[Explanation], measure: Measure) -> list[Explanation]:
    """What is known; sets that the run does not tell from the best one but the other does, and it, as both tell them.

    On two levels a fit ends anywhere: what the numbers that the run does not hold do on the other run is chance.
    """
    listed = list(known)
    best = null if bench.rough or bench.check is None else best_set(null, listed, measure)
    if not best.added:
        return listed
    ranked = sorted((e for e in listed if e.added and e.inside), key=measure.score)
    likely = (e for e in ranked if measure.left(e) < _MISSED * measure.left(null))
    near = [e for e in likely if _alike(bench, best, e, measure)][:_MOST]
    near = [best, *near] if near else []
    return exchanged(listed, near, told(measure, near))


def _alike(bench: Bench, best: Explanation, other: Explanation, measure: Measure) -> bool:
    """Whether a set of other names, as few, does as well on the run itself, but not on the other."""
    if set(best.added) <= set(other.added) or len(other.added) > len(best.added):
        return False
    here = bench.tells(other.fit, best.fit, measure.samples)
    return here < SAME < measure.score(other) - measure.score(best)


def told(measure: Measure, explanations: Sequence[Explanation]) -> list[Explanation]:
    """Explanations with the refinements that both runs together bear out, added to each one at a time.

    One that comes on too slowly to get where the foremost is goes no further.
    """
    best, going = list(explanations), list(range(len(explanations)))
    for left in reversed(range(_STEPS)):
        refined = _refined(measure.bench, [best[place] for place in going])
        brought = {}
        for place, forms in zip(going, refined, strict=True):
            believed = (form for form in forms if sensible(form, measure.bench.problem))
            form = min(believed, key=measure.score, default=best[place])
            gain = measure.score(best[place]) - measure.score(form)
            if gain >= SAME:
                best[place], brought[place] = form, gain
        foremost = min(map(measure.score, best), default=0.0)
        going = [p for p, gain in brought.items() if measure.score(best[p]) - _PACE * left * gain < foremost]
    return best


def _refined(bench: Bench, explanations: Sequence[Explanation]) -> list[list[Explanation]]:
    """Each explanation with one step of refinement more, the likeliest few as both runs together tell them."""
    steps = [list(_steps(bench, explanation)) for explanation in explanations]
    begun = bench.workers.results(partial(_begun, bench.alone), [step for own in steps for step in own])
    likeliest = [sorted(islice(begun, len(own)), key=lambda one: one.cost)[:_FOLLOWED] for own in steps]
    chosen = [(e.added, one) for e, own in zip(explanations, likeliest, strict=True) for one in own]
    followed = bench.workers.results(partial(_followed, bench.alone), chosen)
    return [list(islice(followed, len(own))) for own in likeliest]


def _begun(bench: Bench, step: tuple[Freed, list[PathSpec]]) -> _Begun:
    assert bench.check is not None
    freed, paths = step
    costs = [cost_of_both(bench.problem, bench.check, path) for path in paths]
    return _Begun(min(costs), freed, paths[int(np.argmin(costs))])


def _followed(bench: Bench, chosen: tuple[tuple[str, ...], _Begun]) -> Explanation:
    assert bench.check is not None
    added, begun = chosen
    like = hypothesis(bench.problem, begun.path, bench.nominal, begun.freed)
    begin = fit_hypothesis(bench.problem, like, [like.start()], 0, 1)
    there = agreed(bench.problem, bench.check, begin)
    return bench.explained(there, added, begun.freed, glance=True)


def _steps(bench: Bench, explanation: Explanation) -> Iterator[tuple[Freed, list[PathSpec]]]:
    """What is free with each step of refinement of each effect, and the paths that it begins from."""
    for forms in refinable(bench, explanation):
        own = set(explanation.freed[forms.candidate.name])
        for names in forms.steps:
            if not own.issuperset(names):
                yield also_free(explanation, forms, names), step_starts(explanation.fit.path, forms, names)
