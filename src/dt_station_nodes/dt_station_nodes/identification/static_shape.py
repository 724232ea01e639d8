"""The form of a static characteristic: hysteresis, dead zone and saturation of a voltage, and their fit to data."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.signal import lfilter

from ..core.run import Array

Flags = NDArray[np.bool_]

NAMES = ("half_width", "spread", "dead", "centre", "upper", "lower", "rest", "gain")
HALF_WIDTH, SPREAD, DEAD, CENTRE, UPPER, LOWER, REST, GAIN = range(8)
BENT_SHARE = 0.1
ABSENT = {DEAD: 0.0, UPPER: np.inf, LOWER: -np.inf}
"""What a feature's parameter is where the feature is not there."""


@njit(cache=True)
def play(signal: Array, half_width: float) -> Array:
    """Play operator: follows the signal at a distance of half_width, from its first value."""
    out = np.empty_like(signal)
    value = signal[0]
    for k in range(signal.size):
        value = min(max(value, signal[k] - half_width), signal[k] + half_width)
        out[k] = value
    return out


def magnetised(voltage: Array, half_width: float, spread: float) -> Array:
    """Sharp play, or with spread up to 1 the mean of four of spread widths, as the model's hysteresis has it."""
    sharp = play(voltage, half_width)
    if spread <= 0.0:
        return np.asarray(sharp)
    smooth = sum(play(voltage, 0.5 * j * half_width) for j in range(1, 5)) / 4.0
    return np.asarray((1.0 - spread) * sharp + spread * smooth)


def shaped(voltage: Array, theta: Array) -> Array:
    """Effective voltage behind hysteresis, dead zone and saturation."""
    inner = magnetised(voltage, theta[HALF_WIDTH], theta[SPREAD]) - theta[CENTRE]
    excess = np.sign(inner) * np.maximum(np.abs(inner) - theta[DEAD], 0.0)
    return np.asarray(np.clip(theta[CENTRE] + excess, theta[LOWER], theta[UPPER]))


@dataclass(frozen=True)
class StaticData:
    """A slow run: voltage (n,), and the output thinned to (m,) or, of an integrating path, its rate over windows."""

    voltage: Array
    target: Array
    integrating: bool
    window: int
    stride: int
    sample_time_s: float
    lag_s: float = 0.0

    @property
    def two_sided(self) -> bool:
        """Whether the voltage goes through zero."""
        return bool(self.voltage.min() < 0.0 < self.voltage.max())

    def model(self, theta: Array) -> Array:
        """Modelled target, (m,)."""
        effective = lagged(shaped(self.voltage, theta), self.lag_s, self.sample_time_s)
        if self.integrating:
            # an integrating path stands still in the middle of its dead zone
            effective = effective - theta[CENTRE]
            between = 0.5 * (effective[:-1] + effective[1:]) if self.lag_s > 0.0 else effective[:-1]
            effective = np.concatenate(([0.0], np.cumsum(between) * self.sample_time_s))
        seen = observed(effective, self.integrating, self.window, self.stride, self.sample_time_s)
        return np.asarray(theta[REST] + theta[GAIN] * seen)


def lagged(held: Array, lag_s: float, sample_time_s: float) -> Array:
    """A held signal behind a first-order lag, settled at its first value."""
    if lag_s <= 0.0:
        return held
    decay = np.exp(-sample_time_s / lag_s)
    return np.asarray(held[0] + lfilter([0.0, 1.0 - decay], [1.0, -decay], held - held[0]))


def observed(output: Array, integrating: bool, window: int, stride: int, sample_time_s: float) -> Array:
    """The output, or the mean rate over a window of an integrating path, every stride samples."""
    if not integrating:
        return output[::stride]
    return np.asarray(((output[window:] - output[:-window]) / (window * sample_time_s))[::stride])


@dataclass(frozen=True)
class StaticFit:
    """Parameters in the order of NAMES, the Jacobian (m, 8) with zeros where fixed, and which were free."""

    theta: Array
    jacobian: Array
    free: Flags
    cost: float


def fit_shape(data: StaticData) -> StaticFit:
    """Fit all features, then leave out those the data do not need: one by one, while the error hardly grows."""
    free = np.ones(8, dtype=bool)
    free[CENTRE] = data.two_sided
    free[REST] = not (data.integrating and data.two_sided)
    rough = min((_fit(data, free, start, budget=10) for start in _starts(data)), key=lambda fit: fit.cost)
    best = _fit(data, free, rough.theta)
    for feature in (SPREAD, LOWER, UPPER, DEAD, HALF_WIDTH):
        fewer = best.free.copy()
        start = best.theta.copy()
        gone = [HALF_WIDTH, SPREAD] if feature == HALF_WIDTH else [feature]
        fewer[gone] = False
        start[gone] = [ABSENT.get(each, 0.0) for each in gone]
        if feature == SPREAD:
            start[HALF_WIDTH] *= 1.0 + 0.25 * best.theta[SPREAD]
        without = _fit(data, fewer, start)
        if without.cost < (1.0 + BENT_SHARE) * best.cost:
            best = without
    return best


def _starts(data: StaticData) -> list[Array]:
    low, high = float(data.voltage.min()), float(data.voltage.max())
    swing, middle = high - low, 0.5 * (high + low)
    choices = product((0.01, 0.05), (0.2,), (0.01, 0.1), (0.5, 0.4))
    return [
        np.array([width * swing, spread, dead * swing, 0.0, middle + reach * swing, middle - reach * swing, 0.0, 1.0])
        for width, spread, dead, reach in choices
    ]


def _fit(data: StaticData, free: Flags, start: Array, budget: int = 40) -> StaticFit:
    """Least squares over the free parameters; the others stay where the start has them."""
    low, high = float(data.voltage.min()), float(data.voltage.max())
    swing, middle = high - low, 0.5 * (high + low)
    inner = 0.5 * swing
    lower = np.array([0.0, 0.0, 0.0, -inner, middle, low - swing, -np.inf, -np.inf])[free]
    upper = np.array([inner, 1.0, inner, inner, high + swing, middle, np.inf, np.inf])[free]
    theta = start.copy()
    _regress(data, theta)
    scale = np.array([0.1 * swing, 0.3, 0.1 * swing, 0.1 * swing, 0.3 * swing, 0.3 * swing, 1.0, 1.0])
    scale[REST:] = np.maximum(np.abs(theta[REST:]), 1e-3 * float(np.ptp(data.target)))
    found = least_squares(
        _residual(data, theta, free),
        np.clip(theta[free], lower + 1e-9, upper - 1e-9),
        bounds=(lower, upper),
        x_scale=scale[free],
        diff_step=1e-4,
        max_nfev=budget,
    )
    jacobian = np.zeros((data.target.size, 8))
    jacobian[:, free] = found.jac
    theta[free] = found.x
    return StaticFit(theta, jacobian, free, float(found.cost))


def _residual(data: StaticData, theta: Array, free: Flags) -> Callable[[Array], Array]:
    def residual(partial: Array) -> Array:
        whole = theta.copy()
        whole[free] = partial
        return data.model(whole) - data.target

    return residual


def _regress(data: StaticData, theta: Array) -> None:
    """Put the best rest and gain for the shape into theta."""
    theta[REST:] = 0.0, 1.0
    shape = data.model(theta)
    columns = np.column_stack([np.ones_like(shape), shape])
    solution = np.linalg.lstsq(columns, data.target, rcond=None)[0]
    theta[GAIN] = solution[1]
    if not (data.integrating and data.two_sided):
        theta[REST] = solution[0]
