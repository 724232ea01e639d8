"""Ends of a piston's way or of a valve's range that a run does not come to: where another run meets them, if at all."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..core.models import EffectSpec
from ..core.models.effects import Effect, registry
from .effect_terms import unit_of
from .fit import least_squares
from .hypothesis_fit import Fit
from .place_starts import stop_starts
from .problem import Problem
from .terms import Hypothesis
from .unseen import unseen_residual

Array = NDArray[np.float64]

# A run that is explained within this of its noise says nothing more.
_EXPLAINED = 1.2
_STEPS = 6
NEVER = 1e6  # a neutral value beyond it: an effect that acts from nowhere on


def _power(check: Problem, fit: Fit) -> float:
    return float(np.sum(np.square(unseen_residual(check, fit.path))))


def _moved(fit: Fit, index: int, value: float) -> Fit:
    """The fit with one number elsewhere, out of the reach of its run as before."""
    x = fit.fitted.x.copy()
    x[index] = fit.hypothesis.terms[index].to_x(value)
    return replace(fit, path=fit.hypothesis.path_at(x), fitted=replace(fit.fitted, x=x))


def _is_end(effect: Effect, name: str, check: Problem) -> bool:
    """Whether a number says from where on an effect acts: an end of a piston's way, or of what a valve lets through."""
    if name in effect.between:
        return check.windows.anchored
    return abs(effect.parameter(name).neutral) >= NEVER


def _places(check: Problem, fit: Fit, effect: EffectSpec, end: str) -> list[float]:
    """Where an end may be met, as far as the other run comes."""
    known = registry()[effect.name]
    parameter = known.parameter(end)
    unit = unit_of(check, parameter, effect.place)
    if end in known.between:
        return stop_starts(check, fit.path, parameter, unit)
    return [start * unit for start in parameter.starts]


def _met(check: Problem, fit: Fit, index: int) -> Fit:
    """The fit with an end where the other run meets it best."""
    term = fit.hypothesis.terms[index]
    starts = _places(check, fit, fit.path.effects[term.effect], term.name)
    alone = Hypothesis(fit.path, (replace(term, lower=min(starts), upper=max(starts)),))

    def residuals(x: Array) -> Array:
        return unseen_residual(check, alone.path_at(x)) / check.sigma

    begin = min(starts, key=lambda start: _power(check, _moved(fit, index, start)))
    low, high = alone.bounds.T
    found = least_squares(residuals, np.array([term.to_x(begin)]), low, high, alone.steps, _STEPS)
    return _moved(fit, index, term.to_value(float(found.x[0])))


def ends_elsewhere(check: Problem, fit: Fit) -> Fit:
    """The fit with the ends out of its run's reach where they explain the other run best: nowhere, or where it stops.

    The run says nothing of them, so what it leaves stays as it is. An effect of which it says nothing at all is not
    its to tell: the runs have to change places.
    """
    terms = fit.hypothesis.terms
    shown = {term.effect for term, idle in zip(terms, fit.fitted.idle, strict=True) if not idle}
    for index in np.flatnonzero(fit.fitted.idle):
        term = terms[index]
        effect = registry()[fit.path.effects[term.effect].name] if term.effect >= 0 else None
        if effect is None or term.effect not in shown or not _is_end(effect, term.name, check):
            continue
        away = _moved(fit, int(index), effect.parameter(term.name).neutral)
        tried = [(_power(check, one), one) for one in (fit, away)]
        if min(power for power, _ in tried) > len(check.measured) * (_EXPLAINED * check.sigma) ** 2:
            met = _met(check, fit, int(index))
            tried.append((_power(check, met), met))
        fit = min(tried, key=lambda one: one[0])[1]
    return fit
