"""A relief valve: what of an output it leaves, or what its flow takes off the voltage that feeds a path."""

import math

from numba import njit

from .compiled import OUTPUT_GAIN, SETTLING_RATE, STATIC_GAIN, SUBSTEP, Doubles, halfway


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
        felt = value - p[17] * s[1]
        s[0] = 1.0 if felt > limit or (s[0] > 0.0 and felt > limit - reseat) else 0.0
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


@njit(cache=True)
def _flow_v(p: Doubles, over: float, c: Doubles) -> float:
    """Voltage that would make up for what runs off with so much above the limit."""
    height = (over / abs(p[0])) ** (p[5] - 1.0) if p[5] != 1.0 else 1.0
    return over * height / (p[4] * c[SETTLING_RATE] * c[STATIC_GAIN])


@njit(cache=True)
def let_off(p: Doubles, s: Doubles, value: float, c: Doubles) -> float:
    """The voltage, less what a valve lets off half-way through the sub-step: at once, or as it opens and closes.

    `p` are overflow's parameters, `s` its state, of which the second is what the valve lets off.
    """
    level = halfway(c)
    over = level - _below(level, p[0], p[1])
    flow = 0.0
    if p[4] > 0.0 and over > 0.0:
        # What the valve does within the sub-step counts half: a step of Newton's, its law a line through nothing.
        slope = 0.5 * c[OUTPUT_GAIN] * _flow_v(p, over, c) / over
        flow = _flow_v(p, over / (1.0 + slope), c)
    if p[7] <= 1e-6:
        return value - flow
    # The mean over the sub-step.
    passed, gap = 1.0 - math.exp(-c[SUBSTEP] / p[7]), flow - s[1]
    s[1] += passed * gap
    return value - flow + gap * passed * p[7] / c[SUBSTEP]
