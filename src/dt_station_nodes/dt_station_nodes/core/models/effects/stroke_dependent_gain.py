"""Stroke-dependent gain: how strongly the voltage acts depends on where the output stands."""

from numba import njit

from ...channels import Channel
from ..compiled import OUTPUT_GAIN, Doubles, effect_step, halfway
from .effect import Attachment, Effect, Parameter, Quantity


@njit(cache=True)
def _gain(p: Doubles, y: float) -> float:
    return max(1.0 + y * (p[0] + y * (p[1] + y * p[2])), 0.02)


@effect_step
def _step(p: Doubles, s: Doubles, value: float, c: Doubles) -> float:
    y = halfway(c)
    return value * _gain(p, y + 0.5 * c[OUTPUT_GAIN] * value * (_gain(p, y) - 1.0))


EFFECT = Effect(
    name="stroke_dependent_gain",
    sentence="The same voltage moves the output faster in one place than in another.",
    attachment=Attachment.STATE,
    parameters=(
        Parameter("slope", Quantity.PER_OUTPUT, "relative change of gain per output", -3.0, 3.0, (0.1, -0.1)),
        Parameter(
            "curvature", Quantity.PER_OUTPUT_SQUARED, "its change per output squared", -3.0, 3.0, (0.0, 0.2, -0.2)
        ),
        Parameter("third", Quantity.PER_OUTPUT_CUBED, "its cubic term", -3.0, 3.0, (0.1,), optional=True),
    ),
    step=_step,
    check="Repeat one small step at several places along the stroke; look at trapped volumes and the linkage's lever.",
    source="polynomial in the stroke; chamber volumes: Merritt (1967), 6.2",
    channels=(Channel.POSITION,),
    vocabulary=False,
)
