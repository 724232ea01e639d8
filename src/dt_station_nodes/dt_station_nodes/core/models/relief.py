"""A relief valve at an output: what of the output it leaves."""

import math

from numba import njit

from .compiled import Doubles


@njit(cache=True)
def _below(value: float, limit: float, rounding: float) -> float:
    """The value kept below the limit, its corner rounded."""
    if rounding <= 1e-12:
        return min(value, limit)
    over = (value - limit) / rounding
    return value - rounding * (over if over > 30.0 else math.log1p(math.exp(over)))


@njit(cache=True)
def relieved(p: Doubles, s: Doubles, value: float, step_s: float) -> float:
    """The value less what a valve lets off: at once, or as it opens and closes.

    `p` are overflow's parameters, `s` its state: whether the valve is open, and what it lets off.
    """
    limit, opening_s, reseat = p[0], p[7], p[8]
    kept = _below(value, limit, p[1])
    if reseat > 0.0:
        s[0] = 1.0 if value > limit or (s[0] > 0.0 and value > limit - reseat) else 0.0
        kept = limit - reseat if s[0] > 0.0 else value
    over = value - kept
    passing = p[6] * over
    if p[13] != 1.0 and over > 0.0 and limit > 0.0:
        passing = min(passing * (over / limit) ** (p[13] - 1.0), over)
    relief = over - passing
    if opening_s <= 1e-6:
        return value - relief
    s[1] += (relief - s[1]) * (1.0 - math.exp(-step_s / opening_s))
    return value - s[1]
