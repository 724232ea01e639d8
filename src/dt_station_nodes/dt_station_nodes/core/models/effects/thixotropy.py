"""Thixotropy: what stiffens at rest and breaks down as it is moved. A rival to what it looks like, never named."""

import math

from ..compiled import SUBSTEP, TIME, Doubles, effect_step
from .effect import Attachment, Effect, Parameter, Quantity


@effect_step
def _step(p: Doubles, s: Doubles, value: float, c: Doubles) -> float:
    if s[2] == 0.0:
        s[2] = 1.0
        s[1] = value
    if c[TIME] == 0.0:
        s[0] = 1.0 - p[3]
    s[0] = (1.0 + (s[0] - 1.0) * math.exp(-c[SUBSTEP] / max(p[1], 1e-3))) * math.exp(-p[2] * abs(value - s[1]))
    s[1] = value
    return value * (1.0 - p[0] * s[0])


EFFECT = Effect(
    name="thixotropy",
    sentence="The gain falls at rest and comes back with motion.",
    attachment=Attachment.INPUT,
    parameters=(
        Parameter("loss", Quantity.RATIO, "share of the gain that is lost after a long rest", -0.5, 0.9, (0.1, 0.4)),
        Parameter("rebuilding_s", Quantity.RUN_TIME, "time in which the structure comes back", 0.3, 15.0, (1.0, 4.0)),
        Parameter(
            "breaking_per_v",
            Quantity.PER_SIGNAL,
            "how much of it breaks down per volt of motion, of what is left",
            0.02,
            50.0,
            (0.2, 0.6, 2.0),
        ),
        Parameter(
            "broken", Quantity.RATIO, "share that is broken down when the run begins", 0.0, 1.0, (1.0,), optional=True
        ),
    ),
    step=_step,
    check="Repeat one step after rests of different length and watch its first answer; look at grease and cold oil.",
    source="structural kinetics of first order: Moore (1959), Barnes (1997)",
    state_size=3,
    sub_stepped=True,
    vocabulary=False,
    special_cases={"gain_drift": ""},
)
