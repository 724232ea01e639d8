"""Products written out for some orders are those of a loop, bit for bit."""

import numpy as np
import pytest
from numba import njit

from dt_station_nodes.core.models.compiled import doubles
from dt_station_nodes.core.models.small import advance, dot


@njit
def products(a: np.ndarray, b: np.ndarray, u: float, x: np.ndarray, after: np.ndarray) -> float:
    state = doubles(x.ctypes.data)
    advance(doubles(a.ctypes.data), doubles(b.ctypes.data), u, state, b.size, doubles(after.ctypes.data))
    return dot(doubles(b.ctypes.data), state, b.size)


@pytest.mark.parametrize("n", range(8))
def test_every_order_gives_the_bits_of_a_loop(n: int) -> None:
    draw = np.random.default_rng(n)
    a, b, x = (10.0 ** draw.uniform(-6.0, 6.0, size) * draw.choice([-1.0, 1.0], size) for size in (n * n, n, n))
    u, after = 0.7, np.zeros(n)
    total = 0.0
    for i in range(n):
        total += float(b[i]) * float(x[i])
    assert products(a, b, u, x, after) == total
    for i in range(n):
        row = float(b[i]) * u
        for j in range(n):
            row += float(a[i * n + j]) * float(x[j])
        assert after[i] == row
