"""Saturation: the valve, its amplifier or the supply gives no more beyond a limit.

At the output of a path with a static gain the limits are the voltages that would hold it there; inside an integrating
path, where the pump gives no more flow, those at which it would move so fast. Behind one of a static path's own lags,
as that of a coil before its iron saturates, it limits what that lag lets through.
"""

import math

from numba import njit

from ...channels import Channel
from ..compiled import (
    FREE_VELOCITY,
    INJECTION,
    INJECTION_GAIN,
    LOAD_VELOCITY,
    SPEED_GAIN,
    STAGE,
    STATIC_GAIN,
    SUBSTEP,
    VELOCITY,
    VELOCITY_GAIN,
    Doubles,
    effect_step,
)
from .effect import Attachment, Effect, Parameter, Quantity


@njit(cache=True)
def _less_flow(p: Doubles, value: float, c: Doubles) -> float:
    """The voltage at which the speed, the load's part in it apart, is what the limits would make of it."""
    high, low, speed = p[0] * c[SPEED_GAIN], p[1] * c[SPEED_GAIN], c[FREE_VELOCITY] - c[LOAD_VELOCITY]
    if c[VELOCITY_GAIN] == 0.0 or high == low:
        return value
    if p[5] > 0.5 and c[INJECTION_GAIN] != 0.0:
        # What asks for the flow goes on growing: only what reaches the piston is less, mean over the sub-step.
        speed = 0.5 * (c[VELOCITY] + speed)
        c[INJECTION] += (1.0 - p[4]) * (min(max(speed, min(low, high)), max(low, high)) - speed)
        return value
    allowed = min(max(speed, min(low, high)), max(low, high))
    return value - (1.0 - p[4]) * (speed - allowed) / c[VELOCITY_GAIN]


@njit(cache=True)
def _between(p: Doubles, value: float, lower: float, upper: float, rounding: float) -> float:
    """What gets through of a value above where the answer bends from, limits and rounding in its units."""
    limit = upper if value >= 0.0 else lower
    if p[6] < 1.0:
        bend, left = p[6] * limit, (1.0 - p[6]) * limit
        if limit * value > 0.0:
            return value if abs(value) <= abs(bend) else bend + left * math.tanh((value - bend) / left)
    elif p[3] > 1e-3 and limit * value >= 0.0 and limit != 0.0:
        return value * (1.0 + (value / limit) ** (1.0 / p[3])) ** -p[3]
    if p[2] > 1e-12:
        a = (value - lower) / rounding
        b = (value - upper) / rounding
        above = a if a > 30.0 else math.log1p(math.exp(a))
        beyond = b if b > 30.0 else math.log1p(math.exp(b))
        return lower + rounding * (above - beyond)
    return min(max(value, lower), upper)


@njit(cache=True)
def _limited(p: Doubles, value: float, unit: float) -> float:
    """What gets through of a value whose limits are in multiples of `unit`."""
    about = p[7] * unit
    return about + _between(p, value - about, p[1] * unit - about, p[0] * unit - about, p[2] * unit)


@njit(cache=True)
def _passed(p: Doubles, value: float, unit: float) -> float:
    limited = _limited(p, value, unit)
    return limited + p[4] * (value - limited)


@njit(cache=True)
def _behind(p: Doubles, s: Doubles, value: float, lag_s: float, substep: float) -> float:
    """What a path whose own lag comes before the limit would be given if it came behind, mean over the sub-step.

    That is what gets through (Simpson's rule) and the lag's time times its rate, which that lag takes away again. How
    early it comes within the sub-step is left to it and the next: a dipole of their means has the same first moment.
    """
    if s[0] == 0.0:
        s[0], s[1] = 1.0, value
    gap, quarter = s[1] - value, math.exp(-0.25 * substep / lag_s)
    first = _passed(p, s[1], 1.0)
    mean, moment, last = first / 12.0, -first / 24.0, first
    for k in range(1, 5):
        gap *= quarter
        last = _passed(p, value + gap, 1.0)
        weight = 4.0 if k % 2 == 1 else (2.0 if k == 2 else 1.0)
        mean += weight / 12.0 * last
        moment += weight / 12.0 * last * (0.25 * k - 0.5)
    s[1] = value + gap
    moment += lag_s / substep * (0.5 * (first + last) - mean)
    earlier, s[2] = s[2], moment
    return mean + lag_s * (last - first) / substep + earlier - moment


@effect_step
def _step(p: Doubles, s: Doubles, value: float, c: Doubles) -> float:
    if c[STAGE] == 1.0:
        return _less_flow(p, value, c)
    if c[STAGE] > 1.5:
        return _passed(p, value, abs(c[STATIC_GAIN]))
    return _behind(p, s, value, p[8], c[SUBSTEP]) if p[8] > 1e-9 else _passed(p, value, 1.0)


EFFECT = Effect(
    name="saturation",
    sentence="Beyond a limit more voltage gives no more effect.",
    attachment=Attachment.INPUT,
    parameters=(
        Parameter(
            "upper_v",
            Quantity.INPUT_PEAK,
            "highest voltage that still counts",
            -1.5,
            6.0,
            (-0.1, 0.06, 0.15, 0.3, 0.5, 0.7, 0.85, 0.95, 1.3, 2.0),
            neutral=1e9,
        ),
        Parameter(
            "lower_v",
            Quantity.INPUT_PEAK,
            "lowest voltage that still counts",
            -6.0,
            1.5,
            (-2.0, -1.3, -0.95, -0.85, -0.7, -0.5, -0.3, -0.15, -0.06, 0.1),
            neutral=-1e9,
        ),
        Parameter(
            "rounding_v", Quantity.INPUT, "voltage over which the corners are rounded", 0.0, 0.5, (0.05,), optional=True
        ),
        Parameter(
            "knee",
            Quantity.RATIO,
            "how early the answer bends: 0 for a sharp limit, 0.2 for the flow curve of a spool at full stroke",
            0.0,
            1.0,
            (0.15, 0.4),
            optional=True,
            apart=True,
        ),
        Parameter(
            "passing",
            Quantity.RATIO,
            "share of what is beyond a limit that still counts",
            0.0,
            0.3,
            (0.15,),
            optional=True,
        ),
        Parameter(
            "winding_up",
            Quantity.RATIO,
            "inside the path, 1: what asks for the flow goes on growing behind the limit, 0: it does not",
            0.0,
            1.0,
            (1.0,),
            optional=True,
            usual=(1.0,),
        ),
        Parameter(
            "straight",
            Quantity.RATIO,
            "share of the limit up to which the answer is straight, before it bends like a tanh, 1 for a sharp limit",
            0.0,
            0.95,
            (0.0, 0.6),
            neutral=1.0,
            optional=True,
        ),
        Parameter(
            "centre_v",
            Quantity.INPUT,
            "working voltage, from which the answer bends towards either limit",
            -3.0,
            3.0,
            (0.5,),
            optional=True,
            channels=(Channel.PRESSURE,),
        ),
        Parameter(
            "behind_s",
            Quantity.TIME,
            "time constant of the one of the path's own lags that comes before the limit; 0: all come behind it",
            0.0,
            2.0,
            (0.05,),
            optional=True,
            at=Attachment.INPUT,
        ),
    ),
    step=_step,
    state_size=3,
    check="Raise the voltage in steps and see where the output stops following; look at amplifier and supply limits.",
    source="Merritt, Hydraulic Control Systems (1967), 5.3: flow saturation",
    also={Channel.PRESSURE: (Attachment.OUTPUT,), Channel.POSITION: (Attachment.STATE,)},
    holds=True,
    moved_by="behind_s",
)
