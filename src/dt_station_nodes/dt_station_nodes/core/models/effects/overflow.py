"""Overflow: a store stops at its rim; what comes on top is lost, let off by a valve, or spills into the next store."""

import math

from ...channels import Channel
from ..compiled import (
    INJECTION,
    INJECTION_GAIN,
    INLET_RATE,
    OUTLET_RATE,
    OUTPUT,
    STAGE,
    STATIC_GAIN,
    SUBSTEP,
    VELOCITY,
    Doubles,
    effect_step,
)
from ..relief import let_off, relieved
from ..stops import cushioned, kept, throttled
from .effect import Attachment, Effect, Parameter, Quantity, on_both


@effect_step
def _step(p: Doubles, s: Doubles, value: float, c: Doubles) -> float:
    inlet_limit, spill = p[2], p[3]
    if c[STAGE] > 1.5:
        return relieved(p, s, value, c[SUBSTEP])
    if c[INLET_RATE] > 0.0 and c[OUTLET_RATE] > 0.0:
        # What the store before holds, as the output level it would keep up: it drives the output's velocity.
        held = c[OUTPUT] + c[VELOCITY] / c[OUTLET_RATE]
        left = math.exp(-c[SUBSTEP] * c[INLET_RATE])
        content = held * left + c[STATIC_GAIN] * value * (1.0 - left)
        lost = max(content - inlet_limit, 0.0) / (1.0 - left)
        # That store must end at its rim: it gets only the inflow that takes it there.
        value -= lost / c[STATIC_GAIN]
        c[INJECTION] += spill * lost * c[OUTLET_RATE]
    if c[OUTLET_RATE] == 0.0 and c[STATIC_GAIN] != 0.0 and p[10] == 0.0:
        # No store at all: what a valve lets off is missing from what feeds the path.
        return let_off(p, s, value, c)
    if c[OUTLET_RATE] == 0.0 and p[15] > 0.0:
        return cushioned(p, value, c)
    if p[16] > 0.0:
        return throttled(p, value, c)
    if c[INJECTION_GAIN] > 0.0:
        value = kept(p, value, c)
    return value


EFFECT = Effect(
    name="overflow",
    sentence="The stored quantity stops at a limit and what comes on top is lost.",
    attachment=Attachment.STATE,
    parameters=(
        Parameter("limit", Quantity.OUTPUT, "highest level above rest", 0.1, 3.0, (0.7, 0.9, 1.0), neutral=1e12),
        Parameter(
            "rounding",
            Quantity.OUTPUT,
            "level over which the limit is rounded, at the output only",
            0.0,
            0.3,
            (0.02,),
            optional=True,
        ),
        Parameter(
            "inlet_limit",
            Quantity.OUTPUT,
            "rim of the store before the output's, as the output level above rest that it can keep up",
            0.1,
            3.0,
            (0.5, 0.7, 0.85, 0.95, 1.05),
            neutral=1e12,
            optional=True,
            acts_alone=True,
        ),
        Parameter(
            "spill",
            Quantity.RATIO,
            "share of that store's spill that falls into the output's store",
            0.0,
            1.0,
            (0.3,),
            optional=True,
        ),
        Parameter(
            "weir_s",
            Quantity.TIME,
            "time in which what stands above the limit, were it as high as the limit, runs off; 0: at once, or never "
            "where no store holds it",
            0.0,
            10.0,
            (0.0, 0.05),
            optional=True,
            tried_first=True,
        ),
        Parameter(
            "weir_exponent",
            Quantity.RATIO,
            "exponent of that height, 1.5 for a weir, 0.5 for an orifice",
            0.5,
            2.5,
            (1.3,),
            neutral=1.0,
            optional=True,
        ),
        Parameter(
            "override",
            Quantity.RATIO,
            "share of what comes on top that still raises the output, as a relief valve's; at the output only",
            0.0,
            0.9,
            (0.0, 0.1),
            optional=True,
            at=Attachment.OUTPUT,
        ),
        Parameter(
            "opening_s",
            Quantity.TIME,
            "time constant with which a relief valve opens and closes; at the output or of a path without a store",
            0.0,
            0.5,
            (0.02,),
            optional=True,
        ),
        Parameter(
            "reseat",
            Quantity.OUTPUT,
            "how far below the limit a relief valve that is open closes again; at the output only",
            0.0,
            0.5,
            (0.1,),
            optional=True,
            at=Attachment.OUTPUT,
        ),
        Parameter(
            "lower_limit",
            Quantity.OUTPUT,
            "lowest level above rest, where a piston's way has two ends; inside the path only",
            -3.0,
            2.0,
            (-1.0, -0.85, -0.6),
            neutral=-1e12,
            optional=True,
            apart=True,
        ),
        Parameter(
            "standing",
            Quantity.RATIO,
            "1: a piston stands still at its end, 0: what drives it runs on; inside the path of a moving mass only",
            0.0,
            1.0,
            (0.0, 1.0),
            optional=True,
            tried_first=True,
            apart=True,
            usual=(1.0,),
        ),
        Parameter(
            "stiffness",
            Quantity.INPUT_PER_OUTPUT,
            "voltage that presses an end in by so much; inside the path only",
            5.0,
            1000.0,
            (40.0,),
            neutral=1e12,
            optional=True,
        ),
        Parameter(
            "load_share",
            Quantity.RATIO,
            "1: the limits hold what the load moves too, 0: only what the valve moves; inside the path only",
            0.0,
            1.0,
            (0.0,),
            neutral=1.0,
            optional=True,
            usual=(0.0,),
        ),
        Parameter(
            "override_exponent",
            Quantity.RATIO,
            "how override grows with what comes on top, its share being that of as much as the limit: 0.5 as of an "
            "orifice; at the output only",
            0.3,
            1.5,
            (0.5,),
            neutral=1.0,
            optional=True,
            channels=(Channel.PRESSURE,),
            at=Attachment.OUTPUT,
        ),
        Parameter(
            "closing_s",
            Quantity.TIME,
            "time constant with which the output recovers once a relief valve is shut; 0: that with which it opens",
            0.0,
            2.0,
            (0.1,),
            optional=True,
            channels=(Channel.PRESSURE,),
            at=Attachment.OUTPUT,
        ),
        Parameter(
            "cushion_s",
            Quantity.TIME,
            "an end that is a spring and a damper: the damper's over the spring's; inside a moving mass's path only",
            0.0,
            0.5,
            (0.008, 0.03),
            optional=True,
            channels=(Channel.POSITION,),
        ),
        Parameter(
            "throttling",
            Quantity.OUTPUT,
            "way past an end over which the port that feeds the motion closes, and what comes on top spills",
            0.0,
            0.5,
            (0.03,),
            optional=True,
            channels=(Channel.POSITION,),
        ),
        Parameter(
            "relieved",
            Quantity.RATIO,
            "1: a relief valve opens and closes by the pressure that it leaves, 0: by that without it",
            0.0,
            1.0,
            (),
            optional=True,
            channels=(Channel.PRESSURE,),
            at=Attachment.OUTPUT,
            usual=(1.0,),
        ),
    ),
    step=_step,
    state_size=2,
    check="See whether the output stands at one value while the input still rises; look for spill edges.",
    source="Schoukens & Noel, cascaded tanks benchmark (2016); reseating pressure: ISO 4126-1, safety valves",
    sub_stepped=True,
    between=("lower_limit", "limit"),
    also=on_both(Attachment.OUTPUT),
)
