"""Overflow: the stored quantity cannot rise beyond a limit; what comes on top is lost."""

from ..compiled import FREE_OUTPUT, INJECTION, INJECTION_GAIN, Doubles, effect_step
from .effect import Attachment, Effect, Parameter, Quantity


@effect_step
def _step(p: Doubles, s: Doubles, value: float, c: Doubles) -> float:
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
    ),
    step=_step,
    check="See whether the output stands at one value while the input still rises; look for spill edges.",
    source="Schoukens & Noel, cascaded tanks benchmark (2016)",
    sub_stepped=True,
)
