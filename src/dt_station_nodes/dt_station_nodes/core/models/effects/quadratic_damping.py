"""Quadratic damping: a resistance that grows with the square of the speed, as of turbulent flow."""

from ...channels import Channel
from ..compiled import FREE_VELOCITY, LOAD_VELOCITY, VELOCITY, VELOCITY_GAIN, Doubles, effect_step
from .effect import Attachment, Effect, Parameter, Quantity


@effect_step
def _step(p: Doubles, s: Doubles, value: float, c: Doubles) -> float:
    speed = 0.5 * (c[VELOCITY] + c[FREE_VELOCITY] - c[LOAD_VELOCITY])
    # What the drag itself does within the sub-step counts half: a step of Newton's from where it did nothing.
    half = 0.5 * c[VELOCITY_GAIN] * p[0]
    speed -= half * speed * abs(speed) / (1.0 + 2.0 * half * abs(speed))
    return value - p[0] * speed * abs(speed)


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
