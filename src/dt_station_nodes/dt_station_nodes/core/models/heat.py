"""What heat, or anything else that tires, makes of a gain."""

import math

from numba import njit


@njit(cache=True)
def by_heat(heat: float, bend: float) -> float:
    """Gain by heat: linear in it (bend 1), one over such a line (-1), as a coil's, or exponential (0), as oil's."""
    if abs(bend) < 1e-3:
        return math.exp(heat)
    return math.exp(math.log(max(1.0 + bend * heat, 0.02)) / bend)
