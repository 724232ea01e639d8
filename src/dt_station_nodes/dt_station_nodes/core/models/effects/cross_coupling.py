"""Cross-coupling: the other channel's voltage leaks into this one's. A rival to what it looks like, never named."""

from ..compiled import OTHER_INPUT, SUBSTEP, Doubles, effect_step
from .effect import Attachment, Effect, Parameter, Quantity


@effect_step
def _step(p: Doubles, s: Doubles, value: float, c: Doubles) -> float:
    other = c[OTHER_INPUT]
    if p[1] > 1e-9:
        if s[1] == 0.0:
            s[1] = 1.0
            s[0] = other
        s[0] += (other - s[0]) * c[SUBSTEP] / (p[1] + c[SUBSTEP])
        changed = other - s[0]
        value += p[4] * changed
        other = s[0] + p[2] * changed
    return value + (p[0] + p[3] * value) * other


EFFECT = Effect(
    name="cross_coupling",
    sentence="The other channel's voltage acts on this one.",
    attachment=Attachment.INPUT,
    parameters=(
        Parameter("share", Quantity.RATIO, "volts here per volt there", -3.0, 3.0, (0.03, -0.03, 0.3, -0.3)),
        Parameter("lag_s", Quantity.TIME, "lag with which it arrives", 0.0, 5.0, (0.05, 0.5), optional=True),
        Parameter("at_once", Quantity.RATIO, "share that does not lag", -2.0, 2.0, (0.0,), optional=True),
        Parameter(
            "gain_per_v",
            Quantity.RATIO,
            "how much more a volt does here per volt there, as of amplifiers that share a supply or a ground",
            -1.0,
            1.0,
            (0.03, -0.03),
            optional=True,
            acts_alone=True,
        ),
        Parameter(
            "changes",
            Quantity.RATIO,
            "volts here per volt by which the other moves, which fade with the lag",
            -3.0,
            3.0,
            (0.03, -0.03, 0.3, -0.3),
            optional=True,
            acts_alone=True,
        ),
    ),
    step=_step,
    check="Command one channel alone and watch the other; look at shared supplies, grounds and amplifiers.",
    source="first-order cross-talk, direct or through a washout",
    state_size=2,
    sub_stepped=True,
    vocabulary=False,
    special_cases={"leakage": "lag_s"},
)
