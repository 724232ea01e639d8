"""Overflow: the stored quantity cannot rise beyond a limit; what comes on top is lost."""

import math

from numba import njit

from ..compiled import FREE_OUTPUT, INJECTION, INJECTION_GAIN, STAGE, Doubles, effect_step
from .effect import Attachment, Effect, Parameter, Quantity


@njit(cache=True)
def _below(value: float, limit: float, rounding: float) -> float:
    """The value kept below the limit, its corner rounded."""
    if rounding <= 1e-12:
        return min(value, limit)
    over = (value - limit) / rounding
    return value - rounding * (over if over > 30.0 else math.log1p(math.exp(over)))


@effect_step
def _step(p: Doubles, s: Doubles, value: float, c: Doubles) -> float:
    if c[STAGE] > 1.5:
        return _below(value, p[0], p[1])
    excess = c[FREE_OUTPUT] - p[0]
    if excess > 0.0 and c[INJECTION_GAIN] > 0.0:
        c[INJECTION] -= excess / c[INJECTION_GAIN]
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
    ),
    step=_step,
    check="See whether the output stands at one value while the input still rises; look for spill edges.",
    source="Schoukens & Noel, cascaded tanks benchmark (2016)",
    sub_stepped=True,
    also=(Attachment.OUTPUT,),
)
