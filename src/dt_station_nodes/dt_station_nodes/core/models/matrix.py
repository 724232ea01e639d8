"""Small dense matrices in plain loops: the same bits on every machine, and no threads of a linear algebra library."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]

# With the norm scaled below a half, 16 terms of the series leave less than one unit in the last place.
_TERMS = 16


@njit(cache=True)
def _multiply(a: Array, b: Array, product: Array) -> None:
    """Product of square matrices, summed in a fixed order."""
    n = a.shape[0]
    product[:] = 0.0
    for i in range(n):
        for k in range(n):
            for j in range(n):
                product[i, j] += a[i, k] * b[k, j]


@njit(cache=True)
def exponential(a: Array) -> Array:
    """Matrix exponential of shape (n, n) by scaling and squaring of the Taylor series.

    Source: Moler & Van Loan, SIAM Review 45 (2003) 3, methods 1 and 3.
    """
    n = a.shape[0]
    norm = 0.0
    for i in range(n):
        row = 0.0
        for j in range(n):
            row += abs(a[i, j])
        norm = max(norm, row)
    squarings = 0
    scale = 1.0
    while norm * scale > 0.5:
        scale *= 0.5
        squarings += 1
    scaled = a * scale
    term, total, product = np.eye(n), np.eye(n), np.empty((n, n))
    for k in range(1, _TERMS + 1):
        _multiply(term, scaled, product)
        for i in range(n):
            for j in range(n):
                term[i, j] = product[i, j] / k
                total[i, j] += term[i, j]
    for _ in range(squarings):
        _multiply(total, total, product)
        total, product = product, total
    return total
