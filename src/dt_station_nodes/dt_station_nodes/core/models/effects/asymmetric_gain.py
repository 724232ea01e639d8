"""Asymmetric gain: one direction answers more strongly than the other.

On the voltage its sign decides; inside a path the direction of motion does: a pressure rises quicker than it falls, a
piston is slower where the same flow fills the larger area.
"""

import math

from numba import njit

from ...channels import Channel
from ..compiled import (
    FREE_VELOCITY,
    INJECTION,
    LOAD_VELOCITY,
    SPEED_GAIN,
    STAGE,
    STATIC_GAIN,
    VELOCITY,
    VELOCITY_GAIN,
    Doubles,
    effect_step,
    halfway,
)
from .effect import Attachment, Effect, Parameter, Quantity, on_both


@njit(cache=True)
def _bent(x: float, asymmetry: float, rounding: float, of_slope: float) -> float:
    if rounding > 1e-9:
        size = x * math.tanh(x / rounding)
        if of_slope > 0.0:
            # integral of the tanh: a slope that goes from one to the other
            sloped = abs(x) + rounding * (math.log1p(math.exp(-2.0 * abs(x) / rounding)) - math.log(2.0))
            size += of_slope * (sloped - size)
        return x + asymmetry * size
    return x * (1.0 + asymmetry if x > 0.0 else 1.0 - asymmetry)


@njit(cache=True)
def _mean_size(one: float, other: float) -> float:
    """Mean of the size of what goes straight from one value to the other."""
    total = abs(one) + abs(other)
    return 0.5 * (one * one + other * other) / total if one * other < 0.0 else 0.5 * total


@njit(cache=True)
def _paced(asymmetry: float, value: float, wanted: float, c: Doubles) -> float:
    """Voltage (V) for `value` with which a path goes where the `wanted` one calls it, its lag unequal by direction."""
    before, after = c[VELOCITY], c[FREE_VELOCITY] - c[LOAD_VELOCITY]
    size = abs(before) + abs(after)
    # Of the sub-step, the part in which it moves forward.
    forward = (max(before, 0.0) + max(after, 0.0)) / size if size > 0.0 else 0.5
    quicker = forward / (1.0 + asymmetry) + (1.0 - forward) / (1.0 - asymmetry)
    # What this changes within the sub-step counts half.
    half = 0.5 * c[VELOCITY_GAIN]
    speed = 0.5 * (before + after)
    stands = (1.0 - quicker) * (speed - half * value) / c[SPEED_GAIN]
    return (quicker * wanted + stands) / (1.0 - (1.0 - quicker) * half / c[SPEED_GAIN])


@njit(cache=True)
def _dragged(asymmetry: float, value: float, c: Doubles) -> float:
    """Voltage (V) with which a path goes on that its own motion holds back less forward than backward."""
    before, after = c[VELOCITY], c[FREE_VELOCITY] - c[LOAD_VELOCITY]
    size = _mean_size(before, after)
    # What this changes within the sub-step counts half.
    changes = 0.5 * asymmetry * c[VELOCITY_GAIN] / c[SPEED_GAIN] * (1.0 if after > 0.0 else -1.0)
    return value + asymmetry * size / c[SPEED_GAIN] / (1.0 - changes)


@effect_step
def _step(p: Doubles, s: Doubles, value: float, c: Doubles) -> float:
    if c[STAGE] > 0.5 and c[STATIC_GAIN] != 0.0:
        held = halfway(c) / c[STATIC_GAIN]
        return held + _bent(value - held, p[0], p[2], p[5])
    if c[STAGE] > 0.5:
        if p[4] > 0.5 and c[SPEED_GAIN] != 0.0:
            c[INJECTION] += p[0] * _mean_size(c[VELOCITY], c[FREE_VELOCITY] - c[LOAD_VELOCITY])
            return value
        if p[7] > 0.5 and c[SPEED_GAIN] != 0.0:
            return _dragged(p[0], value, c)
        if p[6] != 0.0 and c[SPEED_GAIN] != 0.0:
            return _paced(p[6], value, value * (1.0 + p[0] if value > 0.0 else 1.0 - p[0]), c)
        return value * (1.0 + p[0] if c[FREE_VELOCITY] > c[LOAD_VELOCITY] else 1.0 - p[0])
    bent = p[1] + _bent(value - p[1], p[0], p[2], p[5])
    return bent if p[3] == 0.0 else bent - p[3] * (p[1] + _bent(-p[1], p[0], p[2], p[5]))


EFFECT = Effect(
    name="asymmetric_gain",
    sentence="One direction answers more strongly than the other.",
    attachment=Attachment.INPUT,
    parameters=(
        Parameter(
            "asymmetry",
            Quantity.RATIO,
            "gain above the centre over, below it under the mean",
            -0.95,
            0.95,
            (0.1, -0.1, 0.5, -0.5),
        ),
        Parameter(
            "centre_v",
            Quantity.INPUT,
            "voltage at which the gain changes",
            -3.0,
            3.0,
            (0.0, 0.3, 0.5, 0.7),
            optional=True,
            apart=True,
        ),
        Parameter(
            "rounding_v",
            Quantity.INPUT,
            "voltage over which the gain goes from one to the other",
            0.0,
            1.0,
            (0.0, 0.1),
            optional=True,
        ),
        Parameter(
            "through_zero",
            Quantity.RATIO,
            "0: the voltage at the centre acts as it is, 1: the line below it meets zero, -1: the one above does",
            -1.0,
            1.0,
            (0.0, 1.0, -1.0),
            optional=True,
            apart=True,
            usual=(1.0, -1.0),
        ),
        Parameter(
            "of_speed",
            Quantity.RATIO,
            "inside an integrating path, 1: the speed itself is more or less (unequal areas), 0: what drives it is",
            0.0,
            1.0,
            (1.0,),
            optional=True,
            usual=(1.0,),
            at=Attachment.STATE,
        ),
        Parameter(
            "of_slope",
            Quantity.RATIO,
            "rounded, 1: the curve's slope goes from one to the other, 0: the factor of the voltage does",
            0.0,
            1.0,
            (1.0,),
            optional=True,
            usual=(1.0,),
            channels=(Channel.PRESSURE,),
        ),
        Parameter(
            "lag_asymmetry",
            Quantity.RATIO,
            "inside an integrating path, its lag in the direction of motion over, against it under the mean",
            -0.9,
            0.9,
            (0.2, -0.2),
            optional=True,
            channels=(Channel.POSITION,),
            at=Attachment.STATE,
        ),
        Parameter(
            "of_drag",
            Quantity.RATIO,
            "inside an integrating path, 1: what drags on the motion is unequal, and with it gain and lag",
            0.0,
            1.0,
            (1.0,),
            optional=True,
            usual=(1.0,),
            channels=(Channel.POSITION,),
            at=Attachment.STATE,
        ),
    ),
    step=_step,
    check="Compare speed out and in at the same voltage; compare piston and rod side areas, look for a worn edge.",
    source="differential cylinder: Jelali & Kroll, Hydraulic Servo-systems (2003), 4.3",
    also=on_both(Attachment.STATE),
    holds=True,
)
