"""Periodic disturbance: something outside the model shakes the output at one frequency."""

import math

from ..compiled import SUBSTEP, TIME, Doubles, effect_step
from .effect import Attachment, Effect, Parameter, Quantity


@effect_step
def _step(p: Doubles, s: Doubles, value: float, c: Doubles) -> float:
    angle = 2.0 * math.pi * p[1] * (c[TIME] + c[SUBSTEP]) + p[2]
    wave = math.sin(angle) + p[3] * math.sin(2.0 * angle) + p[4] * math.cos(2.0 * angle)
    wave += p[5] * math.sin(3.0 * angle) + p[6] * math.cos(3.0 * angle)
    return value + p[0] * wave


EFFECT = Effect(
    name="periodic_disturbance",
    sentence="The output carries an oscillation of one frequency that no input explains.",
    attachment=Attachment.OUTPUT,
    parameters=(
        Parameter("amplitude", Quantity.SIGNAL, "amplitude of the oscillation", 0.0, 2.0, (0.05,)),
        Parameter("frequency_hz", Quantity.FREQUENCY, "its frequency", 0.02, 24.0, (0.5, 2.0, 8.0), acts_alone=False),
        Parameter(
            "phase_rad",
            Quantity.ANGLE,
            "its phase at the start of the run",
            -7.0,
            7.0,
            (0.0, 2.0, -2.0),
            acts_alone=False,
        ),
        Parameter("second_sine", Quantity.RATIO, "second harmonic in phase", -1.5, 1.5, (0.0,), optional=True),
        Parameter("second_cosine", Quantity.RATIO, "second harmonic a quarter off", -1.5, 1.5, (0.0,), optional=True),
        Parameter("third_sine", Quantity.RATIO, "third harmonic in phase", -1.5, 1.5, (0.0,), optional=True),
        Parameter("third_cosine", Quantity.RATIO, "third harmonic a quarter off", -1.5, 1.5, (0.0,), optional=True),
    ),
    step=_step,
    check="Look for pump ripple, mains hum or a neighbouring machine at this frequency; log with the valve unpowered.",
    source="additive sinusoid",
    also=(Attachment.INPUT,),
)
