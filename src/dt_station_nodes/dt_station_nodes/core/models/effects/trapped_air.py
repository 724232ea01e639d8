"""Trapped air: the oil is soft at low pressure, so the answer is slow there and quick at high pressure."""

import math

from ...channels import Channel
from ..compiled import STAGE, SUBSTEP, Doubles, effect_step, halfway
from .effect import Attachment, Effect, Parameter, Quantity


@effect_step
def _step(p: Doubles, s: Doubles, value: float, c: Doubles) -> float:
    softness, stiffening, power = p[0], p[1], p[2]
    if s[1] == 0.0:
        s[1] = 1.0
        s[0] = value
    # In the line to the sensor what counts is the pressure there.
    level = s[0] + p[3] * (value - s[0]) if c[STAGE] > 1.5 else halfway(c)
    tau = softness / (1.0 + stiffening * max(level, 0.0)) ** power
    if tau <= 1e-9:
        s[0] = value
        return value
    ratio = c[SUBSTEP] / tau
    left = math.exp(-ratio)
    before = s[0]
    s[0] = value + (before - value) * left
    return value + (before - value) * (1.0 - left) / ratio


EFFECT = Effect(
    name="trapped_air",
    sentence="The answer is slow at low pressure or short stroke and quick at high, as of oil with air in it.",
    attachment=Attachment.STATE,
    parameters=(
        Parameter("softness_s", Quantity.TIME, "time constant at rest", 0.0, 2.0, (0.03, 0.15, 0.8)),
        Parameter(
            "stiffening", Quantity.PER_OUTPUT, "how fast it shortens with the output", 0.0, 50.0, (1.0, 5.0, 20.0)
        ),
        Parameter("power", Quantity.RATIO, "exponent of the shortening", 1.0, 3.0, (2.0,), neutral=1.0, optional=True),
        Parameter(
            "ahead",
            Quantity.RATIO,
            "share of the pressure ahead of a line to the sensor, not in it, in what stiffens the air there",
            0.0,
            1.0,
            (1.0,),
            optional=True,
            channels=(Channel.PRESSURE,),
            at=Attachment.OUTPUT,
        ),
    ),
    step=_step,
    check="Bleed the circuit and repeat; compare rise times of small steps at low and at high pressure.",
    source="effective bulk modulus with entrained air: Merritt (1967), 1.4",
    state_size=2,
    sub_stepped=True,
    only_paces=True,
    also={Channel.PRESSURE: (Attachment.OUTPUT,)},
    vocabulary=False,
    special_cases={"extra_lag": ""},
)
