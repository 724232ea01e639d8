"""Dead zone: the valve's overlap swallows small voltages.

Inside a path it swallows what little flow they have made by then: a spool that lags uncovers its ports late.
"""

import math

from numba import njit

from ...channels import Channel
from ..compiled import FREE_VELOCITY, INJECTION, LOAD_VELOCITY, SPEED_GAIN, STAGE, VELOCITY, Doubles, effect_step
from .effect import Attachment, Effect, Parameter, Quantity


@njit(cache=True)
def _beyond(x: float, half_width: float, rounding: float, restored: float) -> float:
    """What of x lies beyond the band, its corners rounded."""
    if rounding > 1e-9 * (abs(half_width) + 1e-12):
        a = (x - half_width) / rounding
        b = (-x - half_width) / rounding
        above = a if a > 30.0 else math.log1p(math.exp(a))
        below = b if b > 30.0 else math.log1p(math.exp(b))
        jump = 1.0 / (1.0 + math.exp(min(-a, 30.0))) - 1.0 / (1.0 + math.exp(min(-b, 30.0)))
        return rounding * (above - below) + restored * half_width * jump
    excess = abs(x) - half_width
    return math.copysign(excess + restored * half_width, x) if excess > 0.0 else 0.0


@njit(cache=True)
def _let_through(p: Doubles, value: float) -> float:
    leak = p[4]
    return leak * value + (1.0 - leak) * (p[5] * p[1] + _beyond(value - p[1], p[0], p[2], p[3]))


@effect_step
def _step(p: Doubles, s: Doubles, value: float, c: Doubles) -> float:
    if c[STAGE] < 0.5:
        return _let_through(p, value)
    if c[SPEED_GAIN] != 0.0:
        opened = 0.5 * (c[VELOCITY] + c[FREE_VELOCITY] - c[LOAD_VELOCITY]) / c[SPEED_GAIN]
        c[INJECTION] += c[SPEED_GAIN] * (_let_through(p, opened) - opened)
    return value


EFFECT = Effect(
    name="dead_zone",
    sentence="Voltages within a band around the centre do not move the valve.",
    attachment=Attachment.INPUT,
    parameters=(
        Parameter(
            "half_width_v",
            Quantity.INPUT,
            "half the width of the dead band",
            0.0,
            1.5,
            (0.004, 0.02, 0.06, 0.15, 0.4),
            grain=0.03,
        ),
        Parameter(
            "centre_v",
            Quantity.INPUT,
            "voltage in its middle, where its edges differ",
            -1.0,
            1.0,
            (0.0,),
            optional=True,
            first_on=(Channel.POSITION,),
            apart=True,
        ),
        Parameter(
            "rounding_v", Quantity.INPUT, "voltage over which its corners are rounded", 0.0, 0.5, (0.05,), optional=True
        ),
        Parameter(
            "restored",
            Quantity.RATIO,
            "share of the band that comes back at once beyond it, 1: the valve jumps open",
            0.0,
            1.0,
            (0.0, 1.0),
            optional=True,
            tried_first=True,
            apart=True,
        ),
        Parameter(
            "leak",
            Quantity.RATIO,
            "share of the voltage that acts within the band, as the lap leaks",
            0.0,
            0.9,
            (0.0, 0.3),
            optional=True,
        ),
        Parameter(
            "working",
            Quantity.RATIO,
            "0: no flow at the centre, 1: a valve that works about it, where that voltage acts as it is",
            0.0,
            1.5,
            (),
            optional=True,
            apart=True,
            usual=(1.0,),
        ),
    ),
    step=_step,
    check="Sweep the voltage slowly through zero and read off where the flow starts in each direction.",
    source="Merritt, Hydraulic Control Systems (1967), 5.4: lapped spool",
    also={Channel.POSITION: (Attachment.STATE,)},
    holds=True,
)
