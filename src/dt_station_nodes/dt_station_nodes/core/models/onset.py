"""How far what begins in the course of a run has come."""

import math

from numba import njit

from .compiled import SUBSTEP, TIME, Doubles

_SUDDEN_S = 1e-9  # time constant of what comes at once
EVEN = "0: it comes by first order, 1: along a logistic curve, as slowly before that time as after"


@njit(cache=True)
def come(c: Doubles, time_s: float, lag_s: float, even: float) -> float:
    """Mean over the sub-step of what comes at `time_s` of the run with a time constant, 0 to 1.

    By first order (`even` 0), or along a logistic curve about that time (1), or by a share in between.
    """
    begin = c[TIME] - time_s
    end = begin + c[SUBSTEP]
    by_first_order = 0.0
    if end > 0.0:
        begun = max(begin, 0.0)
        by_first_order = end - begun
        if lag_s > _SUDDEN_S:
            by_first_order -= lag_s * (math.exp(-begun / lag_s) - math.exp(-end / lag_s))
    if even <= 0.0 or lag_s <= _SUDDEN_S:
        return by_first_order / c[SUBSTEP]
    logistic = lag_s * (_ramp(end / lag_s) - _ramp(begin / lag_s))
    return (by_first_order + even * (logistic - by_first_order)) / c[SUBSTEP]


@njit(cache=True)
def _ramp(x: float) -> float:
    """Integral of the logistic curve."""
    return max(x, 0.0) + math.log1p(math.exp(-abs(x)))
