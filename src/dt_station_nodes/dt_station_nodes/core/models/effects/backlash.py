"""Backlash: play between the actuator and what the sensor sees."""

import math

from ..compiled import SUBSTEP, Doubles, effect_step
from .effect import Attachment, Effect, Parameter, Quantity, on_both


@effect_step
def _step(p: Doubles, s: Doubles, value: float, c: Doubles) -> float:
    wide, narrow = p[0] * (1.0 + p[2]), p[0] * (1.0 - p[2])
    if s[1] == 0.0:
        s[1] = 1.0
        s[0] = value
        s[4] = value
    s[0] = min(max(s[0], value - wide), value + wide)
    s[4] = min(max(s[4], value - narrow), value + narrow)
    carried = 0.5 * (s[0] + s[4])
    if p[1] <= 1e-9:
        return carried
    if s[3] == 0.0:
        s[3] = 1.0
        s[2] = carried
    s[2] = carried + (s[2] - carried) * math.exp(-c[SUBSTEP] / p[1])
    return s[2]


EFFECT = Effect(
    name="backlash",
    sentence="After each reversal the output stands still until play in the linkage is taken up.",
    attachment=Attachment.OUTPUT,
    parameters=(
        Parameter(
            "half_width",
            Quantity.SIGNAL,
            "half the play, in volts where it sits on the input",
            0.0,
            1.0,
            (0.003, 0.01, 0.03, 0.1, 0.2),
        ),
        Parameter(
            "lag_s", Quantity.TIME, "time over which a compliant contact closes", 0.0, 1.0, (0.02,), optional=True
        ),
        Parameter(
            "spread",
            Quantity.RATIO,
            "two joints share the load: how much more and less play they have than on average",
            0.0,
            0.6,
            (0.25,),
            optional=True,
        ),
    ),
    step=_step,
    check="Hold the actuator and move the load by hand or dial gauge; look at pins, couplings and sensor mounting.",
    source="Nordin & Gutman, Automatica 38 (2002) 1633: dead-zone-free play model",
    state_size=5,
    also=on_both(Attachment.INPUT),
)
