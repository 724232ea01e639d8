"""Ends of a piston's way that a run does not come to: where another run meets them, if it does."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..core.models.effects import registry
from .candidates import stop_starts
from .fit import least_squares
from .hypothesis_fit import Fit
from .problem import Problem
from .terms import Hypothesis
from .unseen import unseen_residual

Array = NDArray[np.float64]

# A run that is explained within this of its noise says nothing more.
_EXPLAINED = 1.2
_STEPS = 6


def _power(check: Problem, fit: Fit) -> float:
    return float(np.sum(np.square(unseen_residual(check, fit.path))))


def _moved(fit: Fit, index: int, value: float) -> Fit:
    """The fit with one number elsewhere, out of the reach of its run as before."""
    x = fit.fitted.x.copy()
    x[index] = fit.hypothesis.terms[index].to_x(value)
    return replace(fit, path=fit.hypothesis.path_at(x), fitted=replace(fit.fitted, x=x))


def _met(check: Problem, fit: Fit, index: int) -> Fit:
    """The fit with an end where the other run meets it best."""
    term = fit.hypothesis.terms[index]
    name = fit.path.effects[term.effect].name
    starts = stop_starts(check, fit.path, registry()[name].parameter(term.name))
    alone = Hypothesis(fit.path, (replace(term, lower=min(starts), upper=max(starts)),))

    def residuals(x: Array) -> Array:
        return unseen_residual(check, alone.path_at(x)) / check.sigma

    begin = min(starts, key=lambda start: _power(check, _moved(fit, index, start)))
    low, high = alone.bounds.T
    found = least_squares(residuals, np.array([term.to_x(begin)]), low, high, alone.steps, _STEPS)
    return _moved(fit, index, term.to_value(float(found.x[0])))


def ends_elsewhere(check: Problem, fit: Fit) -> Fit:
    """The fit with the ends out of its run's reach where they explain the other run best: nowhere, or where it stops.

    The run says nothing of them, so what it leaves stays as it is.
    """
    for index in np.flatnonzero(fit.fitted.idle) if check.windows.anchored else ():
        term = fit.hypothesis.terms[index]
        effect = registry()[fit.path.effects[term.effect].name] if term.effect >= 0 else None
        if effect is None or term.name not in effect.between:
            continue
        away = _moved(fit, int(index), effect.parameter(term.name).neutral)
        tried = [(_power(check, one), one) for one in (fit, away)]
        if min(power for power, _ in tried) > len(check.measured) * (_EXPLAINED * check.sigma) ** 2:
            met = _met(check, fit, int(index))
            tried.append((_power(check, met), met))
        fit = min(tried, key=lambda one: one[0])[1]
    return fit
