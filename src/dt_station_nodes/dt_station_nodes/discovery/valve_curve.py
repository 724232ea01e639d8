"""Where the curve of a valve, from voltage given to voltage that acts, is flat: read off a residual."""

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
    voltage = problem.simulator.voltage_v
    even = np.linspace(0.0, 1.0, _KNOTS)
    low, high = float(voltage.min()), float(voltage.max())
    found = []
    for knots in (low + (high - low) * even, np.quantile(voltage, even)):
        apart = knots[np.concatenate([[True], np.diff(knots) > _CLOSEST * (high - low)])]
        if len(apart) > 2:
            flattest = np.argsort(_slopes(problem, path, residual, apart), kind="stable")[:count]
            found += [float(middle) for middle in (0.5 * (apart[:-1] + apart[1:]))[flattest]]
    return found or [0.5 * (low + high)]


def _slopes(problem: Problem, path: PathSpec, residual: Array, knots: Array) -> Array:
    """By how much a curve is steeper than 1 between knots (k,), shape (k - 1,)."""
    voltage = problem.simulator.voltage_v
    plain = problem.simulator.simulate(path)
    step = _CLOSEST * float(np.ptp(knots))
    answers = []
    for low, high in pairwise(knots):
        steeper = voltage + step * np.clip(voltage - low, 0.0, high - low)
        moved = replace(problem.simulator, voltage_v=np.ascontiguousarray(steeper)).simulate(path)
        answers.append(problem.windows.project(moved - plain) * problem.weights / step)
    answers.append(problem.windows.project(np.ones(len(voltage))) * problem.weights)
    columns = np.column_stack(answers)
    weight = _SMOOTH * float(np.sum(np.square(columns[:, :-1]))) / (len(knots) - 1)
    normal = columns.T @ columns + weight * np.diag([1.0] * (len(knots) - 1) + [0.0])
    return np.asarray(np.linalg.lstsq(normal, columns.T @ residual, rcond=None)[0][:-1])
