"""What dry friction takes from a piston: a contact that sticks, creeps or bends its bristles."""

import math

from numba import njit

from .compiled import Doubles
from .spool import gripped, slipping


@njit(cache=True)
def held_back(p: Doubles, s: Doubles, velocity: float, pressed: float, gain: float, h: float) -> float:
    """Voltage (V) that a contact takes from a piston which would otherwise have this velocity after the sub-step.

    `pressed`: how many times as hard the load pressure presses its seals on as none.
    """
    coulomb, static_excess, stribeck_velocity, asymmetry = p[0], p[1], p[2], p[3]
    presliding, slip, resisting = p[5], p[6], p[11] / h
    level = coulomb * pressed
    if static_excess != 0.0 and stribeck_velocity > 0.0:
        # Of the velocity that it has: one that stands is held by all of it, whatever would move it.
        level += gripped(static_excess, s[2], stribeck_velocity)
    level *= 1.0 + asymmetry if velocity > 0.0 else 1.0 - asymmetry
    if presliding > 0.0:
        # Bristle z' = v - |v| z / presliding, force level (z + damping_s z') / presliding, both at the sub-step's end:
        # a quadratic in v.
        z = s[0]
        pull = gain * level * (1.0 + resisting)
        velocity += gain * level * resisting * z / presliding
        sign = 1.0 if velocity * presliding - pull * z > 0.0 else -1.0
        b = presliding + pull * h - sign * velocity * h
        q = sign * (velocity * presliding - pull * z)
        root = math.sqrt(max(b * b + 4.0 * h * q, 0.0))
        speed = 2.0 * q / (b + root) if b > 0.0 else (root - b) / (2.0 * h)
        s[0] = (z + h * sign * speed) / (1.0 + h * speed / presliding)
        return level * (s[0] + resisting * (s[0] - z)) / presliding
    if slip > 0.0:
        return level * math.tanh(slipping(velocity, gain * level, slip) / slip)
    # Implicit: exactly the force that would stop the piston within the sub-step, up to the friction level.
    return min(max(velocity / gain, -level), level)
