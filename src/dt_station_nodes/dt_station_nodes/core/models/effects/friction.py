"""Friction: dry friction holds the piston until the valve overcomes it, or a pressure valve's spool until it slips."""

from ...channels import Channel
from ..compiled import (
    FREE_VELOCITY,
    INJECTION,
    LOAD,
    LOAD_VELOCITY,
    OWN_LOAD,
    STATIC_GAIN,
    SUBSTEP,
    VELOCITY_GAIN,
    Doubles,
    effect_step,
)
from ..piston import held_back
from ..spool import spool_at
from .effect import Attachment, Effect, Parameter, Quantity

_PISTON, _SPOOL = (Channel.POSITION,), (Channel.PRESSURE,)


@effect_step
def _step(p: Doubles, s: Doubles, value: float, c: Doubles) -> float:
    if c[OWN_LOAD] > 0.0:
        per_unit = 1.0 / c[STATIC_GAIN] if c[STATIC_GAIN] > 0.0 else 0.0
        return spool_at(p, s, value, c[SUBSTEP], per_unit)
    gain = c[VELOCITY_GAIN]
    if gain == 0.0:
        return value
    # What a cylinder loses or is given moves its piston as well, past the path's own velocity.
    velocity = c[FREE_VELOCITY] + c[INJECTION] - (1.0 - p[4]) * c[LOAD_VELOCITY]
    held = held_back(p, s, velocity, 1.0 + p[10] * max(c[LOAD], 0.0), gain, c[SUBSTEP])
    s[2] = velocity - gain * held
    return value - held


EFFECT = Effect(
    name="friction",
    sentence="Dry friction holds the piston, or the spool of a pressure valve, until the voltage overcomes it.",
    attachment=Attachment.STATE,
    parameters=(
        Parameter(
            "coulomb_v",
            Quantity.INPUT,
            "Coulomb friction, referred to the valve voltage; of a spool, what makes it slip",
            0.0,
            1.5,
            (0.03, 0.15, 0.5),
            grain=0.005,
            in_stairs=_SPOOL,
        ),
        Parameter(
            "static_excess_v",
            Quantity.INPUT,
            "static friction above Coulomb friction; of a spool on bristles too, where they grip (its own form)",
            0.0,
            1.0,
            (0.0, 0.05),
            optional=True,
            channels=_PISTON,
        ),
        Parameter(
            "stribeck_velocity",
            Quantity.VELOCITY,
            "Stribeck velocity; one near the run's speed would be a drag that falls",
            0.0,
            0.5,
            (0.05,),
            optional=True,
            channels=_PISTON,
        ),
        Parameter(
            "asymmetry",
            Quantity.RATIO,
            "Coulomb friction forward above, backward below the mean",
            -0.9,
            0.9,
            (0.0,),
            optional=True,
            channels=_PISTON,
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
            channels=_PISTON,
        ),
        Parameter(
            "presliding",
            Quantity.OUTPUT,
            "way over which the contact's bristles bend before it slides, of a spool as the pressure that it calls for",
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
            channels=_PISTON,
        ),
        Parameter(
            "slip",
            Quantity.RATIO,
            "share of what makes a spool slip that it has slipped when it sticks again",
            0.0,
            1.0,
            (0.5, 0.8),
            optional=True,
            apart=True,
            grain=0.02,
            channels=_SPOOL,
        ),
        Parameter(
            "slide_s",
            Quantity.TIME,
            "time constant with which it slides, as oil damps it",
            0.0,
            0.3,
            (0.01, 0.03),
            optional=True,
            channels=_SPOOL,
        ),
        Parameter(
            "slides_on",
            Quantity.RATIO,
            "0: it sticks again after each slip, 1: it slides on until the voltage turns back",
            0.0,
            1.0,
            (0.0, 1.0),
            optional=True,
            apart=True,
            usual=(1.0,),
            channels=_SPOOL,
        ),
        Parameter(
            "per_load",
            Quantity.PER_LOAD,
            "share by which the load pressure raises Coulomb friction, as it presses the seals on",
            0.0,
            5.0,
            (0.3,),
            optional=True,
            channels=_PISTON,
        ),
        Parameter(
            "damping_s",
            Quantity.TIME,
            "damping of the bristles over their stiffness",
            0.0,
            0.3,
            (0.03,),
            optional=True,
            channels=_PISTON,
        ),
        Parameter(
            "creep_velocity",
            Quantity.VELOCITY,
            "velocity of the pressure at which a spool's oil film gives: slower, it creeps; 0: it sticks",
            0.0,
            1.0,
            (0.03, 0.15),
            optional=True,
            channels=_SPOOL,
        ),
        # With none a spool's grip says nothing, and no fit leaves there.
        Parameter(
            "spool_stribeck_velocity",
            Quantity.VELOCITY,
            "Stribeck velocity of a spool on bristles, as that of the pressure that it calls for",
            0.05,
            10.0,
            (),
            optional=True,
            channels=_SPOOL,
        ),
        Parameter(
            "elastic",
            Quantity.RATIO,
            "share of what a spool's bristles hold up to which they only bend",
            0.0,
            0.95,
            (),
            optional=True,
            channels=_SPOOL,
        ),
        Parameter(
            "swing_s",
            Quantity.TIME,
            "one over the natural frequency (rad/s) of a spool with mass on its spring; 0: it has none",
            0.0,
            0.05,
            (),
            optional=True,
            channels=_SPOOL,
        ),
        Parameter(
            "swing_damping",
            Quantity.RATIO,
            "its damping ratio, friction apart",
            0.05,
            3.0,
            (),
            neutral=0.7,
            optional=True,
            channels=_SPOOL,
        ),
    ),
    step=_step,
    check="Move slowly both ways and read the voltage needed at constant speed; look at seals, guides and dither.",
    source="Armstrong-Helouvry et al., Automatica 30 (1994) 1083; stick by implicit Euler; Dahl bristle (1968), "
    "damped: Canudas de Wit et al., IEEE Trans. Autom. Control 40 (1995) 419; "
    "elastic at first: Dupont et al., IEEE Trans. Autom. Control 47 (2002) 787; "
    "He et al., Ind. Eng. Chem. Res. 46 (2007) 8741 and Kano et al., ADCHEM (2003): valve stiction",
    state_size=4,
    sub_stepped=True,
    feels_all_on=_PISTON,
)
