"""Cubic stiffness: a restoring force that grows with the cube of the stroke."""

import math

from numba import njit

from ...channels import Channel
from ..compiled import (
    FREE_VELOCITY,
    LOAD_OUTPUT,
    OUTPUT_GAIN,
    STAGE,
    STATIC_GAIN,
    SUBSTEP,
    VELOCITY,
    VELOCITY_GAIN,
    Doubles,
    effect_step,
    halfway,
)
from .effect import Attachment, Effect, Parameter, Quantity


@njit(cache=True)
def _pressed(p: Doubles, y: float) -> float:
    return math.copysign(max(abs(y) - p[2], 0.0), y)


@njit(cache=True)
def _force(p: Doubles, pressed: float) -> float:
    square = pressed * pressed
    return (p[3] + p[0] * square * (1.0 + p[7] * square)) * pressed


@njit(cache=True)
def _slope(p: Doubles, pressed: float) -> float:
    square = pressed * pressed
    return p[3] + p[0] * square * (3.0 + 5.0 * p[7] * square) if pressed != 0.0 else 0.0


@njit(cache=True)
def _spool(p: Doubles, value: float, gain: float, trim: float) -> float:
    """Voltage w (V) that acts where a spring bends the spool itself: w + force at the pressure that w holds = value."""
    w = value
    for _ in range(20):
        pressed = _pressed(p, gain * w - p[1])
        change = (w + _force(p, pressed) - trim - value) / max(1.0 + gain * _slope(p, pressed), 0.2)
        w -= change
        if abs(change) < 1e-9:
            break
    return w


@njit(cache=True)
def _answered(p: Doubles, before: float, value: float, gain: float, trim: float, step_s: float) -> float:
    """How far (Pa) a spring that answers late pulls back what is left of an output, at the end of a sub-step."""
    share = step_s / (p[9] + step_s)
    after = before
    for _ in range(20):
        pressed = _pressed(p, value - after - p[1])
        miss = after - before - share * (gain * (_force(p, pressed) - trim) - before)
        change = miss / max(1.0 + share * gain * _slope(p, pressed), 0.2)
        after -= change
        if abs(change) < 1e-9 * abs(value):
            break
    return after


@effect_step
def _step(p: Doubles, s: Doubles, value: float, c: Doubles) -> float:
    trim = p[5] * _force(p, _pressed(p, -p[1]))
    if c[STAGE] == 2.0:
        if p[9] > 0.0:
            s[0] = _answered(p, s[0], value, c[STATIC_GAIN], trim, c[SUBSTEP])
            return value - s[0]
        # What a gauge or a bellows shows, whose spring the whole pressure bends.
        return value - c[STATIC_GAIN] * (_force(p, _pressed(p, value - p[1])) - trim)
    if p[8] > 0.5 and c[STATIC_GAIN] != 0.0:
        return _spool(p, value, c[STATIC_GAIN], trim)
    y = halfway(c) - (1.0 - p[4]) * c[LOAD_OUTPUT] - p[1]
    half = 0.5 * c[OUTPUT_GAIN]
    if p[6] > 0.0:
        y += p[6] * 0.5 * (c[VELOCITY] + c[FREE_VELOCITY])
        half += p[6] * 0.5 * c[VELOCITY_GAIN]
    pressed = _pressed(p, y)
    # What the spring itself does within the sub-step counts half: a step of Newton's from where it did nothing.
    pressed = _pressed(p, y - half * (_force(p, pressed) - trim) / (1.0 + half * _slope(p, pressed)))
    return value - _force(p, pressed) + trim


EFFECT = Effect(
    name="cubic_stiffness",
    sentence="A hardening spring pulls the piston or the valve back, ever more strongly away from its centre.",
    attachment=Attachment.STATE,
    parameters=(
        Parameter(
            "coefficient",
            Quantity.INPUT_PER_OUTPUT_CUBED,
            "voltage needed per cube of the stroke, or of the pressure",
            -3.0,
            3.0,
            (0.0008, 0.004, 0.02, 0.2, -0.02),
        ),
        Parameter(
            "centre",
            Quantity.OUTPUT,
            "place where the spring is at rest",
            -2.0,
            2.0,
            (0.0,),
            optional=True,
            tried_first=True,
        ),
        Parameter("play", Quantity.OUTPUT, "way to either side before it is met", 0.0, 1.0, (0.0, 0.3), optional=True),
        Parameter(
            "linear",
            Quantity.INPUT_PER_OUTPUT,
            "voltage needed per stroke, besides: the spring's stiffness at its centre",
            -1.0,
            1.0,
            (0.0, 0.1),
            optional=True,
        ),
        Parameter(
            "load_share",
            Quantity.RATIO,
            "1: it pulls back what the load moves too, 0: only what the valve moves",
            0.0,
            1.0,
            (0.0,),
            neutral=1.0,
            optional=True,
            usual=(0.0,),
        ),
        Parameter(
            "trimmed",
            Quantity.RATIO,
            "1: the valve's null was set with the spring in place, which does nothing at zero; 0: at its centre",
            0.0,
            1.0,
            (0.0, 1.0),
            optional=True,
            first_on=(Channel.PRESSURE,),
            usual=(1.0,),
        ),
        Parameter(
            "lead_s",
            Quantity.TIME,
            "how much sooner than the output moves what the spring pulls at, as a spool inside a slower circuit",
            0.0,
            0.1,
            (0.02,),
            optional=True,
            channels=(Channel.PRESSURE,),
            at=Attachment.STATE,
        ),
        Parameter(
            "stiffening",
            Quantity.PER_OUTPUT_SQUARED,
            "how much more than with the cube the force grows, per square of the stroke: the fifth power's share",
            0.0,
            5.0,
            (0.3,),
            optional=True,
        ),
        Parameter(
            "of_spool",
            Quantity.RATIO,
            "1: it bends the valve's spool, ahead of all that follows, at the pressure that the spool calls for",
            0.0,
            1.0,
            (1.0,),
            optional=True,
            channels=(Channel.PRESSURE,),
            at=Attachment.STATE,
            usual=(1.0,),
        ),
        Parameter(
            "answer_s",
            Quantity.TIME,
            "time in which it answers, pulling at what it has left; 0: at once, at all that there would be without it",
            0.0,
            0.2,
            (0.02,),
            optional=True,
            channels=(Channel.PRESSURE,),
            at=Attachment.OUTPUT,
        ),
    ),
    step=_step,
    check="Measure the voltage needed to hold several places along the stroke, or several pressures; "
    "look for bellows and end cushions.",
    source="Duffing spring; Nayfeh & Mook, Nonlinear Oscillations (1979), 4.1",
    state_size=1,
    sub_stepped=True,
    also={Channel.PRESSURE: (Attachment.OUTPUT,)},
)
