"""Mamdani inference, and its surface over both inputs computed once for quick bilinear lookup.

Memberships come from scikit-fuzzy; min for AND and for implication, max for aggregation, centre of gravity.
scikit-fuzzy's own inference handles one point in about a millisecond; here whole grids are done at once with
the same formulas, so that a live switch to fuzzy does not stall the loop.
"""

from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from .fuzzy_config import FuzzyConfig, FuzzyVariable, trapezoid

Array = NDArray[np.float64]

# Points of the voltage axis besides the terms' corners.
VOLTAGE_POINTS = 401
# Symmetric rules give exactly 0 at no error once the last bits are gone.
DECIMALS = 12


def memberships(variable: FuzzyVariable, x: Array) -> Array:
    """Degrees of membership, shape (terms, *x.shape), of x kept within the variable's range."""
    from skfuzzy.membership import trapmf  # noqa: PLC0415  slow to import, and only a fuzzy loop needs it

    kept = np.clip(x, *variable.range)
    flat = kept.ravel()
    return np.stack([trapmf(flat, list(trapezoid(c))).reshape(kept.shape) for c in variable.terms.values()])


def infer(config: FuzzyConfig, error: Array, load: Array) -> Array:
    """Voltage (unit of the voltage variable) by full inference at each pair; error and load of one shape (n,)."""
    degree_error, degree_load = memberships(config.error, error), memberships(config.load, load)
    names = list(config.voltage.terms)
    errors, loads = list(config.error.terms), list(config.load.terms)
    activation = np.zeros((len(names), error.size))
    for e, p, out in config.rule_list():
        fired = np.minimum(degree_error[errors.index(e)], degree_load[loads.index(p)])
        row = activation[names.index(out)]
        np.maximum(row, fired, out=row)
    axis = _voltage_axis(config.voltage)
    shapes = memberships(config.voltage, axis)
    weight, moment = _centroid_weights(axis)
    area, turn = np.zeros(error.size), np.zeros(error.size)
    # One point of the axis after the other, so that no library's order of summation enters: same bits everywhere.
    for shape, w, m in zip(shapes.T, weight, moment, strict=True):
        height = np.zeros(error.size)
        for row, top in zip(activation, shape, strict=True):
            if top > 0.0:
                np.maximum(height, np.minimum(row, top), out=height)
        area += w * height
        turn += m * height
    return turn / area


def _voltage_axis(variable: FuzzyVariable) -> Array:
    low, high = variable.range
    corners = [c for corners in variable.terms.values() for c in corners if low < c < high]
    return np.unique(np.concatenate([np.linspace(low, high, VOLTAGE_POINTS), corners]))


def _centroid_weights(x: Array) -> tuple[Array, Array]:
    """Weights w, m such that w @ y is the area and m @ y the moment under y, linear between the points x."""
    weight, moment = np.zeros_like(x), np.zeros_like(x)
    for i, (a, b) in enumerate(pairwise(x)):
        h = b - a
        weight[i : i + 2] += h / 2.0
        moment[i] += h * (2.0 * a + b) / 6.0
        moment[i + 1] += h * (a + 2.0 * b) / 6.0
    return weight, moment


class FuzzySurface:
    """The inference over an even grid of error and load, bilinear in between; inputs outside are held at the edge."""

    __slots__ = ("_e0", "_e_last", "_e_per", "_p0", "_p_last", "_p_per", "_rows", "error", "load", "values")

    def __init__(self, config: FuzzyConfig) -> None:
        n_error, n_load = config.grid
        self.error = np.linspace(*config.error.range, n_error)
        self.load = np.linspace(*config.load.range, n_load)
        pairs = np.meshgrid(self.error, self.load, indexing="ij")
        self.values = np.round(infer(config, pairs[0].ravel(), pairs[1].ravel()), DECIMALS).reshape(n_error, n_load)
        # Plain lists are several times faster to index from Python than arrays.
        self._rows: list[list[float]] = self.values.tolist()
        self._e0, self._p0 = float(self.error[0]), float(self.load[0])
        self._e_per = (n_error - 1) / float(self.error[-1] - self.error[0])
        self._p_per = (n_load - 1) / float(self.load[-1] - self.load[0])
        self._e_last, self._p_last = n_error - 2, n_load - 2

    def at(self, error: float, load: float) -> float:
        """Voltage at a pair of inputs in the variables' units."""
        x = (error - self._e0) * self._e_per
        y = (load - self._p0) * self._p_per
        # The last cell holds its far edge and all beyond it; comparisons cost a third of calls to min.
        if x < 0.0:
            i, x = 0, 0.0
        elif x < self._e_last:
            i = int(x)
            x -= i
        else:
            i, x = self._e_last, min(x - self._e_last, 1.0)
        if y < 0.0:
            j, y = 0, 0.0
        elif y < self._p_last:
            j = int(y)
            y -= j
        else:
            j, y = self._p_last, min(y - self._p_last, 1.0)
        low, high = self._rows[i], self._rows[i + 1]
        below = low[j] + y * (low[j + 1] - low[j])
        above = high[j] + y * (high[j + 1] - high[j])
        return below + x * (above - below)


def surface(config: FuzzyConfig) -> FuzzySurface:
    """The surface of a configuration; computed once for all that share variables, rules and grid."""
    # The gains act outside of the surface: tuning and live changes of them need no new one.
    shaping = {"error_scale", "load_scale", "error", "load", "voltage", "rules", "grid"}
    return _surface(config.model_dump_json(include=shaping))


@lru_cache(maxsize=16)
def _surface(text: str) -> FuzzySurface:
    return FuzzySurface(FuzzyConfig.model_validate_json(text))
