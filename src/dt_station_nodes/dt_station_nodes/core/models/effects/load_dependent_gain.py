"""Load-dependent gain: the flow through the valve falls as load pressure eats the pressure drop."""

import math

from ..compiled import LOAD, REST, SUBSTEP, Doubles, effect_step
from .effect import Attachment, Effect, Parameter, Quantity


@effect_step
def _step(p: Doubles, s: Doubles, value: float, c: Doubles) -> float:
    per_load, direction, linearity, base = p[0], p[1], p[2], p[3]
    helps = -1.0 if value < 0.0 else 1.0
    if p[7] > 1e-9:
        helps = math.tanh(value / p[7])
    load = c[LOAD] + c[REST] * (1.0 - base)
    if p[4] > 0.5:
        load = max(load, 0.0)
    if p[6] > 1e-6:
        s[0] += (load - s[0]) * (1.0 - math.exp(-c[SUBSTEP] / p[6]))
        load = s[0]
    load *= max(1.0 + p[5] * load, 0.0)
    share = per_load * load * (1.0 - direction + direction * helps)
    root = math.sqrt(max(1.0 - 2.0 * share, 0.0))
    line = max(1.0 - share, 0.0)
    if linearity <= 1.0:
        return value * ((1.0 - linearity) * root + linearity * line)
    return value * ((2.0 - linearity) * line + (linearity - 1.0) / (1.0 + max(share, -0.9)))


EFFECT = Effect(
    name="load_dependent_gain",
    sentence="The higher the load pressure, the less flow a given voltage lets through.",
    attachment=Attachment.INPUT,
    parameters=(
        Parameter(
            "per_load",
            Quantity.PER_LOAD,
            "relative loss of gain per load pressure above rest",
            -0.5,
            0.5,
            (0.01, 0.05, 0.2, -0.05),
        ),
        Parameter(
            "direction",
            Quantity.RATIO,
            "0: both directions lose, 1: one loses, the other wins",
            0.0,
            1.0,
            (0.0, 1.0),
            optional=True,
            tried_first=True,
            usual=(1.0,),
        ),
        Parameter(
            "linearity",
            Quantity.RATIO,
            "0: square root of the pressure drop, 1: straight line, 2: one over one and the loss, as of a droop",
            0.0,
            2.0,
            (0.0, 2.0),
            optional=True,
        ),
        Parameter(
            "base",
            Quantity.RATIO,
            "load pressure at which the gain is the nominal one, over the rest pressure",
            0.0,
            5.0,
            (0.0,),
            neutral=1.0,
            optional=True,
            usual=(0.0,),
        ),
        Parameter(
            "above",
            Quantity.RATIO,
            "1: only pressures above that count, as of a pump that delivers less from there on",
            0.0,
            1.0,
            (),
            optional=True,
            usual=(1.0,),
        ),
        Parameter(
            "growth",
            Quantity.PER_LOAD,
            "how much more each further load pressure costs than the first",
            -0.3,
            5.0,
            (0.5, 2.0),
            optional=True,
        ),
        Parameter(
            "lag_s",
            Quantity.TIME,
            "time constant with which the pressure drop follows the load, as a supply sags and recovers",
            0.0,
            4.0,
            (0.3,),
            optional=True,
        ),
        Parameter(
            "rounding_v",
            Quantity.INPUT,
            "voltage over which what one direction loses becomes what the other wins, as both edges of a spool leak",
            0.0,
            1.0,
            (0.1, 0.3),
            optional=True,
        ),
    ),
    step=_step,
    check="Measure speed at one voltage under several loads; compare supply pressure with load pressure.",
    source="Merritt, Hydraulic Control Systems (1967), 5.3: q = k x sqrt(ps - sign(x) pL)",
    state_size=1,
)
