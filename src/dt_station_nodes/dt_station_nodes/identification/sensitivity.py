"""Simulated output of a sum of transfer functions with its exact Jacobian.

For y = B/A u the derivatives are s^j/A u towards B and -s^i/A y towards A: both are states of one linear
system, so they are propagated with the output, without approximation, for inputs held or straight between samples.
"""

import math

import numpy as np

from ..core.run import Array
from .propagation import companion, exponential, held, interpolated, propagate
from .structure import Data, Hold, PathParameters, PathStructure, Structure, slices, unpack


def respond(structure: Structure, theta: Array, data: Data, rate_rad_s: float) -> tuple[Array, Array]:
    """Output (n,) and Jacobian (n, size) for parameters in time normalised by rate."""
    samples = len(data)
    jacobian = np.empty((samples, structure.size))
    output = np.zeros(samples)
    paths, ends = unpack(structure, theta)
    for path, values, where, signal in zip(structure.paths, paths, slices(structure), data.inputs, strict=True):
        numerator, denominator, delay, initial = where
        y, towards_b, towards_a, towards_delay = _forced(path, values, signal, data.sample_time_s, rate_rad_s)
        output += y
        jacobian[:, numerator] = towards_b
        jacobian[:, denominator] = towards_a
        if path.estimate_delay:
            jacobian[:, delay] = towards_delay[:, None]
        if initial.stop > initial.start:
            y, towards_c, towards_a = _free(values, samples, data.sample_time_s * rate_rad_s)
            output += y
            jacobian[:, initial] = towards_c
            jacobian[:, denominator] += towards_a
    trend = _trend(structure, data, rate_rad_s)
    jacobian[:, -ends.size :] = trend
    output += trend @ ends
    return output, jacobian


def linear_columns(structure: Structure, theta: Array, data: Data, rate_rad_s: float) -> Array:
    """Columns (n, size) of the parameters the output is linear in; zeros where it is not (denominators, delays)."""
    samples = len(data)
    columns = np.zeros((samples, structure.size))
    for path, values, where, signal in zip(
        structure.paths, unpack(structure, theta)[0], slices(structure), data.inputs, strict=True
    ):
        matrix = companion(np.concatenate((values.denominator, np.zeros(path.integrators))))
        column = np.zeros(path.poles)
        column[-1] = 1.0
        states, _ = _driven(path, matrix, column, values.delay_s, signal, data.sample_time_s, rate_rad_s)
        columns[:, where[0]] = states[path.zeros :: -1].T
        if where[3].stop > where[3].start:
            matrix = companion(values.denominator)
            free = _decaying(matrix, samples, data.sample_time_s * rate_rad_s, values.denominator)
            columns[:, where[3]] = free[::-1].T
    columns[:, -1 - int(structure.drift) :] = _trend(structure, data, rate_rad_s)
    return columns


def simulated(structure: Structure, theta: Array, data: Data, rate_rad_s: float) -> Array:
    """Output (n,) alone, at half the price of `respond`."""
    return linear_columns(structure, theta, data, rate_rad_s) @ theta


def _trend(structure: Structure, data: Data, rate_rad_s: float) -> Array:
    """Columns of offset and drift."""
    time = data.sample_time_s * rate_rad_s * np.arange(len(data))
    return np.column_stack([np.ones(len(data)), time])[:, : 1 + int(structure.drift)]


def _driven(
    path: PathStructure,
    matrix: Array,
    column: Array,
    delay_s: float,
    signal: Array,
    sample_time_s: float,
    rate_rad_s: float,
) -> tuple[Array, Array]:
    """States of x' = matrix x + column u in normalised time, and the input that arrives at each sample."""
    start = np.zeros(column.size)
    interval = sample_time_s * rate_rad_s
    if path.hold is Hold.SMOOTH:
        current = delayed(signal, delay_s / sample_time_s)
        transition, starting, ending = interpolated(matrix, column, interval)
        following = np.append(current[1:], current[-1:])
        return propagate(transition, starting, ending, current, following, start), current
    whole = math.floor(delay_s / sample_time_s)
    rest = delay_s / sample_time_s - whole
    current = shifted(signal, whole)
    transition, effect = held(matrix, column, interval)
    if rest == 0.0:
        return propagate(transition, effect, start, current, current, start), current
    previous = shifted(signal, whole + 1)
    late, recent = held(matrix, column, interval * (1.0 - rest))
    _, old = held(matrix, column, interval * rest)
    return propagate(transition, recent, late @ old, current, previous, start), previous


def _forced(
    path: PathStructure, values: PathParameters, signal: Array, sample_time_s: float, rate_rad_s: float
) -> tuple[Array, Array, Array, Array]:
    """Forced response and its derivatives towards numerator, denominator and delay."""
    order = path.poles
    single = companion(np.concatenate((values.denominator, np.zeros(path.integrators))))
    block = np.zeros((2 * order, 2 * order))
    block[:order, :order] = single
    block[order:, order:] = single
    block[-1, : path.zeros + 1] = values.numerator[::-1]
    column = np.zeros(2 * order)
    column[order - 1] = 1.0
    states, arriving = _driven(path, block, column, values.delay_s, signal, sample_time_s, rate_rad_s)
    output = values.numerator[::-1] @ states[: path.zeros + 1]
    towards_b = states[path.zeros :: -1]
    towards_a = -states[2 * order - 1 : order + path.integrators - 1 : -1]
    towards_delay = np.empty(0)
    if path.estimate_delay:
        if path.hold is Hold.SMOOTH:
            whole = math.floor(values.delay_s / sample_time_s)
            change = (shifted(signal, whole + 1) - shifted(signal, whole)) / sample_time_s
            moved, _ = _driven(path, single, column[:order], 0.0, change, sample_time_s, rate_rad_s)
        else:
            # -dx/dt, but for what the start from rest adds to it
            moved = -rate_rad_s * (single @ states[:order])
            moved[-1] -= rate_rad_s * arriving
            start = column[:order] * (rate_rad_s * signal[0])
            nothing = np.zeros(signal.size)
            transition = exponential(single * (sample_time_s * rate_rad_s))
            moved += propagate(transition, nothing[:order], nothing[:order], nothing, nothing, start)
        towards_delay = values.numerator[::-1] @ moved[: path.zeros + 1]
    return output, towards_b.T, towards_a.T, towards_delay


def _free(values: PathParameters, samples: int, interval: float) -> tuple[Array, Array, Array]:
    """Response from unknown initial states and its derivatives towards them and the denominator."""
    order = values.initial.size
    single = companion(values.denominator)
    block = np.zeros((2 * order, 2 * order))
    block[:order, :order] = single
    block[order:, order:] = single
    block[-1, :order] = values.initial[::-1]
    states = _decaying(block, samples, interval, values.denominator)
    return values.initial[::-1] @ states[:order], states[order - 1 :: -1].T, -states[: order - 1 : -1].T


def _decaying(matrix: Array, samples: int, interval: float, denominator: Array) -> Array:
    """Free response of the companion states, the first block started by an impulse; zero once it has died away."""
    slowest = float(np.min(-np.roots(denominator).real))
    lasting = samples if slowest <= 0.0 else min(samples, math.ceil(60.0 / (slowest * interval)) + 1)
    start = np.zeros(matrix.shape[0])
    start[denominator.size - 2] = 1.0
    transition = exponential(matrix * interval)
    nothing = np.zeros(lasting)
    states = np.zeros((matrix.shape[0], samples))
    states[:, :lasting] = propagate(transition, np.zeros_like(start), np.zeros_like(start), nothing, nothing, start)
    return states


def shifted(signal: Array, samples: int) -> Array:
    """The signal that many samples later; before its start it had its first value."""
    if samples == 0:
        return signal
    return np.concatenate((np.full(min(samples, signal.size), signal[0]), signal[: max(signal.size - samples, 0)]))


def delayed(signal: Array, samples: float) -> Array:
    """The signal a number of samples later, straight between samples."""
    whole = math.floor(samples)
    rest = samples - whole
    return (1.0 - rest) * shifted(signal, whole) + rest * shifted(signal, whole + 1)
