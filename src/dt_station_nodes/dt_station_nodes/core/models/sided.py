"""What a spool does otherwise upwards than downwards, and towards zero than away from it."""

from numba import njit


@njit(cache=True)
def sided(wanted: float, at: float, upwards: float, closing: float) -> float:
    """Factor of a rate or lag of what stands `at` and is to move by `wanted` (V): `upwards` and `closing` (1) more."""
    rising = 1.0 + upwards if wanted > 0.0 else 1.0 - upwards
    return rising * (1.0 + closing if wanted * at < 0.0 else 1.0 - closing)
