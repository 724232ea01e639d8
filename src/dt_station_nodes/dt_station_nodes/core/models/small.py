"""Products of a path's small matrices, written out for the orders met most: loops cost more than their few sums.

Each sum is taken in the loop's order, so that all give the same bits.
"""

from numba import njit

from .compiled import Doubles


@njit(cache=True, _nrt=False, forceinline=True)
def dot(a: Doubles, x: Doubles, n: int) -> float:
    """Sum of the products of n numbers of either."""
    total = 0.0
    if n == 2:
        return total + a[0] * x[0] + a[1] * x[1]
    if n == 3:
        return total + a[0] * x[0] + a[1] * x[1] + a[2] * x[2]
    if n == 6:
        return total + a[0] * x[0] + a[1] * x[1] + a[2] * x[2] + a[3] * x[3] + a[4] * x[4] + a[5] * x[5]
    for i in range(n):
        total += a[i] * x[i]
    return total


@njit(cache=True, _nrt=False, forceinline=True)
def advance(a: Doubles, b: Doubles, u: float, x: Doubles, n: int, after: Doubles) -> None:
    """Put a x + b u into `after`; a is (n, n) by rows."""
    if n == 2:
        x0, x1 = x[0], x[1]
        after[0] = b[0] * u + a[0] * x0 + a[1] * x1
        after[1] = b[1] * u + a[2] * x0 + a[3] * x1
        return
    if n == 3:
        x0, x1, x2 = x[0], x[1], x[2]
        after[0] = b[0] * u + a[0] * x0 + a[1] * x1 + a[2] * x2
        after[1] = b[1] * u + a[3] * x0 + a[4] * x1 + a[5] * x2
        after[2] = b[2] * u + a[6] * x0 + a[7] * x1 + a[8] * x2
        return
    if n == 6:
        x0, x1, x2, x3, x4, x5 = x[0], x[1], x[2], x[3], x[4], x[5]
        for i in range(6):
            k = 6 * i
            first = b[i] * u + a[k] * x0 + a[k + 1] * x1 + a[k + 2] * x2
            after[i] = first + a[k + 3] * x3 + a[k + 4] * x4 + a[k + 5] * x5
        return
    for i in range(n):
        total = b[i] * u
        for j in range(n):
            total += a[i * n + j] * x[j]
        after[i] = total
