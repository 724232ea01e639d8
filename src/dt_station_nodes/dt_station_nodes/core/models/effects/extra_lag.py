"""Extra lag: a further first-order element, such as a slow amplifier, pilot stage or filter, or one with some mass."""

import math

from numba import njit

from ..compiled import SUBSTEP, Doubles, effect_step
from ..second_order import swing
from ..sided import sided
from .effect import PAST_ZERO, Attachment, Effect, Parameter, Quantity, on_both


@njit(cache=True)
def _lag(s: Doubles, at: int, time_constant: float, substep: float, value: float) -> float:
    """Mean over the sub-step, exact for a held voltage, so that what follows gets the right area."""
    if time_constant <= 1e-9:
        s[at] = value
        return value
    ratio = substep / time_constant
    left = math.exp(-ratio)
    before = s[at]
    s[at] = value + (before - value) * left
    return value + (before - value) * (1.0 - left) / ratio


@njit(cache=True)
def _heavy(s: Doubles, lag: float, inertia: float, substep: float, value: float) -> float:
    """The same of lag (inertia y'' + y') + y = value, state s[0] with its rate s[3]."""
    half, stiffness = 0.5 / inertia, 1.0 / (lag * inertia)
    cosine, sine = swing(half, math.sqrt(stiffness), substep)
    gap, rate = s[0] - value, s[3]
    after = gap * (cosine + half * sine) + rate * sine
    s[3] = rate * (cosine - half * sine) - gap * stiffness * sine
    s[0] = value + after
    return value - lag * (inertia * (s[3] - rate) + after - gap) / substep


@njit(cache=True)
def _slowed(gap: float, turbulence: float) -> float:
    """Factor of the time constant of a volume behind a restrictor whose drop is q + turbulence q^2 at a flow of q."""
    return 0.5 * (1.0 + math.sqrt(1.0 + 4.0 * turbulence * abs(gap)))


@njit(cache=True)
def _quickened(after: float, saturation: float, in_air: float) -> float:
    """Factor of the time constant of a coil whose core saturates, at a current of `after`: its inductance falls.

    What its flux finds of a way `in_air` stays.
    """
    return in_air + (1.0 - in_air) / (1.0 + (saturation * after) ** 2)


@effect_step
def _step(p: Doubles, s: Doubles, value: float, c: Doubles) -> float:
    if s[1] == 0.0:
        s[1] = 1.0
        s[0] = value
        s[2] = value
    gap = value - s[0]
    lag = p[0]
    if p[3] != 0.0 or p[4] != 0.0:
        lag *= sided(gap, s[0], p[3], -p[4], p[5])
    if p[6] != 0.0:
        lag *= _slowed(gap, p[6])
    if lag > 1e-9 and p[8] > 0.0:
        half = math.exp(-0.5 * c[SUBSTEP] / (lag * _quickened(s[0], p[8], p[9])))
        lag *= _quickened(value - gap * half, p[8], p[9])
    if lag > 1e-9 and p[7] > 1e-9:
        first = _heavy(s, lag, p[7], c[SUBSTEP], value)
    else:
        first = _lag(s, 0, lag, c[SUBSTEP], value)
    return _lag(s, 2, p[1], c[SUBSTEP], p[2] * value + (1.0 - p[2]) * first)


EFFECT = Effect(
    name="extra_lag",
    sentence="A further lag slows the answer.",
    attachment=Attachment.INPUT,
    parameters=(
        Parameter("time_constant_s", Quantity.TIME, "time constant of the lag", 0.0, 2.0, (0.01, 0.05, 0.2)),
        Parameter(
            "second_s", Quantity.TIME, "time constant of a second lag behind it", 0.0, 2.0, (0.02,), optional=True
        ),
        Parameter(
            "straight",
            Quantity.RATIO,
            "share that passes the lag straight by; a second lag behind it makes two side by side of it",
            0.0,
            0.95,
            (0.5,),
            optional=True,
        ),
        Parameter(
            "unequal",
            Quantity.RATIO,
            "how much longer than its mean the lag is upwards, and shorter downwards, as a volume fills and empties",
            -1.0,
            1.0,
            (0.0,),
            optional=True,
        ),
        Parameter(
            "closing",
            Quantity.RATIO,
            "how much shorter than its mean the lag is towards zero, and longer away from it, as springs close a spool",
            -1.0,
            1.0,
            (0.0,),
            optional=True,
        ),
        PAST_ZERO,
        Parameter(
            "turbulence",
            Quantity.PER_SIGNAL,
            "t of a restrictor whose drop at a flow of q is q + t q^2, both as steady gaps: wide ones close slower",
            0.0,
            100.0,
            (1.0,),
            optional=True,
        ),
        Parameter(
            "inertia_s",
            Quantity.TIME,
            "mass over damping of what moves with the lag: a fourth of it for two equal lags, above it overshoots",
            0.0,
            2.0,
            (0.02,),
            optional=True,
        ),
        Parameter(
            "saturation",
            Quantity.PER_SIGNAL,
            "s of a coil whose core saturates: where y volts are behind the lag, it is 1/(1 + (s y)^2) of itself",
            0.0,
            10.0,
            (1.0,),
            optional=True,
            at=Attachment.INPUT,
        ),
        Parameter(
            "in_air",
            Quantity.RATIO,
            "share of a coil's inductance that does not saturate, of the flux beside its core",
            0.0,
            0.95,
            (0.2,),
            optional=True,
            at=Attachment.INPUT,
        ),
    ),
    step=_step,
    check="Measure amplifier current against voltage, and the sensor's filter; compare the step answer's first part.",
    source="elements of first and second order, exact for a held input; spool, drop of a restrictor: Merritt (1967), "
    "7.5 and 3.3; flux of a saturating core as the arc tangent of its current",
    state_size=4,
    sub_stepped=True,
    also=on_both(Attachment.OUTPUT),
)
