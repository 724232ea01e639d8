"""Square-root outflow: a store empties with the square root of its level, not in proportion to it."""

import math

from ..compiled import INJECTION, OUTLET_RATE, OUTPUT, Doubles, effect_step
from .effect import Attachment, Effect, Parameter, Quantity


@effect_step
def _step(p: Doubles, s: Doubles, value: float, c: Doubles) -> float:
    curvature, reference = p[0], p[1]
    if curvature > 0.0:
        level = c[OUTPUT] - reference
        # Same outflow and slope as the linear path's at the reference level: k sqrt(level - datum) beside level.
        root = (math.sqrt(max(1.0 + 2.0 * curvature * level, 0.0)) - 1.0) / curvature
        c[INJECTION] += c[OUTLET_RATE] * (level - root)
    return value


EFFECT = Effect(
    name="square_root_outflow",
    sentence="The output's store empties with the square root of its level.",
    attachment=Attachment.STATE,
    parameters=(
        Parameter("curvature", Quantity.PER_OUTPUT, "bend of the outflow over the level", 0.0, 20.0, (0.3, 1.0, 3.0)),
        Parameter(
            "reference",
            Quantity.OUTPUT,
            "level above rest at which outflow and its slope are the linear path's",
            -3.0,
            3.0,
            (0.4, 0.6, 0.8),
        ),
    ),
    step=_step,
    check="Let the store empty by itself: the level falls along a parabola, not along an exponential.",
    source="Torricelli's law; Schoukens & Noel, cascaded tanks benchmark (2016)",
    sub_stepped=True,
)
