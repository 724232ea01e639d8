"""Quadratic damping: a resistance that grows with the square of the speed, as of turbulent flow."""

from ...channels import Channel
from ..compiled import VELOCITY, Doubles, effect_step
from .effect import Attachment, Effect, Parameter, Quantity


@effect_step
def _step(p: Doubles, s: Doubles, value: float, c: Doubles) -> float:
    return value - p[0] * c[VELOCITY] * abs(c[VELOCITY])


EFFECT = Effect(
    name="quadratic_damping",
    sentence="The faster it moves, the more of the voltage its own resistance takes.",
    attachment=Attachment.STATE,
    parameters=(
        Parameter(
            "coefficient",
            Quantity.INPUT_PER_VELOCITY_SQUARED,
            "voltage needed per square of the speed",
            0.0,
            5.0,
            (0.05, 0.5),
        ),
    ),
    step=_step,
    channels=(Channel.POSITION,),
    check="Plot steady speed against voltage: it rises ever less, without a limit; look for narrow lines and fittings.",
    source="turbulent orifice and line losses: Merritt (1967), 3.2",
    sub_stepped=True,
    vocabulary=False,
)
