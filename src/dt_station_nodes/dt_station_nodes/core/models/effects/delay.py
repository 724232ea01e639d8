"""Delay: the voltage acts only after a dead time."""

import math

from numba import njit

from ..compiled import SUBSTEP, TIME, Doubles, effect_step
from .effect import Attachment, Effect, Parameter, Quantity, on_both

_SLOTS = 512
_CELLS = 6
_CELLS_AT = 520


@njit(cache=True)
def _dispersed(s: Doubles, delay: float, order: float, h: float, value: float) -> float:
    """An all-pass element of the same delay by the bilinear rule: Pade's second `order` at 1, his first at 2."""
    if delay <= 1e-9:
        return value
    half, square = delay / h, max(2.0 - order, 0.01) * delay * delay / (3.0 * h * h)
    whole = square + half + 1.0
    back, middle = (square - half + 1.0) / whole, (2.0 - 2.0 * square) / whole
    if s[514] == 0.0:
        s[514] = 1.0
        s[515] = s[516] = (1.0 - back) * value
    output = back * value + s[515]
    s[515] = middle * (value - output) + s[516]
    s[516] = value - back * output
    return output


@njit(cache=True)
def _leaning(s: Doubles, delay: float, h: float, value: float) -> float:
    """1 while the voltage rises, -1 while it falls; it takes the dead time itself to turn from one to the other."""
    if value != s[518]:
        s[517] = 1.0 if value > s[518] else -1.0
        s[518] = value
    s[519] += (s[517] - s[519]) * -math.expm1(-h / max(delay, h))
    return s[519]


@njit(cache=True)
def _echoed(s: Doubles, head: int, behind: float, echo: float, first: float) -> float:
    """What reaches the end of a line whose ends throw back a share `echo` between them, on each way there and back."""
    total, share, weight = first, echo, 1.0 + echo + echo * echo
    for passes in (3.0, 5.0):
        at = min(passes * behind, 510.0)
        whole = int(at)
        recent, older = s[(head - whole) % 512], s[(head - whole - 1) % 512]
        total += share * (recent + (at - whole) * (older - recent))
        share *= echo
    return total / weight


@njit(cache=True)
def _mixed(s: Doubles, share: float, value: float) -> float:
    """What leaves a row of equal cells, well mixed, each of which passes on a `share` of what is new in a sub-step."""
    if s[_CELLS_AT + _CELLS] == 0.0:
        s[_CELLS_AT + _CELLS] = 1.0
        for k in range(_CELLS):
            s[_CELLS_AT + k] = value
    for k in range(_CELLS):
        s[_CELLS_AT + k] += share * (value - s[_CELLS_AT + k])
        value = s[_CELLS_AT + k]
    return value


@effect_step
def _step(p: Doubles, s: Doubles, value: float, c: Doubles) -> float:
    if s[513] == 0.0:
        s[513] = 1.0
        for j in range(512):
            s[j] = value
        s[518] = value
    head = int(s[512])
    s[head] = value
    wander = p[2] * math.sin(2.0 * math.pi * p[3] * c[TIME] + p[4]) if p[2] != 0.0 else 0.0
    longer = p[6] * _leaning(s, p[0], c[SUBSTEP], value) if p[6] != 0.0 else 0.0
    cell_s = p[0] * p[8] / math.sqrt(_CELLS)
    share = -math.expm1(-c[SUBSTEP] / cell_s) if cell_s > 0.0 else 1.0
    mixing_s = _CELLS * c[SUBSTEP] * (1.0 / share - 1.0)
    early = p[0] * min(p[5], 1.0)
    stretched = p[1] * (p[9] * math.tanh(abs(value) / p[9])) if p[1] != 0.0 else 0.0
    line = p[0] * (1.0 + stretched + wander + longer) - early - mixing_s
    behind = min(max(line / c[SUBSTEP], 0.0), 510.0)
    whole = int(behind)
    part = behind - whole
    recent = s[(head - whole) % 512]
    older = s[(head - whole - 1) % 512]
    s[512] = (head + 1) % 512
    on_time = recent + part * (older - recent)
    if p[7] != 0.0:
        on_time = _echoed(s, head, behind, p[7], on_time)
    if cell_s > 0.0:
        on_time = _mixed(s, share, on_time)
    return on_time if p[5] == 0.0 else _dispersed(s, early, max(p[5], 1.0), c[SUBSTEP], on_time)


EFFECT = Effect(
    name="delay",
    sentence="The voltage takes a dead time to act.",
    attachment=Attachment.INPUT,
    parameters=(
        Parameter("delay_s", Quantity.TIME, "dead time", 0.0, 1.0, (0.01, 0.03, 0.07, 0.15)),
        Parameter(
            "stretch_per_v",
            Quantity.RATIO,
            "how much longer the delay is per volt, as flow speeds or slows it",
            -1.0,
            1.0,
            (-0.03,),
            optional=True,
        ),
        Parameter(
            "wander",
            Quantity.RATIO,
            "how much longer and shorter it turns as time goes by",
            0.0,
            1.0,
            (),
            optional=True,
        ),
        Parameter("wander_hz", Quantity.RUN_RATE, "how often it does", 0.0, 2.0, (), optional=True),
        Parameter("wander_rad", Quantity.ANGLE, "phase of that at the start of the run", -7.0, 7.0, (), optional=True),
        Parameter(
            "dispersion",
            Quantity.RATIO,
            "share of the dead time by which quick changes come early: 1 as of Pade's second-order element, 2 first",
            0.0,
            2.0,
            (0.6, 1.0, 2.0),
            optional=True,
            apart=True,
            usual=(1.0, 2.0),
        ),
        Parameter(
            "unequal",
            Quantity.RATIO,
            "how much longer than its mean it is upwards, and shorter downwards, as a pilot opens and closes",
            -0.9,
            0.9,
            (0.1, -0.1),
            optional=True,
        ),
        Parameter(
            "echo",
            Quantity.RATIO,
            "share that comes again after two dead times more, thrown back by both ends of a line",
            -0.5,
            0.5,
            (0.1, -0.1),
            optional=True,
        ),
        Parameter(
            "mixing",
            Quantity.RATIO,
            "standard deviation of the dead time over its mean, as what passes along a line mixes on its way",
            0.0,
            0.4,
            (0.1, 0.3),
            optional=True,
        ),
        Parameter(
            "stretch_levels_v",
            Quantity.SIGNAL,
            "voltage about which more of it makes the delay no longer, nor shorter; 1e9 for never",
            0.01,
            1e9,
            (0.1, 0.4),
            neutral=1e9,
            optional=True,
        ),
    ),
    step=_step,
    check="Apply a step and time the first movement; look at the card's buffering, bus cycles and long hoses.",
    source="dead time as a ring of sub-steps with linear interpolation; "
    "Franklin, Powell & Emami-Naeini, Feedback Control of Dynamic Systems (2002): Pade element; "
    "Levenspiel, Chemical Reaction Engineering (1999), ch. 14: tanks in series",
    state_size=_CELLS_AT + _CELLS + 1,
    sub_stepped=True,
    also=on_both(Attachment.OUTPUT),
)
