"""Where a spool is that dry friction holds: it sticks and slips, slides on, creeps on its oil film or on bristles."""

import math

from numba import njit

from .compiled import Doubles
from .second_order import swing

_STILL = 0.05  # of what makes a spool slip: as near to where it comes to rest it sticks again
_TURNED = 1e-9  # of the same: a voltage that turns back by less has not
_MOST_TURNS = 6  # in a sub-step, of a spool that swings
_HALVINGS = 24
_SPEED_S = 0.02  # time over which its speed counts: a voltage held between samples moves it in jerks


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
def gripped(excess: float, velocity: float, stribeck: float) -> float:
    """What a contact holds more than Coulomb's level at a velocity, the less the further above Stribeck's."""
    ratio = velocity / stribeck if stribeck > 0.0 else 0.0
    return excess * math.exp(-ratio * ratio)


@njit(cache=True)
def _bristled(s: Doubles, value: float, level: float, slope: float, elastic: float, damped: float) -> float:
    """Where a spool on a spring is whose contact's bristles hold it back by s[2] (V), at most by a `level`.

    On its way w they bend by `slope` times that, up to an `elastic` share of the level; from there, at w0, they give
    way as z = sign level - (sign level - z0) exp(-slope |w - w0| / ((1 - elastic) level)). The voltage is w + z and
    what `damped` times its way holds back.
    """
    ahead = value - s[0] - s[2]
    if ahead == 0.0:
        return s[0]
    sign = math.copysign(1.0, ahead)
    to_go = abs(ahead)
    bends = elastic * level - sign * s[2]
    # Without such a share they give way on the whole of their way back too, after Dahl.
    if elastic > 0.0 and bends > 0.0:
        moved = min(to_go / (1.0 + damped + slope), bends / slope)
        s[0] += sign * moved
        s[2] += sign * moved * slope
        to_go -= moved * (1.0 + damped + slope)
        if moved * slope < bends:
            return s[0]
    to_bend = level - sign * s[2]
    rate = slope / ((1.0 - elastic) * level)
    # From where it cannot be on: Newton comes down to where it is, whether the bristles bend further or give way.
    moved = 0.0 if to_bend >= 0.0 else (to_go - to_bend) / (1.0 + damped)
    for _ in range(30):
        left = to_bend * math.exp(-moved * rate)
        change = to_go - (1.0 + damped) * moved - (to_bend - left)
        change /= 1.0 + damped + left * rate
        moved += change
        if abs(change) * rate < 1e-9:
            break
    s[0] += sign * moved
    s[2] = sign * (level - to_bend * math.exp(-moved * rate))
    return s[0]


@njit(cache=True)
def _swung(p: Doubles, s: Doubles, value: float, h: float, per_unit: float) -> float:
    """Mean place over the sub-step of a spool with mass on a spring that dry friction holds, state s[0], its rate s[2].

    As long as it goes one way friction is a force like any other, by less above a Stribeck velocity; where it stops it
    stays, unless its spring pulls more than friction holds.
    """
    natural, to_go, stribeck, before = 1.0 / p[15], h, p[13] * per_unit, s[0]
    decay = p[16] * natural
    for _ in range(_MOST_TURNS):
        sign = math.copysign(1.0, s[2] if s[2] != 0.0 else value - s[0])
        level = p[0] + gripped(p[1], s[2], stribeck)
        if s[2] == 0.0 and abs(value - s[0]) <= level:
            break
        rest, rate = value - sign * level, s[2]
        gap = s[0] - rest
        cosine, sine = swing(decay, natural, to_go)
        after = rate * (cosine - decay * sine) - gap * natural * natural * sine
        if sign * after > 0.0:
            s[0], s[2] = rest + gap * (cosine + decay * sine) + rate * sine, after
            break
        on, turned = 0.0, to_go
        for _ in range(_HALVINGS):
            middle = 0.5 * (on + turned)
            cosine, sine = swing(decay, natural, middle)
            if sign * (rate * (cosine - decay * sine) - gap * natural * natural * sine) > 0.0:
                on = middle
            else:
                turned = middle
        cosine, sine = swing(decay, natural, turned)
        s[0], s[2] = rest + gap * (cosine + decay * sine) + rate * sine, 0.0
        to_go -= turned
    return 0.5 * (before + s[0])


@njit(cache=True)
def spool_at(p: Doubles, s: Doubles, value: float, h: float, per_unit: float) -> float:
    """Where a spool is that sticks until the voltage is a level off, then slips a share of that.

    One that creeps never sticks: it lags behind by the level times the tanh of its speed over that of its creep. Nor
    does one whose contact has bristles; those hold more at rest than above a Stribeck velocity, and oil damps it as it
    slides. One with mass swings past. `per_unit` (V): what moves the pressure by its unit.
    """
    level, end, slide, slides_on = p[0], p[0] * (1.0 - p[7]), p[8], p[9] > 0.5
    creep, bristles, stribeck = p[12] * per_unit, p[5] * per_unit, p[13] * per_unit
    if s[1] == 0.0:
        s[1] = 1.0
        s[0] = value
    if p[15] > 0.0:
        return _swung(p, s, value, h, per_unit)
    if bristles > 0.0 and level > 0.0:
        slope, damped = level / bristles, slide / h
        if p[1] > 0.0 and stribeck > 0.0:
            # How fast the voltage drives it, held as it is: a jump is at its speed from its beginning, and what it goes
            # on by as the grip falls adds nothing.
            before, held = s[0], s[2]
            as_it_is = max(level, math.copysign(held, held * (value - before - held)))
            driven = _bristled(s, value, as_it_is, slope, p[14], damped) - before
            s[0], s[2] = before, held
            s[3] += (driven / h - s[3]) * (1.0 - math.exp(-h / _SPEED_S))
            level += gripped(p[1], s[3], stribeck)
        return _bristled(s, value, level, slope, p[14], damped)
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
