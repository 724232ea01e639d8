"""Rate limit: the valve cannot follow faster than its slew rate."""

from ..compiled import SUBSTEP, effect_step
from .effect import Attachment, Effect, Parameter, Quantity


@effect_step
def step(p, s, value, c):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201, D103
    if s[1] == 0.0:
        s[1] = 1.0
        s[0] = value
    before = s[0]
    most = p[0] * c[SUBSTEP]
    s[0] = before + min(max(value - before, -most), most)
    return 0.5 * (before + s[0]) if abs(value - s[0]) > 0.0 else s[0]


EFFECT = Effect(
    name="rate_limit",
    sentence="The valve follows the voltage no faster than its slew rate.",
    attachment=Attachment.INPUT,
    parameters=(
        Parameter("rate_v_per_s", Quantity.INPUT_RATE, "highest rate of change", 0.0, 50.0, (0.5, 2.0, 8.0), neutral=1e9),
    ),
    step=step,
    check="Compare the answers to a small and a large step; look at amplifier ramps and pilot flow.",
    source="slew-rate limiter; Slotine & Li, Applied Nonlinear Control (1991), 5.2",
    state_size=2,
    sub_stepped=True,
)
