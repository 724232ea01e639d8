"""Backlash: play between the actuator and what the sensor sees."""

import math

from numba import njit

from ..compiled import SUBSTEP, Doubles, effect_step
from .effect import Attachment, Effect, Parameter, Quantity, begins, on_both

_STARTED, _BEFORE, _LAGGING = 0, 1, 2  # then place and speed of the load of each joint
_WIDE, _NARROW = 3, 5


@njit(cache=True)
def _carried(s: Doubles, joint: int, value: float, half_width: float, coast_s: float, step_s: float) -> float:
    """Where one joint's load is after a step: free in the gap, at the speed of what pushes it where it is met."""
    place, speed = s[joint], s[joint + 1]
    if coast_s > 0.0:
        kept = math.exp(-step_s / coast_s)
        place += speed * coast_s * (1.0 - kept)
        speed *= kept
    pushing = (value - s[_BEFORE]) / step_s
    if place < value - half_width:
        place, speed = value - half_width, max(speed, pushing)
    elif place > value + half_width:
        place, speed = value + half_width, min(speed, pushing)
    s[joint], s[joint + 1] = place, speed
    return place


@effect_step
def _step(p: Doubles, s: Doubles, value: float, c: Doubles) -> float:
    if s[_STARTED] == 0.0:
        s[_STARTED] = 1.0
        s[_BEFORE] = value
        s[_LAGGING] = s[_WIDE] = s[_NARROW] = value + p[4]
        if p[4] != 0.0:
            return value
    wide = _carried(s, _WIDE, value, p[0] * (1.0 + p[2]), p[3], c[SUBSTEP])
    narrow = _carried(s, _NARROW, value, p[0] * (1.0 - p[2]), p[3], c[SUBSTEP])
    s[_BEFORE] = value
    carried = 0.5 * (wide + narrow)
    s[_LAGGING] = carried if p[1] <= 1e-9 else carried + (s[_LAGGING] - carried) * math.exp(-c[SUBSTEP] / p[1])
    return s[_LAGGING]


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
            "time constant with which drag stops the load while nothing pushes it; 0: it stands at once",
            0.0,
            0.5,
            (0.02,),
            optional=True,
        ),
        begins(Quantity.SIGNAL),
    ),
    step=_step,
    check="Hold the actuator and move the load by hand or dial gauge; look at pins, couplings and sensor mounting.",
    source="Nordin & Gutman, Automatica 38 (2002) 1633: play with a shaft's compliance, load's inertia",
    state_size=7,
    also=on_both(Attachment.INPUT),
)
