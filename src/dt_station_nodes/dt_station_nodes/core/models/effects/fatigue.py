"""Fatigue: the answer weakens with past effort and recovers at rest. A rival to what it looks like, never named."""

import math

from ..compiled import SUBSTEP, Doubles, effect_step
from ..heat import by_heat
from .effect import Attachment, Effect, Parameter, Quantity


@effect_step
def _step(p: Doubles, s: Doubles, value: float, c: Doubles) -> float:
    left = math.exp(-c[SUBSTEP] / max(p[1], 1e-3))
    s[0] += (abs(value) - s[0]) * (1.0 - left)
    s[1] = max(s[1] * left, abs(value))
    return value * by_heat(-p[0] * (s[0] + p[3] * (s[1] - s[0])), p[2])


EFFECT = Effect(
    name="fatigue",
    sentence="The gain falls with past effort and recovers at rest.",
    attachment=Attachment.INPUT,
    parameters=(
        Parameter("loss_per_v", Quantity.RATIO, "loss of gain per volt of past effort", 0.0, 20.0, (0.1, 0.5)),
        Parameter("recovery_s", Quantity.RUN_TIME, "time in which it forgets", 0.3, 15.0, (1.0, 3.0, 9.0)),
        Parameter(
            "bend",
            Quantity.RATIO,
            "-1: the gain goes as one over a line of past effort, 0: exponentially, 1: along a line",
            -1.0,
            1.0,
            (0.8,),
            neutral=-1.0,
            optional=True,
            usual=(1.0,),
        ),
        Parameter(
            "of_peaks",
            Quantity.RATIO,
            "0: what it remembers of past effort is a mean that fades, 1: a peak that does",
            0.0,
            1.0,
            (1.0,),
            optional=True,
            apart=True,
        ),
    ),
    step=_step,
    check="Repeat one step at rising duty and watch its size; look at coil heating and supply sag.",
    source="first-order dependence of a gain on rectified input; coil resistance and supply sag; peak rectifier",
    state_size=2,
    sub_stepped=True,
    vocabulary=False,
    special_cases={"gain_drift": ""},
)
