"""Exact propagation of linear filters between samples, compiled."""

import numpy as np
from numba import njit

from ..core.run import Array


def companion(denominator: Array) -> Array:
    """Matrix of the states s^i / A(s) * input, i = 0..n-1; denominator of A monic, highest power first."""
    order = denominator.size - 1
    matrix = np.zeros((order, order))
    matrix[np.arange(order - 1), np.arange(1, order)] = 1.0
    if order:
        matrix[-1] = -denominator[:0:-1]
    return matrix


@njit(cache=True)
def _product(left: Array, right: Array) -> Array:
    n = left.shape[0]
    out = np.zeros((n, n))
    for i in range(n):
        for k in range(n):
            factor = left[i, k]
            if factor != 0.0:
                for j in range(n):
                    out[i, j] += factor * right[k, j]
    return out


@njit(cache=True)
def exponential(matrix: Array) -> Array:
    """Matrix exponential by scaling, Taylor series to rounding, and squaring; for small matrices, called often."""
    n = matrix.shape[0]
    norm = 0.0
    for i in range(n):
        norm = max(norm, np.sum(np.abs(matrix[i])))
    squarings = 0
    while norm > 0.5 and squarings < 1000:
        norm *= 0.5
        squarings += 1
    scaled = matrix * 0.5**squarings
    total = np.eye(n)
    term = np.eye(n)
    for k in range(1, 19):
        term = _product(term, scaled) / k
        total += term
    for _ in range(squarings):
        total = _product(total, total)
    return total


def held(matrix: Array, column: Array, interval_s: float) -> tuple[Array, Array]:
    """Transition over an interval and the effect of a constant input, exact also for integrators."""
    n = matrix.shape[0]
    block = np.zeros((n + 1, n + 1))
    block[:n, :n] = matrix
    block[:n, n] = column
    power = exponential(block * interval_s)
    return power[:n, :n].copy(), power[:n, n].copy()


def interpolated(matrix: Array, column: Array, interval_s: float) -> tuple[Array, Array, Array]:
    """Transition and the effects of the input at the start and the end of an interval it runs straight over."""
    n = matrix.shape[0]
    block = np.zeros((n + 2, n + 2))
    block[:n, :n] = matrix
    block[:n, n] = column
    block[n, n + 1] = 1.0 / interval_s
    power = exponential(block * interval_s)
    ending = power[:n, n + 1].copy()
    return power[:n, :n].copy(), power[:n, n] - ending, ending


@njit(cache=True)
def propagate(transition: Array, first: Array, second: Array, a: Array, b: Array, start: Array) -> Array:
    """States x[k+1] = transition x[k] + first a[k] + second b[k] from x[0] = start, shape (n, samples)."""
    n = transition.shape[0]
    samples = a.shape[0]
    states = np.empty((n, samples))
    x = start.copy()
    following = np.empty(n)
    for k in range(samples):
        for i in range(n):
            states[i, k] = x[i]
        for i in range(n):
            total = first[i] * a[k] + second[i] * b[k]
            for j in range(n):
                total += transition[i, j] * x[j]
            following[i] = total
        for i in range(n):
            x[i] = following[i]
    return states


def filter_held(denominator: Array, signal: Array, sample_time_s: float) -> Array:
    """s^i / A(s) of a signal held over each sample, i = 0..n-1, from rest, shape (n, samples)."""
    matrix = companion(denominator)
    column = np.zeros(matrix.shape[0])
    column[-1:] = 1.0
    transition, effect = held(matrix, column, sample_time_s)
    return np.asarray(propagate(transition, effect, np.zeros_like(effect), signal, signal, np.zeros_like(effect)))


def filter_smooth(denominator: Array, signal: Array, sample_time_s: float) -> Array:
    """s^i / A(s) of a signal that runs straight between samples, from rest, shape (n, samples)."""
    matrix = companion(denominator)
    column = np.zeros(matrix.shape[0])
    column[-1:] = 1.0
    transition, starting, ending = interpolated(matrix, column, sample_time_s)
    after = np.append(signal[1:], signal[-1:])
    return np.asarray(propagate(transition, starting, ending, signal, after, np.zeros_like(starting)))
