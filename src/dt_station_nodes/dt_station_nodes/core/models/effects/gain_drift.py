"""Gain drift: the answer grows or fades over the run, as oil or a coil warms or with the work done, or at once."""

import math

from ...channels import Channel
from ..compiled import OUTPUT_REST, STAGE, SUBSTEP, TIME, Doubles, effect_step
from ..heat import by_heat
from ..onset import EVEN, come
from .effect import Attachment, Effect, Parameter, Quantity


@effect_step
def _step(p: Doubles, s: Doubles, value: float, c: Doubles) -> float:
    rate, settling, by_work = p[0], p[1], p[6]
    age = c[TIME] + by_work * (s[0] - c[TIME])
    s[0] += abs(value) * c[SUBSTEP]
    time = max(age - p[2], 0.0)
    more = 0.0
    if p[7] != 0.0 or p[9] != 0.0:
        more += p[7] * come(c, p[8], p[14], p[15]) + p[9] * come(c, p[10], 0.0, 0.0)
    if rate != 0.0:
        more += rate * (-settling * math.expm1(-time / settling) if settling > 0.0 else time)
    if p[3] != 0.0 or p[4] != 0.0:
        turn = 2.0 * math.pi * age / p[5] if p[5] > 0.0 else 0.0
        more += p[3] * math.sin(turn) + p[4] * math.cos(turn)
    if p[12] > 0.0:
        closer = -math.expm1(-c[SUBSTEP] / p[12])
        s[1] += (value * value - s[1]) * closer
        more += (1.0 + more) * (by_heat(p[11] * s[1], p[13]) - 1.0)
    # A sensor reads all of what it measures by its gain, the rest value too.
    all_of_it = value + c[OUTPUT_REST] if c[STAGE] == 2.0 else value
    return value + more * all_of_it


def _jump(which: str, meaning: str) -> tuple[Parameter, Parameter]:
    name = f"{which}jump"
    return (
        Parameter(name, Quantity.RATIO, meaning, -1.0, 2.0, (), optional=True, acts_alone=True),
        Parameter(f"{name}_s", Quantity.RUN_TIME, "time of the run at which it comes", 0.0, 3600.0, (), optional=True),
    )


EFFECT = Effect(
    name="gain_drift",
    sentence="The gain changes in the course of the run, slowly or at once.",
    attachment=Attachment.INPUT,
    parameters=(
        Parameter(
            "rate_per_s",
            Quantity.RUN_RATE,
            "relative change of the gain per second at the start",
            -0.5,
            0.5,
            (0.002, -0.002, 0.01, -0.01),
        ),
        Parameter(
            "settling_s",
            Quantity.RUN_TIME,
            "time constant with which the drift settles, 1e9 for never",
            1.0,
            600.0,
            (5.0, 30.0),
            neutral=1e9,
            optional=True,
        ),
        Parameter(
            "onset_s",
            Quantity.RUN_TIME,
            "time of the run at which it begins",
            0.0,
            3600.0,
            (0.0, 5.0, 15.0),
            optional=True,
        ),
        Parameter(
            "swing",
            Quantity.RATIO,
            "sine part of a slow swing of the gain",
            -1.0,
            1.0,
            (0.02,),
            optional=True,
            apart=True,
            acts_alone=True,
        ),
        Parameter(
            "swing_cosine",
            Quantity.RATIO,
            "cosine part of that swing",
            -1.0,
            1.0,
            (0.0,),
            optional=True,
            apart=True,
            acts_alone=True,
        ),
        Parameter(
            "period_s",
            Quantity.RUN_TIME,
            "period of that swing",
            15.0,
            600.0,
            (16.0, 60.0),
            neutral=30.0,
            optional=True,
            apart=True,
        ),
        Parameter(
            "by_work",
            Quantity.RATIO,
            "0: ages with time, 1: with the work done, a volt applied for a second counting as a second",
            0.0,
            1.0,
            (1.0,),
            optional=True,
            usual=(1.0,),
        ),
        *_jump("", "a step of the gain, as of a supply that drops: relative to the gain at the start"),
        *_jump("second_", "another step"),
        Parameter(
            "heat_per_v2",
            Quantity.PER_SIGNAL_SQUARED,
            "change of the gain's logarithm by heat, per square of the recent voltage: losses of a coil or a motor",
            -1.0,
            1.0,
            (),
            optional=True,
            acts_alone=True,
            at=Attachment.INPUT,
        ),
        Parameter(
            "heat_s",
            Quantity.RUN_TIME,
            "time constant of the heating, 0 for none: quicker is no heat",
            4.5,
            60.0,
            (),
            optional=True,
            at=Attachment.INPUT,
        ),
        Parameter(
            "heat_bend",
            Quantity.RATIO,
            "0: the gain goes exponentially with its heat, 1: along a line, -1: as one over a line",
            -1.0,
            1.0,
            (),
            optional=True,
            usual=(1.0, -1.0),
            at=Attachment.INPUT,
        ),
        Parameter(
            "jump_lag_s", Quantity.TIME, "time constant of the first step of the gain", 0.0, 3.0, (), optional=True
        ),
        Parameter("jump_even", Quantity.RATIO, EVEN, 0.0, 1.0, (), optional=True),
    ),
    step=_step,
    check="Repeat one step every minute from a cold start; log oil temperature and supply pressure; "
    "hold the sensor against another.",
    source="oil viscosity and temperature: Merritt (1967), 1.2; a coil or a motor warms by first order in its "
    "losses, which go with the square of what it is given",
    state_size=2,
    also={Channel.PRESSURE: (Attachment.OUTPUT,)},
)
