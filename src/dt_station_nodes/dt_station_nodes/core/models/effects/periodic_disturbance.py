"""Periodic disturbance: something outside the model shakes the output at one frequency."""

import math

from ..compiled import SUBSTEP, TIME, Doubles, effect_step
from .effect import Attachment, Effect, Parameter, Quantity


@effect_step
def _step(p: Doubles, s: Doubles, value: float, c: Doubles) -> float:
    return value + p[0] * math.sin(2.0 * math.pi * p[1] * (c[TIME] + c[SUBSTEP]) + p[2])


EFFECT = Effect(
    name="periodic_disturbance",
    sentence="The output carries an oscillation of one frequency that no input explains.",
    attachment=Attachment.OUTPUT,
    parameters=(
        Parameter("amplitude", Quantity.SIGNAL, "amplitude of the oscillation", 0.0, 2.0, (0.05,)),
        Parameter("frequency_hz", Quantity.FREQUENCY, "its frequency", 0.02, 24.0, (0.5, 2.0, 8.0)),
        Parameter("phase_rad", Quantity.ANGLE, "its phase at the start of the run", -7.0, 7.0, (0.0, 2.0, -2.0)),
    ),
    step=_step,
    check="Look for pump ripple, mains hum or a neighbouring machine at this frequency; log with the valve unpowered.",
    source="additive sinusoid",
    also=(Attachment.INPUT,),
)
