"""Leakage: oil lost past the piston lets it creep under load."""

import math

from ..compiled import INJECTION, LOAD, REST, Doubles, effect_step
from .effect import Attachment, Effect, Parameter, Quantity


@effect_step
def _step(p: Doubles, s: Doubles, value: float, c: Doubles) -> float:
    coefficient, turbulence, base = p[0], p[1], p[2]
    pressure = c[LOAD] + c[REST] * (1.0 - base)
    laminar = pressure
    # The turbulent law is scaled to meet the laminar one at the rest pressure.
    turbulent = math.copysign(math.sqrt(abs(pressure) * max(c[REST], 1.0)), pressure)
    c[INJECTION] -= coefficient * ((1.0 - turbulence) * laminar + turbulence * turbulent)
    return value


EFFECT = Effect(
    name="leakage",
    sentence="Oil leaking past the piston lets it creep in proportion to the load pressure.",
    attachment=Attachment.STATE,
    parameters=(
        Parameter("coefficient", Quantity.VELOCITY_PER_LOAD, "creep per load pressure", -2.0, 2.0, (0.01, 0.05, -0.02)),
        Parameter(
            "turbulence", Quantity.RATIO, "0: laminar gap, 1: square-root orifice", 0.0, 1.0, (0.0,), optional=True
        ),
        Parameter(
            "base",
            Quantity.RATIO,
            "pressure at which nothing leaks, over the rest pressure",
            0.0,
            2.0,
            (1.0,),
            optional=True,
        ),
    ),
    step=_step,
    check="Block the valve, load the piston and watch it creep; look at piston seals and the valve's leakage flow.",
    source="Merritt, Hydraulic Control Systems (1967), 2.2 and 6.2: laminar leakage coefficient",
)
