"""Hysteresis: the valve's magnetisation remembers the way the voltage came."""

from ..compiled import Doubles, effect_step
from .effect import Attachment, Effect, Parameter, Quantity


@effect_step
def _step(p: Doubles, s: Doubles, value: float, c: Doubles) -> float:
    half_width, spread = p[0], p[1]
    if s[5] == 0.0:
        s[5] = 1.0
        for j in range(5):
            s[j] = value
    s[0] = min(max(s[0], value - half_width), value + half_width)
    if spread <= 0.0:
        return s[0]
    total = 0.0
    for j in range(1, 5):
        radius = half_width * 0.5 * j
        s[j] = min(max(s[j], value - radius), value + radius)
        total += s[j]
    return (1.0 - spread) * s[0] + spread * total / 4.0


EFFECT = Effect(
    name="hysteresis",
    sentence="The valve's answer to a voltage depends on whether the voltage rises or falls.",
    attachment=Attachment.INPUT,
    parameters=(
        Parameter("half_width_v", Quantity.INPUT, "half the width of the loop", 0.0, 1.0, (0.01, 0.03, 0.1, 0.25, 0.5)),
        Parameter(
            "spread",
            Quantity.RATIO,
            "0: one sharp play operator, 1: four of spread widths, a smooth loop",
            0.0,
            1.0,
            (0.5,),
            optional=True,
        ),
    ),
    step=_step,
    check="Run a slow triangle and compare the rising and the falling branch; try dither on the valve amplifier.",
    source="Prandtl-Ishlinskii play operators; Visintin, Differential Models of Hysteresis (1994)",
    state_size=6,
)
