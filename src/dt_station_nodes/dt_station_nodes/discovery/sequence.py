"""Which comes first on the signal's way: an effect that is added, or those that are there already."""

from dataclasses import replace

import numpy as np

from ..core.models import EffectSpec, PathSpec
from ..core.models.effects import Attachment, registry
from .candidates import Candidate, hypothesis
from .hypothesis_fit import fit_hypothesis
from .selection import Bench, Explanation

_CLEARLY = 0.9  # of the misfit: what was added before and commutes with the candidate stays where it is
_TRACE = 0.1  # times the working sigma: what the sequence changes by less is no difference


def in_sequence(bench: Bench, found: Explanation, candidate: Candidate) -> tuple[Explanation, Candidate]:
    """A glance at a candidate's fit and the candidate: on that side of the others at its place that the runs say.

    A valve that rings or is off its null is still shut at 0 V; a limit of the card is not felt by what follows it; a
    relief valve cuts off what ripples before it and not what a sensor adds.
    """
    effects = found.fit.path.effects
    place = next(i for i, effect in enumerate(effects) if effect.name == candidate.name)
    spot = candidate.place
    beside = [i for i, effect in enumerate(effects) if i != place and effect.place is spot]
    if not beside or spot is Attachment.STATE:
        return found, candidate
    first = place > min(beside)
    others = (*effects[:place], *effects[place + 1 :])
    ways = [(effects[place], *others) if first else (*others, effects[place])]
    if first:
        ways.append((effects[place], *(e if e.name in found.added else _beyond_the_card(e) for e in others)))
    best, chosen = found, candidate
    tried = [found.fit.path]
    for moved in ways:
        path = found.fit.path.model_copy(update={"effects": moved})
        if not all(_differ(bench, one, path) for one in tried):
            continue
        tried.append(path)
        begin = hypothesis(bench.problem, path, bench.nominal, found.freed)
        fit = fit_hypothesis(bench.problem, begin, iterations=bench.iterations)
        other = bench.explained(fit, found.added, found.freed, glance=True)
        floors = bench.floors(other)
        most = _CLEARLY if any(effects[i].name in found.added for i in beside) else 1.0
        if bench.misfit(other, floors) < most * bench.misfit(best, floors):
            best, chosen = other, replace(candidate, first=first)
    return best, chosen


def _beyond_the_card(effect: EffectSpec) -> EffectSpec:
    """An effect behind what swings beyond the voltage applied, which has passed the card's upper limit already."""
    if effect.name != "saturation":
        return effect
    wide = {**effect.parameters, "upper_v": registry()[effect.name].parameter("upper_v").neutral}
    return EffectSpec.model_construct(name=effect.name, at=effect.at, parameters=wide)


def _differ(bench: Bench, one: PathSpec, other: PathSpec) -> bool:
    """Whether two paths differ by more than a trace on either run."""
    for problem in bench.problems:
        change = problem.residual(one) - problem.residual(other)
        if float(np.sqrt(np.mean(np.square(change)))) > _TRACE * problem.sigma:
            return True
    return False
