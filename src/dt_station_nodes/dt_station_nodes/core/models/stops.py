"""The ends of a way: what keeps an output between two limits, at once, through a spring and a damper or by its port.

All take the parameters of `effects.overflow` in their order.
"""

from numba import njit

from .compiled import (
    FREE_OUTPUT,
    FREE_VELOCITY,
    INJECTION,
    INJECTION_GAIN,
    LOAD_OUTPUT,
    LOAD_VELOCITY,
    OUTLET_RATE,
    OUTPUT_GAIN,
    SPEED_GAIN,
    SUBSTEP,
    VELOCITY,
    VELOCITY_GAIN,
    Doubles,
    halfway,
)


@njit(cache=True)
def kept(p: Doubles, value: float, c: Doubles) -> float:
    """Inject what keeps the output between its limits; the voltage, less what brings a piston to a stand there."""
    # What is not held by the stops goes on beside them; a stop that gives does so by what presses on it.
    beside, give = 1.0 - p[12], value / p[11]
    output = c[FREE_OUTPUT] + c[INJECTION_GAIN] * c[INJECTION] - beside * c[LOAD_OUTPUT]
    limit, lower_limit = p[0] + max(give, 0.0), p[9] + min(give, 0.0)
    if lower_limit <= output <= limit:
        return value
    end = limit if output > limit else lower_limit
    velocity = c[FREE_VELOCITY] - beside * c[LOAD_VELOCITY]
    if c[OUTLET_RATE] == 0.0 and c[VELOCITY_GAIN] != 0.0:
        # Within the sub-step: how much of it is left where the piston meets its end, and how fast it leaves by then.
        before = c[VELOCITY] + p[12] * c[LOAD_VELOCITY]
        way = 0.5 * (before + velocity) * c[SUBSTEP]
        left = min((output - end) / way, 1.0) if (output - end) * way > 0.0 else 1.0
        met = velocity + left * (before - velocity)
        slowed = c[VELOCITY_GAIN] / c[SPEED_GAIN] if c[SPEED_GAIN] != 0.0 else 0.0
        decay = max(1.0 - slowed, 0.0) ** left
        after = velocity - met * decay if met * (output - end) > 0.0 else velocity
        if after * (output - end) > 0.0:
            after = 0.0
        braked = p[10] * (velocity - after) / c[VELOCITY_GAIN]
        value -= braked
        output -= c[OUTPUT_GAIN] * braked
        end += p[10] * 0.5 * after * left * c[SUBSTEP]
    over = (output - end) / c[INJECTION_GAIN]
    if over > 0.0 and p[4] > 0.0:
        # A weir: what stands above the rim runs off in time, never more than there is.
        over = min(over, (output - end) / p[4] * ((output - end) / abs(end)) ** (p[5] - 1.0))
    c[INJECTION] -= over
    return value


@njit(cache=True)
def cushioned(p: Doubles, value: float, c: Doubles) -> float:
    """The voltage, less what a spring and a damper at an end press back with, as it is half-way."""
    place = halfway(c) - (1.0 - p[12]) * c[LOAD_OUTPUT]
    over = max(place - p[0], 0.0) + min(place - p[9], 0.0)
    speed = 0.5 * (c[VELOCITY] + c[FREE_VELOCITY] - c[LOAD_VELOCITY])
    inwards = speed if speed * over > 0.0 else 0.0
    damping = p[11] * p[15] if inwards != 0.0 else 0.0
    pressed = p[11] * over + damping * inwards
    return value - pressed / (1.0 + 0.5 * (p[11] * c[OUTPUT_GAIN] + damping * c[VELOCITY_GAIN]))


@njit(cache=True)
def throttled(p: Doubles, value: float, c: Doubles) -> float:
    """What a port that closes past an end leaves of a voltage that drives further out, by its place half-way."""
    place = halfway(c) - (1.0 - p[12]) * c[LOAD_OUTPUT]
    past = place - p[0] if value > 0.0 else p[9] - place
    return value * min(max(1.0 - past / p[16], 0.0), 1.0)
