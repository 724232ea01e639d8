"""Resonance: a lightly damped mode of oil, hose or frame."""

import math

from numba import njit

from ..compiled import RAW_INPUT, SPEED_GAIN, STATIC_GAIN, SUBSTEP, Doubles, effect_step
from ..second_order import swing
from .effect import Attachment, Effect, Parameter, Quantity, on_both

_CONSTANT = 1e11  # a swing at which it has not doubled
_SOFTEST = 0.05  # stiffness left of a spring that softens, however far it swings


@njit(cache=True)
def _matrix(s: Doubles, w: float, damping: float, h: float) -> None:
    """exp(A h) of the mode's state matrix, kept in the state."""
    cosine, sine = swing(damping * w, w, h)
    s[3] = cosine + damping * w * sine
    s[4] = sine
    s[5] = -w * w * sine
    s[6] = cosine - damping * w * sine


@effect_step
def _step(p: Doubles, s: Doubles, value: float, c: Doubles) -> float:
    frequency, damping, share, beside, beside_rate, washout_s = p[0], p[1], p[2], p[4], p[5], p[8]
    w = 2.0 * math.pi * frequency
    given, unit = value, 1.0
    if washout_s > 0.0:
        if s[2] == 0.0:
            s[7] = value
        slow = s[7]
        s[7] += (value - slow) * (1.0 - math.exp(-c[SUBSTEP] / washout_s))
        given = value - 0.5 * (slow + s[7])
    elif beside != 0.0 or beside_rate != 0.0:
        given = c[RAW_INPUT]
        unit = c[STATIC_GAIN] if c[STATIC_GAIN] != 0.0 else c[SPEED_GAIN] / w
    if s[2] == 0.0:
        s[2] = 1.0
        s[0] = given
        s[1] = 0.0
        _matrix(s, w, damping, c[SUBSTEP])
    if p[6] < _CONSTANT or p[7] != 0.0:
        halfway = s[0] - given + 0.5 * c[SUBSTEP] * s[1]
        hardened = math.sqrt(max(1.0 + p[7] * (unit * halfway) ** 2, _SOFTEST))
        _matrix(s, w * hardened, damping * (1.0 + abs(unit * s[1]) / (w * p[6])) / hardened, c[SUBSTEP])
    before = s[0]
    offset = before - given
    rate = s[1]
    s[0] = given + s[3] * offset + s[4] * rate
    s[1] = s[5] * offset + s[6] * rate
    mean_rate = 0.5 * (rate + s[1]) / w
    if washout_s > 0.0:
        return value + share * 0.5 * (before + s[0]) + p[3] * mean_rate
    if beside != 0.0 or beside_rate != 0.0:
        return value + unit * (beside * s[0] + beside_rate * s[1] / w)
    return value + share * (0.5 * (before + s[0]) - value) + p[3] * mean_rate


EFFECT = Effect(
    name="resonance",
    sentence="A lightly damped mode rings after fast changes.",
    attachment=Attachment.INPUT,
    parameters=(
        Parameter(
            "frequency_hz", Quantity.FREQUENCY, "natural frequency of the mode", 0.2, 20.0, (1.5, 2.5, 4.0, 6.0, 10.0)
        ),
        Parameter("damping", Quantity.RATIO, "damping ratio", 0.005, 0.45, (0.05, 0.3)),
        Parameter(
            "share",
            Quantity.RATIO,
            "share of the input that passes through the mode; below 0 a mass on a spring rides on it",
            -4.0,
            2.0,
            (1.0, 0.15, -0.3),
            neutral=1.0,
            optional=True,
            tried_first=True,
        ),
        Parameter(
            "riding",
            Quantity.RATIO,
            "how much of the mode's rate, over its angular frequency, rides on top",
            -2.0,
            2.0,
            (0.0, 0.5, -0.5),
            optional=True,
        ),
        Parameter(
            "beside",
            Quantity.RATIO,
            "of a mode that the voltage shakes beside the path: what of its swing the output shows",
            -10.0,
            10.0,
            (0.1,),
            optional=True,
            apart=True,
        ),
        Parameter(
            "beside_rate",
            Quantity.RATIO,
            "what of its rate, over its angular frequency",
            -10.0,
            10.0,
            (0.1,),
            optional=True,
            apart=True,
        ),
        Parameter(
            "doubling",
            Quantity.SIGNAL,
            "rate of the swing, over its angular frequency, at which its damping has doubled, as behind an orifice",
            0.02,
            50.0,
            (0.5,),
            neutral=1e12,
            optional=True,
        ),
        Parameter(
            "stiffening",
            Quantity.PER_SIGNAL_SQUARED,
            "relative growth of its stiffness over the square of its swing, below 0 its softening",
            -1.0,
            10.0,
            (0.3, -0.1),
            optional=True,
        ),
        Parameter(
            "washout_s",
            Quantity.TIME,
            "time over which a mode that only changes shake forgets the voltage, its share on top of all of that",
            0.0,
            2.0,
            (),
            optional=True,
            at=Attachment.INPUT,
        ),
    ),
    step=_step,
    check="Tap or step the rig and listen for ringing; look at hose length, trapped air and frame stiffness.",
    source="second-order mode; hydraulic natural frequency as Merritt (1967), 6.2; stiffening as Duffing (1918)",
    state_size=8,
    sub_stepped=True,
    also=on_both(Attachment.OUTPUT),
    apart_at=Attachment.OUTPUT,
)
