"""Rate limit: a valve cannot follow faster than its slew rate, a pressure not rise faster than its pump fills it."""

import math

from numba import njit

from ...channels import Channel
from ..compiled import STAGE, STATIC_GAIN, SUBSTEP, Doubles, effect_step
from ..sided import sided
from .effect import PAST_ZERO, Attachment, Effect, Parameter, Quantity


@njit(cache=True)
def _gap(gap: float, scale: float, ratio: float) -> float:
    """What is left of a gap g with g' = -(scale / T) tanh(g / scale) after `ratio` times T, exactly."""
    x = abs(gap) / scale
    if x > 30.0:
        later = x - ratio
        if later > 30.0:
            return math.copysign(scale * later, gap)
        return math.copysign(scale * math.asinh(0.5 * math.exp(later)), gap)
    return math.copysign(scale * math.asinh(math.sinh(x) * math.exp(-ratio)), gap)


@njit(cache=True)
def _soft(s: Doubles, value: float, scale: float, ratio: float) -> float:
    """A follower that slews far from the value and lags close to it; its mean over the sub-step by Simpson."""
    if scale <= 0.0:
        return s[0]
    gap = value - s[0]
    half = _gap(gap, scale, 0.5 * ratio)
    end = _gap(half, scale, 0.5 * ratio)
    s[0] = value - end
    return value - (gap + 4.0 * half + end) / 6.0


@njit(cache=True)
def _inside(s: Doubles, value: float, rate: float, lag: float, h: float) -> float:
    """A first-order loop of time constant `lag` whose speed is limited, as the input of that lag without the limit.

    Where the loop does not slew this is the voltage itself; the mean over the sub-step, exactly.
    """
    gap = value - s[0]
    most = rate * lag
    if abs(gap) <= most:
        s[0] = value - gap * math.exp(-h / lag)
        return value
    slewing = min((abs(gap) - most) / rate, h) if rate > 0.0 else h
    ramp = math.copysign(rate, gap)
    seen = s[0] + 0.5 * ramp * slewing + math.copysign(most, gap)
    gap = (gap - ramp * slewing) * math.exp(-(h - slewing) / lag)
    s[0] = value - gap
    return value + (seen - value) * slewing / h


@effect_step
def _step(p: Doubles, s: Doubles, value: float, c: Doubles) -> float:
    if s[1] == 0.0:
        s[1] = 1.0
        s[0] = value
    wanted = value - s[0]
    rate = p[0] * sided(wanted, s[0], p[2], p[4], p[5])
    if c[STAGE] > 1.5:
        rate *= abs(c[STATIC_GAIN])
        most = rate * c[SUBSTEP]
        if p[1] > 1e-6:
            _soft(s, value, rate * p[1], c[SUBSTEP] / p[1])
        else:
            s[0] += min(max(wanted, -most), most)
        return s[0]
    if p[3] > 1e-6:
        return _inside(s, value, rate, p[3], c[SUBSTEP])
    if p[1] > 1e-6:
        return _soft(s, value, rate * p[1], c[SUBSTEP] / p[1])
    most = rate * c[SUBSTEP]
    if abs(wanted) <= most:
        s[0] = value
        # The mean over the sub-step of a ramp that ends within it.
        return value - 0.5 * wanted * abs(wanted) / most if most > 0.0 else value
    ramp = math.copysign(most, wanted)
    s[0] += ramp
    return s[0] - 0.5 * ramp


EFFECT = Effect(
    name="rate_limit",
    sentence="The valve follows the voltage, or a pressure its valve, no faster than at a highest rate.",
    attachment=Attachment.INPUT,
    parameters=(
        Parameter(
            "rate_v_per_s",
            Quantity.INPUT_RATE,
            "highest rate of change; behind the path, of the voltage that its output stands for at rest",
            2e-5,
            3.0,
            tuple(round(0.0015 * 1.42**k, 5) for k in range(20)),
            neutral=1e9,
        ),
        Parameter(
            "softness_s",
            Quantity.TIME,
            "time constant with which it closes small gaps, 0: it follows them at once",
            0.0,
            0.2,
            (0.01,),
            optional=True,
        ),
        Parameter(
            "asymmetry",
            Quantity.RATIO,
            "rate upwards above, downwards below the mean",
            -0.95,
            0.95,
            (-0.5, 0.5),
            optional=True,
            apart=True,
        ),
        Parameter(
            "loop_s",
            Quantity.TIME,
            "time constant of the loop in the path whose speed is limited, 0: the limit lies before the path",
            0.0,
            1.0,
            (0.05,),
            optional=True,
            at=Attachment.INPUT,
        ),
        Parameter(
            "closing",
            Quantity.RATIO,
            "rate towards zero above, away from it below the mean, as springs close a spool",
            -0.95,
            0.95,
            (0.0,),
            optional=True,
        ),
        PAST_ZERO,
    ),
    step=_step,
    check="Compare the answers to a small and a large step; look at amplifier ramps, pilot flow and pump.",
    source="slew-rate limiter; Slotine & Li, Applied Nonlinear Control (1991), 5.2",
    state_size=2,
    sub_stepped=True,
    also={Channel.PRESSURE: (Attachment.OUTPUT,)},
)
