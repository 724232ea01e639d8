"""A second-order element over one step, exact for a held input, whether it rings or not."""

import math

from numba import njit


@njit(cache=True)
def swing(decay_rate: float, natural: float, step: float) -> tuple[float, float]:
    """How y'' + 2 `decay_rate` y' + `natural`^2 y = 0 goes on over a `step` (s), rates in 1/s.

    The pair (c, s): y after it is (c + decay_rate s) y + s y', its rate (c - decay_rate s) y' - natural^2 s y.
    """
    square = decay_rate * decay_rate - natural * natural
    turn = math.sqrt(abs(square))
    if square > 0.0:
        slow, fast = math.exp((turn - decay_rate) * step), math.exp(-(turn + decay_rate) * step)
        return 0.5 * (slow + fast), 0.5 * (slow - fast) / turn
    decay = math.exp(-decay_rate * step)
    return decay * math.cos(turn * step), decay * (math.sin(turn * step) / turn if turn > 0.0 else step)
