"""Backlash: play between the actuator and what the sensor sees."""

import math

from numba import njit

from ..compiled import STAGE, SUBSTEP, Doubles, effect_step
from .effect import Attachment, Effect, Parameter, Quantity, begins, on_both

_STARTED, _BEFORE = 0, 1  # then place and speed of the load of each joint
_WIDE, _NARROW = 2, 4


@njit(cache=True)
def _coasted(speed: float, coast_s: float, drag: float, h: float) -> tuple[float, float]:
    """How far a free load gets in h, and its speed then: v' = -v / coast_s - drag sgn v, until it stands."""
    size = abs(speed)
    if coast_s <= 0.0:
        h = min(h, size / drag)
        return math.copysign((size - 0.5 * drag * h) * h, speed), math.copysign(size - drag * h, speed)
    lost = drag * coast_s
    if lost > 0.0:
        h = min(h, coast_s * math.log1p(size / lost))
    kept = math.exp(-h / coast_s)
    way = (size + lost) * coast_s * (1.0 - kept) - lost * h
    return math.copysign(way, speed), math.copysign((size + lost) * kept - lost, speed)


@njit(cache=True)
def _carried(s: Doubles, joint: int, value: float, half_width: float, p: Doubles, c: Doubles) -> float:
    """Where one joint's load is after a step: free in the gap, brought back into it over the time its contact takes.

    What centres it moves it in the gap too. Where it coasts, it leaves the contact at the speed of what pushes it.
    """
    place, speed = s[joint], s[joint + 1]
    h, lag_s, coast_s = c[SUBSTEP], p[1], p[3]
    if p[7] != 0.0:
        place += (place - value) * math.expm1(-h * p[7])
    if coast_s > 0.0 or p[6] > 0.0:
        way, speed = _coasted(speed, coast_s, p[6], h)
        place += way
    off, pushing = 0.0, (value - s[_BEFORE]) / h
    if place < value - half_width:
        off, speed = value - half_width - place, max(speed, pushing)
    elif place > value + half_width:
        off, speed = value + half_width - place, min(speed, pushing)
    closer = -math.expm1(-h / lag_s) if lag_s > 1e-9 else 1.0
    s[joint], s[joint + 1] = place + closer * off, speed
    # What is held over the step acts by its mean; a sensor reads the end of it.
    return place + (1.0 - closer * lag_s / h) * off if c[STAGE] == 0.0 else s[joint]


@effect_step
def _step(p: Doubles, s: Doubles, value: float, c: Doubles) -> float:
    if s[_STARTED] == 0.0:
        s[_STARTED] = 1.0
        s[_BEFORE] = value
        s[_WIDE] = s[_NARROW] = value + p[4]
        if p[4] != 0.0:
            return value
    wide = _carried(s, _WIDE, value, p[0] * (1.0 + p[2]), p, c)
    if p[2] != 0.0:
        narrow = _carried(s, _NARROW, value, p[0] * (1.0 - p[2]), p, c)
    else:
        # Both joints are one.
        narrow, s[_NARROW], s[_NARROW + 1] = wide, s[_WIDE], s[_WIDE + 1]
    s[_BEFORE] = value
    return p[5] * value + (1.0 - p[5]) * 0.5 * (wide + narrow)


EFFECT = Effect(
    name="backlash",
    sentence="After each reversal the output stands still until play in the linkage is taken up.",
    attachment=Attachment.OUTPUT,
    parameters=(
        Parameter(
            "half_width",
            Quantity.SIGNAL,
            "half the play, in volts where it sits on the input",
            0.0,
            1.0,
            (0.003, 0.01, 0.03, 0.1, 0.2),
        ),
        Parameter(
            "lag_s", Quantity.TIME, "time over which a compliant contact closes", 0.0, 1.0, (0.02,), optional=True
        ),
        Parameter(
            "spread",
            Quantity.RATIO,
            "two joints share the load: how much more and less play they have than on average",
            0.0,
            0.6,
            (0.25,),
            optional=True,
        ),
        Parameter(
            "coast_s",
            Quantity.TIME,
            "time constant with which oil drags on the load while nothing pushes it; 0 with no dry drag: it stands",
            0.0,
            0.5,
            (0.02,),
            optional=True,
        ),
        begins(Quantity.SIGNAL),
        Parameter(
            "give",
            Quantity.RATIO,
            "share of a move that gets through while the gap is open, as of a compliant linkage",
            0.0,
            0.4,
            (0.1,),
            optional=True,
            at=Attachment.INPUT,
        ),
        Parameter(
            "dry_drag",
            Quantity.ACCELERATION,
            "how much slower dry friction makes the load every second while nothing pushes it",
            0.0,
            200.0,
            (1.0, 5.0),
            optional=True,
            at=Attachment.OUTPUT,
        ),
        Parameter(
            "centring_per_s",
            Quantity.RATE,
            "rate at which a light spring or what seeps past brings the load to the middle of its gap; 0: it stays",
            0.0,
            3.0,
            (0.1, 0.5),
            optional=True,
        ),
    ),
    step=_step,
    check="Hold the actuator and move the load by hand or dial gauge; look at pins, couplings and sensor mounting.",
    source="Nordin & Gutman, Automatica 38 (2002) 1633: play with a shaft's compliance, load's inertia",
    state_size=6,
    also=on_both(Attachment.INPUT),
)
