"""Bias: the valve's null, or a sensor's zero, is off, from the start or from some time on."""

import math

from ..compiled import TIME, Doubles, effect_step
from ..onset import EVEN, come
from .effect import Attachment, Effect, Parameter, Quantity, on_both


@effect_step
def _step(p: Doubles, s: Doubles, value: float, c: Doubles) -> float:
    bias, settling, start_share, jump = p[0], p[1], p[2], p[3]
    if settling > 0.0:
        bias *= 1.0 + (start_share - 1.0) * math.exp(-c[TIME] / settling)
    if jump != 0.0:
        bias += jump * come(c, p[4], p[5], p[6])
    return value + bias


EFFECT = Effect(
    name="bias",
    sentence="An offset acts as if added to the voltage, or to what is measured.",
    attachment=Attachment.INPUT,
    parameters=(
        Parameter("bias_v", Quantity.SIGNAL, "offset of the signal", -1.0, 1.0, (0.02, -0.02, 0.15, -0.15)),
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
        Parameter(
            "jump_v",
            Quantity.SIGNAL,
            "further offset that comes in the course of the run",
            -2.0,
            2.0,
            (),
            optional=True,
            acts_alone=True,
        ),
        Parameter("jump_s", Quantity.RUN_TIME, "time of the run at which it comes", 0.0, 3600.0, (), optional=True),
        Parameter("jump_lag_s", Quantity.TIME, "time constant with which it comes", 0.0, 3.0, (), optional=True),
        Parameter("jump_even", Quantity.RATIO, EVEN, 0.0, 1.0, (), optional=True),
    ),
    step=_step,
    check="Command zero and watch for drift; adjust the valve's null and the amplifier's offset; measure the output a "
    "second way; see what happened at the time at which it came.",
    source="servo-valve null shift: Merritt (1967), 7.3",
    # A cylinder's sensor shows no offset that it has from the start; what comes in the run comes at once there.
    also=on_both(Attachment.OUTPUT),
)
