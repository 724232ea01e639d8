"""Extra lag: a further first-order element, such as a slow amplifier, pilot stage or filter."""

import math

from ..compiled import SUBSTEP, Doubles, effect_step
from .effect import Attachment, Effect, Parameter, Quantity


@effect_step
def _step(p: Doubles, s: Doubles, value: float, c: Doubles) -> float:
    if s[1] == 0.0:
        s[1] = 1.0
        s[0] = value
    time_constant = p[0]
    if time_constant <= 1e-9:
        s[0] = value
        return value
    ratio = c[SUBSTEP] / time_constant
    left = math.exp(-ratio)
    before = s[0]
    s[0] = value + (before - value) * left
    # The mean over the sub-step, exact for a held voltage, so that the linear path gets the right area.
    return value + (before - value) * (1.0 - left) / ratio


EFFECT = Effect(
    name="extra_lag",
    sentence="A further first-order lag slows the answer.",
    attachment=Attachment.INPUT,
    parameters=(Parameter("time_constant_s", Quantity.TIME, "time constant of the lag", 0.0, 2.0, (0.01, 0.05, 0.2)),),
    step=_step,
    check="Measure amplifier current against voltage, and the sensor's filter; compare the step answer's first part.",
    source="first-order element, exact for a held input",
    state_size=2,
    sub_stepped=True,
)
