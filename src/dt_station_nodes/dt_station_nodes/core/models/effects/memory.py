"""Memory: part of the answer comes late and lasts long, as no single lag does."""

import math

from ..compiled import SUBSTEP, Doubles, effect_step
from .effect import Attachment, Effect, Parameter, Quantity


@effect_step
def _step(p: Doubles, s: Doubles, value: float, c: Doubles) -> float:
    share, slowest = p[0], p[1]
    total = 0.0
    tau = slowest
    for j in range(4):
        s[j] += (value - s[j]) * (1.0 - math.exp(-c[SUBSTEP] / max(tau, 1e-6)))
        total += s[j]
        tau /= p[2]
    return value + share * (0.25 * total - value)


EFFECT = Effect(
    name="memory",
    sentence="Part of the answer comes late, over several decades of time.",
    attachment=Attachment.INPUT,
    parameters=(
        Parameter("share", Quantity.RATIO, "share that comes late, negative where it fades", -3.0, 0.95, (0.1, -0.1)),
        Parameter(
            "slowest_s",
            Quantity.RUN_TIME,
            "slowest of four time constants: what comes sooner is a lag",
            0.5,
            60.0,
            (1.0, 8.0),
        ),
        Parameter(
            "ratio",
            Quantity.RATIO,
            "how many times the next each time constant is",
            1.1,
            10.0,
            (1.8,),
            neutral=3.0,
            optional=True,
        ),
    ),
    step=_step,
    check="Hold a step for minutes and watch the output creep; look for hoses, seals and oil that relax slowly.",
    source="power-law creep as a sum of lags; Christensen, Theory of Viscoelasticity (1982), 1.4",
    state_size=4,
    sub_stepped=True,
    vocabulary=False,
)
