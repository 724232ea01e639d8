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
    limit, opening_s, reseat, closing_s = p[0], p[7], p[8], p[14]
    kept = _below(value, limit, p[1])
    if reseat > 0.0:
        s[0] = 1.0 if value > limit or (s[0] > 0.0 and value > limit - reseat) else 0.0
        kept = limit - reseat if s[0] > 0.0 else value
    over = value - kept
    passing = p[6] * over
    if p[13] != 1.0 and over > 0.0 and limit > 0.0:
        passing = min(passing * (over / limit) ** (p[13] - 1.0), over)
    relief = over - passing
    # An open valve follows by its own pressure, a shut one leaves what it let off to be made up.
    settling_s = closing_s if closing_s > 1e-6 and relief <= 0.0 else opening_s
    if settling_s <= 1e-6:
        s[1] = relief
    else:
        s[1] += (relief - s[1]) * (1.0 - math.exp(-step_s / settling_s))
    return value - s[1]
