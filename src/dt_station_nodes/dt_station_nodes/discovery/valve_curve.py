"""Where the curve of a valve, from voltage given to voltage that acts, is flat or bends: read off a residual."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ..core.models import PathSpec
from .problem import Problem

Array = NDArray[np.float64]

_KNOTS = 24
_CLOSEST = 1e-3  # of the voltage's range
_SMOOTH = 1e-3  # of the slopes' own weight: what the run does not show of the curve is straight


def flattest_v(problem: Problem, path: PathSpec, residual: Array, count: int) -> list[float]:
    """Voltages (V) about which a static curve before `path`, explaining a residual (n,), would be flattest.

    The curve is straight between knots, spaced evenly by voltage and evenly by samples: a narrow band may show in
    either; `count` voltages of each. Its slopes follow by least squares, as the residual of a linear path is linear in
    them.
    """
    found = []
    for knots in _knots(problem.simulator.voltage_v):
        slopes = _slopes(problem, path, residual, knots)
        middles = 0.5 * (knots[:-1] + knots[1:])
        found += [float(volts) for volts in middles[np.argsort(slopes, kind="stable")[:count]]]
    return found


def kinks_v(problem: Problem, path: PathSpec, residual: Array) -> list[float]:
    """Voltages (V) at which a static curve of two straight parts before `path` would bend, one by each set of knots.

    The middle of the voltages is one more: a run of two levels shows nothing of the curve between them.
    """
    voltage = problem.simulator.voltage_v
    found = [0.5 * float(voltage.min() + voltage.max())]
    for knots in _knots(voltage):
        slopes, widths = _slopes(problem, path, residual, knots), np.diff(knots)
        risen, passed = np.cumsum(slopes * widths)[:-1], np.cumsum(widths)[:-1]
        whole, range_v = float(slopes @ widths), float(np.sum(widths))
        # Least squares of a step in the slope: how far both means lie apart, weighted by what each is of.
        bend = (risen / passed - (whole - risen) / (range_v - passed)) ** 2 * passed * (range_v - passed)
        found.append(float(knots[1 + int(np.argmax(bend))]))
    return found


def _knots(voltage: Array) -> list[Array]:
    """Knots evenly by voltage, and evenly by samples where these are not all the same few."""
    even = np.linspace(0.0, 1.0, _KNOTS)
    by_samples = np.quantile(voltage, even)
    by_voltage = by_samples[0] + np.ptp(voltage) * even
    apart = by_samples[np.concatenate([[True], np.diff(by_samples) > _CLOSEST * np.ptp(voltage)])]
    return [by_voltage, apart] if len(apart) > 2 else [by_voltage]


def _slopes(problem: Problem, path: PathSpec, residual: Array, knots: Array) -> Array:
    """By how much a curve is steeper than 1 between knots (k,), shape (k - 1,)."""
    voltage = problem.simulator.voltage_v
    plain = problem.residual(path)
    step = _CLOSEST * float(np.ptp(knots))
    answers = []
    for low, high in pairwise(knots):
        steeper = voltage + step * np.clip(voltage - low, 0.0, high - low)
        moved = replace(problem.simulator, voltage_v=np.ascontiguousarray(steeper))
        answers.append((plain - problem.compare(moved.simulate(path))) / step)
    answers.append(problem.windows.project(np.ones(len(voltage))) * problem.weights)
    columns = np.column_stack(answers)
    weight = _SMOOTH * float(np.sum(np.square(columns[:, :-1]))) / (len(knots) - 1)
    normal = columns.T @ columns + weight * np.diag([1.0] * (len(knots) - 1) + [0.0])
    return np.asarray(np.linalg.lstsq(normal, columns.T @ residual, rcond=None)[0][:-1])
