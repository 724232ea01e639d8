"""Square-root outflow: a store empties with the square root of its level, not in proportion to it."""

import math

from numba import njit

from ..compiled import (
    FREE_VELOCITY,
    INJECTION,
    INJECTION_GAIN,
    INLET_RATE,
    OUTLET_RATE,
    STATIC_GAIN,
    VELOCITY,
    Doubles,
    effect_step,
    halfway,
)
from .effect import Attachment, Effect, Parameter, Quantity


@njit(cache=True)
def _shortfall(level: float, curvature: float) -> float:
    """Linear outflow less that with the square root, both in levels: same value and slope at level 0."""
    return level - (math.sqrt(max(1.0 + 2.0 * curvature * level, 0.0)) - 1.0) / curvature


@effect_step
def _step(p: Doubles, s: Doubles, value: float, c: Doubles) -> float:
    curvature, reference, inlet_curvature = p[0], p[1], p[2]
    if curvature > 0.0:
        level = halfway(c) - reference
        # What stays behind counts half within the sub-step: a step of Newton's from where nothing did.
        half = 0.5 * c[INJECTION_GAIN] * c[OUTLET_RATE]
        slope = 1.0 - 1.0 / math.sqrt(max(1.0 + 2.0 * curvature * level, 1e-6))
        level += half * _shortfall(level, curvature) / max(1.0 - half * slope, 0.5)
        c[INJECTION] += c[OUTLET_RATE] * _shortfall(level, curvature)
    if inlet_curvature > 0.0 and c[INLET_RATE] > 0.0 and c[OUTLET_RATE] > 0.0:
        # The store before, as the output level it keeps up: what does not leave it stays there and is missed here.
        held = halfway(c) + 0.5 * (c[VELOCITY] + c[FREE_VELOCITY]) / c[OUTLET_RATE]
        missing = _shortfall(held - reference, inlet_curvature)
        value += missing / c[STATIC_GAIN]
        c[INJECTION] -= c[OUTLET_RATE] * missing
    return value


EFFECT = Effect(
    name="square_root_outflow",
    sentence="A store empties with the square root of its level.",
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
        Parameter(
            "inlet_curvature",
            Quantity.PER_OUTPUT,
            "the same bend of the store before the output's, where the path is two stores",
            0.0,
            20.0,
            (0.3, 1.5),
            optional=True,
        ),
    ),
    step=_step,
    check="Let the store empty by itself: the level falls along a parabola, not along an exponential.",
    source="Torricelli's law; Schoukens & Noel, cascaded tanks benchmark (2016)",
    sub_stepped=True,
)
