"""Friction: dry friction holds the piston until the valve overcomes it."""

import math

from numba import njit

from ...channels import Channel
from ..compiled import FREE_VELOCITY, LOAD_VELOCITY, SUBSTEP, VELOCITY_GAIN, Doubles, effect_step
from .effect import Attachment, Effect, Parameter, Quantity


@njit(cache=True)
def _slipping(velocity: float, pull: float, slip: float) -> float:
    """Velocity v with v + pull tanh(v / slip) = velocity: Newton from rest, which a concave curve never overshoots."""
    found = 0.0
    for _ in range(12):
        bent = math.tanh(found / slip)
        change = (abs(velocity) - found - pull * bent) / (1.0 + pull / slip * (1.0 - bent * bent))
        found += change
        if change < 1e-6 * slip:
            break
    return math.copysign(found, velocity)


@effect_step
def _step(p: Doubles, s: Doubles, value: float, c: Doubles) -> float:
    coulomb, static_excess, stribeck_velocity, asymmetry = p[0], p[1], p[2], p[3]
    load_share, presliding, slip = p[4], p[5], p[6]
    gain = c[VELOCITY_GAIN]
    if gain == 0.0:
        return value
    velocity = c[FREE_VELOCITY] - (1.0 - load_share) * c[LOAD_VELOCITY]
    level = coulomb
    if static_excess != 0.0 and stribeck_velocity > 0.0:
        ratio = velocity / stribeck_velocity
        level += static_excess * math.exp(-ratio * ratio)
    level *= 1.0 + asymmetry if velocity > 0.0 else 1.0 - asymmetry
    if presliding > 0.0:
        # Bristle z' = v - |v| z / presliding, force level z / presliding, both at the sub-step's end: a quadratic in v.
        h = c[SUBSTEP]
        z = s[0]
        pull = gain * level
        sign = 1.0 if velocity * presliding - pull * z > 0.0 else -1.0
        b = presliding + pull * h - sign * velocity * h
        q = sign * (velocity * presliding - pull * z)
        root = math.sqrt(max(b * b + 4.0 * h * q, 0.0))
        speed = 2.0 * q / (b + root) if b > 0.0 else (root - b) / (2.0 * h)
        s[0] = (z + h * sign * speed) / (1.0 + h * speed / presliding)
        return value - level * s[0] / presliding
    if slip > 0.0:
        return value - level * math.tanh(_slipping(velocity, gain * level, slip) / slip)
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
            (0.0, 0.05),
            optional=True,
        ),
        Parameter("stribeck_velocity", Quantity.VELOCITY, "Stribeck velocity", 0.0, 0.3, (0.05,), optional=True),
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
            (0.0, 1.0),
            neutral=1.0,
            optional=True,
        ),
        Parameter(
            "presliding",
            Quantity.OUTPUT,
            "way over which the contact's bristles bend before it slides",
            0.0,
            0.1,
            (0.0, 0.003),
            optional=True,
        ),
        Parameter(
            "slip_velocity",
            Quantity.VELOCITY,
            "velocity at which the contact slips: below it creeps, where no bristles hold it; 0: it sticks",
            0.0,
            0.1,
            (0.03,),
            optional=True,
        ),
    ),
    step=_step,
    check="Move slowly both ways and read the voltage needed at constant speed; look at seals, guides and alignment.",
    source="Armstrong-Helouvry et al., Automatica 30 (1994) 1083; stick by implicit Euler; Dahl bristle (1968)",
    state_size=1,
    channels=(Channel.POSITION,),
    sub_stepped=True,
)
