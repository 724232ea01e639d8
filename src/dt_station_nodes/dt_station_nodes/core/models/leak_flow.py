"""What flows through a leak, and what one behind a path takes off its output: numbers in the order of `leakage`."""

import math

from numba import njit

from .compiled import REST, SETTLING_RATE, SUBSTEP, TIME, Doubles


@njit(cache=True)
def through(p: Doubles, warmed: float, pressure: float, rest: float) -> float:
    """Flow at a pressure (Pa) over the one at which nothing leaks, through a gap or an orifice of size `warmed`."""
    if p[14] > 0.5:
        pressure = max(pressure, 0.0)
    felt = pressure
    if p[1] != 0.0:
        # The turbulent law is scaled to meet the laminar one at the rest pressure.
        felt = (1.0 - p[1]) * pressure + p[1] * math.copysign(math.sqrt(abs(pressure) * max(rest, 1.0)), pressure)
    if p[6] == 0.0:
        return warmed * felt
    widened = max(1.0 + p[6] * max(pressure, 0.0), 0.0)
    return warmed * felt * widened * widened * widened


@njit(cache=True)
def opened(p: Doubles, c: Doubles) -> float:
    """Size of a leak as warm as its oil is by now."""
    return p[0] * max(1.0 + p[8] * c[TIME], 0.0)


@njit(cache=True)
def held_down(p: Doubles, before: float, value: float, c: Doubles) -> float:
    """How far (Pa) a leak behind a path holds its pressure down at the end of a sub-step, held down so far `before`."""
    # A path without a lag of its own has a rate of 1/s.
    rate = c[SETTLING_RATE] if c[SETTLING_RATE] > 0.0 else 1.0
    warmed = opened(p, c) / rate
    made_up = p[7] * through(p, warmed, c[REST] * (1.0 - p[2]), c[REST])
    share = c[SUBSTEP] / (p[4] + c[SUBSTEP])
    after, small = before, 1e-4 * max(c[REST], 1.0)
    for _ in range(12):
        left = value - after + c[REST] * (1.0 - p[2])
        lost = through(p, warmed, left, c[REST])
        slope = (through(p, warmed, left + small, c[REST]) - lost) / small
        change = (after - before - share * (lost - made_up - before)) / max(1.0 + share * slope, 0.2)
        after -= change
        if abs(change) < 1e-3:
            break
    return after
