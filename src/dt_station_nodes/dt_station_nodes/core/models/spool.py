"""Where a spool is that dry friction holds: it sticks and slips, slides on, creeps on its oil film or on bristles."""

import math

from numba import njit

from .compiled import Doubles

_STILL = 0.05  # of what makes a spool slip: as near to where it comes to rest it sticks again
_TURNED = 1e-9  # of the same: a voltage that turns back by less has not


@njit(cache=True)
def slipping(velocity: float, pull: float, slip: float) -> float:
    """Velocity v with v + pull tanh(v / slip) = velocity: Newton from rest, which a concave curve never overshoots."""
    found = 0.0
    for _ in range(12):
        bent = math.tanh(found / slip)
        change = (abs(velocity) - found - pull * bent) / (1.0 + pull / slip * (1.0 - bent * bent))
        found += change
        if change < 1e-6 * slip:
            break
    return math.copysign(found, velocity)


@njit(cache=True)
def _bristled(s: Doubles, value: float, level: float, way: float, damped: float) -> float:
    """Where a spool on a spring is whose contact's bristles bend over a `way` (V), after Dahl: s[2] is how far, -1..1.

    On its way w from w0 they bend as z = sign - (sign - z0) exp(-|w - w0| / way), and the voltage is w + level z and
    what `damped` times |w - w0| holds back.
    """
    ahead = value - s[0] - level * s[2]
    if ahead == 0.0:
        return s[0]
    sign = math.copysign(1.0, ahead)
    to_bend = 1.0 - sign * s[2]
    moved = 0.0
    for _ in range(30):
        left = to_bend * math.exp(-moved / way)
        change = abs(ahead) - (1.0 + damped) * moved - level * (to_bend - left)
        change /= 1.0 + damped + level * left / way
        moved += change
        if abs(change) < 1e-9 * way:
            break
    s[0] += sign * moved
    s[2] = sign * (1.0 - to_bend * math.exp(-moved / way))
    return s[0]


@njit(cache=True)
def spool_at(p: Doubles, s: Doubles, value: float, h: float, creep: float, bristles: float) -> float:
    """Where a spool is that sticks until the voltage is a level off, then slips a share of that.

    One that creeps at `creep` (V/s) never sticks: it lags behind by the level times the tanh of its speed over that.
    Nor does one whose contact has `bristles` that bend over so much of its way (V); oil damps it as it slides.
    """
    level, end, slide, slides_on = p[0], p[0] * (1.0 - p[7]), p[8], p[9] > 0.5
    if s[1] == 0.0:
        s[1] = 1.0
        s[0] = value
    if bristles > 0.0:
        return _bristled(s, value, level, bristles, slide / h)
    if creep > 0.0:
        s[0] += h * slipping((value - s[0]) / h, level / h, creep)
        return s[0]
    if s[2] == 0.0 and abs(value - s[0]) > level:
        s[2] = math.copysign(1.0, value - s[0])
    if s[2] != 0.0:
        to_go = (value - s[0]) * s[2] - end
        if to_go <= 0.0:
            if not slides_on or to_go < -_TURNED * level:
                s[2] = 0.0
            return s[0]
        moved = to_go * (1.0 - math.exp(-h / slide)) if slide > 1e-6 else to_go
        s[0] += s[2] * moved
        if to_go - moved <= _STILL * level and not slides_on:
            s[2] = 0.0
    return s[0]
