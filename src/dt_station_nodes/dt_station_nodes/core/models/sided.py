"""What a spool does otherwise upwards than downwards, and towards zero than away from it."""

from numba import njit


@njit(cache=True)
def sided(wanted: float, at: float, upwards: float, closing: float, past: float) -> float:
    """Factor of a rate or lag of what stands `at` and is to move by `wanted` (V): `upwards` and `closing` (1) more.

    A move through zero closes first (`past` 0), or opens all the way where it ends further out than it began (1).
    """
    rising = 1.0 + upwards if wanted > 0.0 else 1.0 - upwards
    first = 1.0 if wanted * at < 0.0 else -1.0
    whole = 1.0 if abs(at + wanted) < abs(at) else -1.0
    return rising * (1.0 + closing * (first + past * (whole - first)))
