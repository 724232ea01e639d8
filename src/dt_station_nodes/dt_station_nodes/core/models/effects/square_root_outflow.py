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


@njit(cache=True)
def _missing(level: float, reference: float, curvature: float, empty: float) -> float:
    """The same of a level above rest, as a level; of a store `empty` at rest less what it would be there."""
    return _shortfall(level - reference, curvature) - empty * _shortfall(-reference, curvature)


@effect_step
def _step(p: Doubles, s: Doubles, value: float, c: Doubles) -> float:
    curvature, reference, inlet_curvature, empty = p[0], p[1], p[2], p[3]
    if curvature > 0.0:
        level = halfway(c)
        # What stays behind counts half within the sub-step: a step of Newton's from where nothing did.
        half = 0.5 * c[INJECTION_GAIN] * c[OUTLET_RATE]
        slope = 1.0 - 1.0 / math.sqrt(max(1.0 + 2.0 * curvature * (level - reference), 1e-6))
        level += half * _missing(level, reference, curvature, empty) / max(1.0 - half * slope, 0.5)
        c[INJECTION] += c[OUTLET_RATE] * _missing(level, reference, curvature, empty)
    if inlet_curvature > 0.0 and c[INLET_RATE] > 0.0 and c[OUTLET_RATE] > 0.0:
        # The store before, as the output level it keeps up: what does not leave it stays there and is missed here.
        held = halfway(c) + 0.5 * (c[VELOCITY] + c[FREE_VELOCITY]) / c[OUTLET_RATE]
        missing = _missing(held, reference, inlet_curvature, empty)
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
        Parameter(
            "empty",
            Quantity.RATIO,
            "1: nothing flows out at rest, 0: what the linear path lets out at the reference flows out there",
            0.0,
            1.0,
            (1.0,),
            optional=True,
            usual=(1.0,),
        ),
    ),
    step=_step,
    check="Let the store empty by itself: the level falls along a parabola, not along an exponential.",
    source="Torricelli's law; Schoukens & Noel, cascaded tanks benchmark (2016)",
    sub_stepped=True,
)
