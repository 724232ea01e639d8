"""Hysteresis: the valve's magnetisation remembers the way the voltage came."""

import math

from ..compiled import Doubles, effect_step
from .effect import Attachment, Effect, Parameter, Quantity, begins

_ERF_SLOPE = 2.0 / math.sqrt(math.pi)
_SATURATED = 40.0  # half widths that a Bouc-Wen loop is moved by at once: it is at its end


@effect_step
def _step(p: Doubles, s: Doubles, value: float, c: Doubles) -> float:
    half_width, spread, bouc_wen, sharpness, depth = p[0], p[1], p[2], p[3], p[4]
    voltage, middle, bend, steepness = value, p[8], p[9], p[10]
    if s[9] == 0.0:
        s[9] = 1.0
        for j in range(9):
            s[j] = value + p[11]
        s[10] = value + p[11]
        if p[11] != 0.0:
            return value
    if bouc_wen > 0.0 and half_width > 0.0 and value != s[10]:
        # Bouc-Wen, beta + gamma = 1: w z' = u' (1 - |z|^n) on the way out, w z' = u' (1 + (beta - gamma) |z|^n) back.
        move = (value - s[10]) / half_width
        move /= 1.0 + p[7] if move > 0.0 else 1.0 - p[7]
        if abs(move) > _SATURATED:
            s[11] = math.copysign(1.0, move)
        else:
            pieces = 1 + int(abs(move) * 8.0)
            for _ in range(pieces):
                turn = 1.0 if move * s[11] > 0.0 else -p[5]
                along = abs(s[11]) if sharpness == 1.0 else abs(s[11]) ** sharpness
                s[11] += move / pieces * (1.0 - turn * along)
            s[11] = min(max(s[11], -1.0), 1.0)
    s[10] = value
    s[0] = min(max(s[0], value - half_width), value + half_width)
    play = s[0]
    if spread > 0.0:
        total = 0.0
        for j in range(1, 9):
            radius = half_width * j / 4.5
            s[j] = min(max(s[j], value - radius), value + radius)
            total += s[j] * (1.0 + p[12] * (4.5 - j) / 3.5)
        play = (1.0 - spread) * play + spread * total / 8.0
    loop = (1.0 - bouc_wen) * play + bouc_wen * (value - half_width * s[11])
    beyond = loop - middle
    if bend > 0.0:
        # Relays whose centres lie dense as a bell: Preisach's density, in two factors.
        beyond = math.erf(beyond * bend / _ERF_SLOPE) / bend
    loop = middle + steepness * beyond
    if p[6] > 0.0:
        depth *= math.exp(-0.5 * ((voltage - middle) / p[6]) ** 2)
    return voltage + depth * (loop - voltage)


EFFECT = Effect(
    name="hysteresis",
    sentence="The valve's answer to a voltage depends on whether the voltage rises or falls.",
    attachment=Attachment.INPUT,
    parameters=(
        Parameter(
            "half_width_v",
            Quantity.INPUT,
            "half the width of the loop",
            0.0,
            4.0,
            (0.003, 0.01, 0.03, 0.1, 0.25, 0.5, 1.0, 2.5),
        ),
        Parameter(
            "spread",
            Quantity.RATIO,
            "0: one sharp play operator, 1: eight of spread widths, a smooth loop",
            0.0,
            1.0,
            (0.0, 0.5),
            optional=True,
            usual=(1.0,),
        ),
        Parameter(
            "bouc_wen",
            Quantity.RATIO,
            "share of a Bouc-Wen loop instead, whose small loops drift",
            0.0,
            1.0,
            (0.0, 1.0),
            optional=True,
            apart=True,
        ),
        Parameter(
            "sharpness",
            Quantity.RATIO,
            "Bouc-Wen exponent: how sharp the loop's knees are",
            0.3,
            6.0,
            (1.0, 2.0),
            neutral=1.0,
            optional=True,
        ),
        Parameter(
            "depth",
            Quantity.RATIO,
            "share of the voltage that passes through the loop",
            0.03,
            2.0,
            (1.0, 0.6, 0.15),
            neutral=1.0,
            optional=True,
            apart=True,
        ),
        Parameter(
            "way_back",
            Quantity.RATIO,
            "Bouc-Wen beta - gamma: how much steeper a way back begins, 1 for a Duhem loop of exponentials",
            -0.8,
            1.0,
            (1.0,),
            optional=True,
        ),
        Parameter(
            "closes_v",
            Quantity.INPUT,
            "voltage over which the loop closes, as iron that saturates holds nothing back; 0: nowhere",
            0.0,
            3.0,
            (0.3,),
            optional=True,
        ),
        Parameter(
            "uneven",
            Quantity.RATIO,
            "by how much a Bouc-Wen loop takes longer to turn on the way up than on the mean of both ways",
            -0.8,
            0.8,
            (0.2, -0.2),
            optional=True,
        ),
        Parameter(
            "open_at_v",
            Quantity.INPUT,
            "voltage at which a loop that closes is widest, or about which it saturates",
            -2.0,
            2.0,
            (0.5,),
            optional=True,
        ),
        Parameter(
            "bend_per_v",
            Quantity.PER_SIGNAL,
            "one over the voltage from the middle at which the loop saturates, its relays dense as a bell; 0: never",
            0.0,
            8.0,
            (0.15, 0.5),
            optional=True,
        ),
        Parameter(
            "steepness",
            Quantity.RATIO,
            "slope of the loop's branches in their middle, of that of what passes beside them",
            0.2,
            8.0,
            (1.5,),
            neutral=1.0,
            optional=True,
        ),
        begins(Quantity.INPUT),
        Parameter(
            "density_slope",
            Quantity.RATIO,
            "how the weight of spread plays falls with their width; 1: to none of the widest, -1: it rises as much",
            -1.0,
            1.0,
            (0.8,),
            optional=True,
        ),
    ),
    step=_step,
    check="Run a slow triangle and compare the rising and the falling branch; try dither on the valve amplifier. "
    "A loop with sharp corners may as well be play in what moves the spool.",
    source="Prandtl-Ishlinskii play operators; Visintin, Differential Models of Hysteresis (1994); "
    "Wen, J. Eng. Mech. 102 (1976)",
    state_size=12,
    holds=True,
)
