"""Rate limit: the valve cannot follow faster than its slew rate."""

import math

from ..compiled import SUBSTEP, Doubles, effect_step
from .effect import Attachment, Effect, Parameter, Quantity


@effect_step
def _step(p: Doubles, s: Doubles, value: float, c: Doubles) -> float:
    if s[1] == 0.0:
        s[1] = 1.0
        s[0] = value
    wanted = value - s[0]
    most = p[0] * c[SUBSTEP]
    if abs(wanted) <= most:
        s[0] = value
        # The mean over the sub-step of a ramp that ends within it.
        return value - 0.5 * wanted * abs(wanted) / most if most > 0.0 else value
    ramp = math.copysign(most, wanted)
    s[0] += ramp
    return s[0] - 0.5 * ramp


EFFECT = Effect(
    name="rate_limit",
    sentence="The valve follows the voltage no faster than its slew rate.",
    attachment=Attachment.INPUT,
    parameters=(
        Parameter(
            "rate_v_per_s",
            Quantity.INPUT_RATE,
            "highest rate of change",
            0.0,
            3.0,
            tuple(round(0.0015 * 1.42**k, 5) for k in range(20)),
            neutral=1e9,
        ),
    ),
    step=_step,
    check="Compare the answers to a small and a large step; look at amplifier ramps and pilot flow.",
    source="slew-rate limiter; Slotine & Li, Applied Nonlinear Control (1991), 5.2",
    state_size=2,
    sub_stepped=True,
)
