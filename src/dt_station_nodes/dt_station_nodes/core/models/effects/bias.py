"""Bias: the valve's null is off zero."""

import math

from ..compiled import TIME, Doubles, effect_step
from .effect import Attachment, Effect, Parameter, Quantity


@effect_step
def _step(p: Doubles, s: Doubles, value: float, c: Doubles) -> float:
    bias, settling, start_share = p[0], p[1], p[2]
    if settling <= 0.0:
        return value + bias
    return value + bias * (1.0 + (start_share - 1.0) * math.exp(-c[TIME] / settling))


EFFECT = Effect(
    name="bias",
    sentence="A constant offset acts as if added to the voltage.",
    attachment=Attachment.INPUT,
    parameters=(
        Parameter("bias_v", Quantity.INPUT, "offset of the voltage", -1.0, 1.0, (0.02, -0.02, 0.15, -0.15)),
        Parameter(
            "settling_s",
            Quantity.RUN_TIME,
            "time constant with which it settles as the amplifier warms, 0: it is there at once",
            0.0,
            600.0,
            (3.0, 15.0),
            optional=True,
        ),
        Parameter(
            "start_share",
            Quantity.RATIO,
            "share of it that is there at the start, where it settles",
            0.0,
            2.0,
            (0.7,),
            neutral=1.0,
            optional=True,
        ),
    ),
    step=_step,
    check="Command zero and watch for drift; adjust the valve's null and the amplifier's offset.",
    source="servo-valve null shift: Merritt (1967), 7.3",
)
