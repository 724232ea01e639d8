"""Friction: dry friction holds the piston until the valve overcomes it."""

import math

from ...channels import Channel
from ..compiled import FREE_VELOCITY, LOAD_VELOCITY, VELOCITY_GAIN, Doubles, effect_step
from .effect import Attachment, Effect, Parameter, Quantity


@effect_step
def _step(p: Doubles, s: Doubles, value: float, c: Doubles) -> float:
    coulomb, static_excess, stribeck_velocity, asymmetry, load_share = p[0], p[1], p[2], p[3], p[4]
    gain = c[VELOCITY_GAIN]
    if gain == 0.0:
        return value
    velocity = c[FREE_VELOCITY] - (1.0 - load_share) * c[LOAD_VELOCITY]
    level = coulomb
    if static_excess != 0.0 and stribeck_velocity > 0.0:
        ratio = velocity / stribeck_velocity
        level += static_excess * math.exp(-ratio * ratio)
    level *= 1.0 + asymmetry if velocity > 0.0 else 1.0 - asymmetry
    # Implicit: exactly the force that would stop the piston within the sub-step, up to the friction level.
    needed = velocity / gain
    return value - min(max(needed, -level), level)


EFFECT = Effect(
    name="friction",
    sentence="Dry friction opposes motion and holds the piston still at small voltages and at reversals.",
    attachment=Attachment.STATE,
    parameters=(
        Parameter(
            "coulomb_v", Quantity.INPUT, "Coulomb friction, referred to the valve voltage", 0.0, 1.5, (0.03, 0.15, 0.5)
        ),
        Parameter(
            "static_excess_v",
            Quantity.INPUT,
            "static friction above Coulomb friction",
            0.0,
            1.0,
            (0.05,),
            optional=True,
        ),
        Parameter("stribeck_velocity", Quantity.VELOCITY, "Stribeck velocity", 0.0, 1.0, (0.05,), optional=True),
        Parameter(
            "asymmetry",
            Quantity.RATIO,
            "Coulomb friction forward above, backward below the mean",
            -0.9,
            0.9,
            (0.0,),
            optional=True,
        ),
        Parameter(
            "load_share",
            Quantity.RATIO,
            "1: holds against what the load pressure moves too, 0: only what the valve moves",
            0.0,
            1.0,
            (0.0,),
            neutral=1.0,
            optional=True,
        ),
    ),
    step=_step,
    check="Move slowly both ways and read the voltage needed at constant speed; look at seals, guides and alignment.",
    source="Armstrong-Helouvry et al., Automatica 30 (1994) 1083; stick by implicit Euler as Acary & Brogliato (2008)",
    channels=(Channel.POSITION,),
    sub_stepped=True,
)
