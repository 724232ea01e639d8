"""Leakage: oil lost past the piston lets it creep under load; oil lost past a valve, its pressure fall."""

import math

from numba import njit

from ...channels import Channel
from ..compiled import (
    FREE_VELOCITY,
    INJECTION,
    INJECTION_GAIN,
    LOAD,
    LOAD_VELOCITY,
    OUTLET_RATE,
    OUTPUT_GAIN,
    OWN_LOAD,
    REST,
    SETTLING_RATE,
    STAGE,
    STATIC_GAIN,
    SUBSTEP,
    Doubles,
    effect_step,
    halfway,
)
from ..leak_flow import held_down, opened, through
from .effect import Attachment, Effect, Parameter, Quantity


@njit(cache=True)
def _way(velocity: float, flow: float, turning: float) -> float:
    """Which way a piston moves, -1 to 1; without a `turning` velocity a leak (m/s) stops it, but does not turn it."""
    if turning > 0.0:
        return math.tanh(velocity / turning)
    return velocity / max(abs(velocity), abs(flow)) if velocity != 0.0 else 0.0


@njit(cache=True)
def _bent(bend: float, y: float) -> float:
    """Factor by which a flow that is linear at first falls behind, as it turns turbulent."""
    return math.sqrt(1.0 + bend * abs(y)) if bend != 0.0 else 1.0


@effect_step
def _step(p: Doubles, s: Doubles, value: float, c: Doubles) -> float:
    if c[STAGE] == 2.0:
        s[0] = held_down(p, s[0], value, c)
        return value - s[0]
    base, sag, lag, bend = p[2], p[3], p[4], p[5]
    store = c[OUTLET_RATE] != 0.0 or c[STATIC_GAIN] == 0.0
    per_flow = c[INJECTION_GAIN] if store else c[OUTPUT_GAIN] / (c[STATIC_GAIN] * c[SETTLING_RATE])
    pressure = c[LOAD] + c[REST] * (1.0 - base)
    warmed = opened(p, c)
    made_up = p[7] * through(p, warmed, c[REST] * (1.0 - base), c[REST]) if p[7] != 0.0 else 0.0
    flow = through(p, warmed, pressure, c[REST]) - made_up
    if c[OWN_LOAD] > 0.0:
        # What is lost within the sub-step counts half.
        flow = through(p, warmed, pressure - 0.5 * per_flow * flow, c[REST]) - made_up
    if store and p[11] != 0.0:
        gape = p[13] * (halfway(c) - p[12])
        flow *= 1.0 - p[11] + p[11] * math.exp(-gape * gape)
    if store and p[9] != 0.0:
        flow *= 1.0 - p[9] + p[9] * _way(c[FREE_VELOCITY] - c[LOAD_VELOCITY], flow, p[10])
    if store and sag != 0.0:
        y = halfway(c) - 0.5 * per_flow * flow
        y /= 1.0 + 0.5 * per_flow * sag / _bent(bend, y)
        flow += sag * y / _bent(bend, y)
    if lag > 1e-6:
        h = c[SUBSTEP]
        gap = flow - s[0]
        passed = 1.0 - math.exp(-h / lag)
        s[0] += passed * gap
        # The mean over the sub-step.
        flow -= gap * passed * lag / h
    if not store:
        # No single store to lose it from: what is lost is taken off the voltage that would make it up.
        return value - flow / (c[STATIC_GAIN] * c[SETTLING_RATE])
    c[INJECTION] -= flow
    return value


EFFECT = Effect(
    name="leakage",
    sentence="Oil leaking past the piston or the valve lets it creep, or the pressure fall, the more the pressure.",
    attachment=Attachment.STATE,
    parameters=(
        Parameter(
            "coefficient",
            Quantity.VELOCITY_PER_LOAD,
            "creep per load pressure",
            -5.0,
            5.0,
            (0.002, 0.01, 0.05, 0.5, -0.02),
        ),
        Parameter(
            "turbulence",
            Quantity.RATIO,
            "0: laminar gap, 1: square-root orifice",
            0.0,
            1.0,
            (0.3, 1.0),
            optional=True,
            tried_first=True,
            usual=(1.0,),
        ),
        Parameter(
            "base",
            Quantity.RATIO,
            "pressure at which nothing leaks, over the rest pressure",
            0.0,
            5.0,
            (1.0,),
            optional=True,
            apart=True,
            usual=(1.0,),
            at=Attachment.STATE,
        ),
        Parameter(
            "sag_per_s",
            Quantity.RATE,
            "rate at which the output sags back to its rest under its own load",
            0.0,
            5.0,
            (0.0, 0.05, 0.3),
            optional=True,
            acts_alone=True,
            tried_first=True,
            at=Attachment.STATE,
        ),
        Parameter(
            "lag_s",
            Quantity.TIME,
            "time constant with which the leak moves the piston, or lowers the pressure, as the trapped oil gives way",
            0.0,
            4.0,
            (0.0, 0.04, 1.0),
            optional=True,
            apart=True,
        ),
        Parameter(
            "sag_bend",
            Quantity.PER_OUTPUT,
            "how soon the sag's flow is turbulent: above one over this it grows with the square root of the output",
            0.0,
            100.0,
            (30.0,),
            optional=True,
            channels=(Channel.POSITION,),
        ),
        Parameter(
            "widening",
            Quantity.PER_LOAD,
            "how much wider the pressure makes the gap it leaks through, whose flow goes with the cube of its height; "
            "below 0: how much it seats the lip that seals it",
            -0.4,
            1.0,
            (0.3, -0.1),
            optional=True,
        ),
        Parameter(
            "made_up",
            Quantity.RATIO,
            "share of what leaks at rest that the voltage makes up for already",
            0.0,
            1.0,
            (1.0,),
            optional=True,
            usual=(1.0,),
        ),
        Parameter(
            "warming_per_s",
            Quantity.RUN_RATE,
            "how much more leaks with every second, as the oil warms and thins",
            -0.02,
            0.2,
            (0.0,),
            optional=True,
        ),
        Parameter(
            "against",
            Quantity.RATIO,
            "1: the load pressure comes of the motion and the leak slows it either way, 0: the load pushes one way",
            0.0,
            1.0,
            (),
            optional=True,
            first_on=(Channel.POSITION,),
            usual=(1.0,),
        ),
        Parameter(
            "turning",
            Quantity.VELOCITY,
            "velocity over which such a load turns with the motion",
            0.0,
            1.0,
            (0.05,),
            optional=True,
            channels=(Channel.POSITION,),
        ),
        Parameter(
            "worn",
            Quantity.RATIO,
            "share of the leak that is there about a worn place of the bore only",
            0.0,
            1.0,
            (),
            optional=True,
            channels=(Channel.POSITION,),
        ),
        Parameter(
            "worn_at",
            Quantity.OUTPUT,
            "that place, along the stroke",
            -2.0,
            2.0,
            (),
            optional=True,
            channels=(Channel.POSITION,),
        ),
        Parameter(
            "worn_bend",
            Quantity.PER_OUTPUT,
            "how soon the wear ends to either side of it: one over the way in which it falls to a third",
            0.0,
            20.0,
            (),
            optional=True,
            channels=(Channel.POSITION,),
        ),
        Parameter(
            "opens",
            Quantity.RATIO,
            "1: it leaks above that pressure only, past a seal that gives way there",
            0.0,
            1.0,
            (0.0, 1.0),
            optional=True,
            channels=(Channel.POSITION,),
            usual=(1.0,),
        ),
    ),
    step=_step,
    check="Block the valve, load the piston and watch it creep; look at piston seals and the valve's leakage flow.",
    source="Merritt, Hydraulic Control Systems (1967), 2.2 and 6.2: laminar leakage coefficient, flow through a gap",
    state_size=1,
    sub_stepped=True,
    also={Channel.PRESSURE: (Attachment.OUTPUT,)},
)
