"""Bias: the valve's null is off zero."""

from ..compiled import Doubles, effect_step
from .effect import Attachment, Effect, Parameter, Quantity


@effect_step
def _step(p: Doubles, s: Doubles, value: float, c: Doubles) -> float:
    return value + p[0]


EFFECT = Effect(
    name="bias",
    sentence="A constant offset acts as if added to the voltage.",
    attachment=Attachment.INPUT,
    parameters=(Parameter("bias_v", Quantity.INPUT, "offset of the voltage", -1.0, 1.0, (0.02, -0.02)),),
    step=_step,
    check="Command zero and watch for drift; adjust the valve's null and the amplifier's offset.",
    source="servo-valve null shift: Merritt (1967), 7.3",
)
