"""An estimated model: transfer functions, offsets, intervals, checks."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..core.run import Array
from .noise import Z95, CheckResult, NoiseColour
from .refinement import rescaled
from .sensitivity import respond
from .structure import Data, Structure, slices, unpack
from .transfer import Complex, TransferFunction, by_size


@dataclass(frozen=True, slots=True)
class Interval:
    """A value with its 95 % interval."""

    value: float
    low: float
    high: float

    def holds(self, truth: float) -> bool:
        """Whether the interval holds a value."""
        return self.low <= truth <= self.high


def fit_percent(measured: Array, simulated: Array) -> float:
    """100 (1 - |y - yhat| / |y - mean y|), the fit of the System Identification Toolbox (NRMSE)."""
    spread = float(np.linalg.norm(measured - measured.mean()))
    error = float(np.linalg.norm(measured - simulated))
    if spread == 0.0:
        return 100.0 if error == 0.0 else -np.inf
    return 100.0 * (1.0 - error / spread)


@dataclass(frozen=True)
class Estimate:
    """A fitted structure; `theta` and `covariance` are in physical units, laid out as in `structure`."""

    structure: Structure
    theta: Array
    covariance: Array
    output: Array
    residual: Array
    noise: NoiseColour
    fit_percent: float
    converged: bool
    rate_rad_s: float
    checks: tuple[CheckResult, ...] = ()

    @cached_property
    def paths(self) -> tuple[TransferFunction, ...]:
        """The transfer functions, one an input."""
        return transfer_functions(self.structure, self.theta)

    @property
    def offset(self) -> Interval:
        """Output at zero input (or, of an integrating path, the position at the start)."""
        return self.interval(lambda theta: _trend(self.structure, theta)[0])

    @property
    def aic(self) -> float:
        """Akaike's criterion with the residual's colour as part of the model."""
        return self._likelihood + 2.0 * self._parameters

    @property
    def bic(self) -> float:
        """Schwarz's criterion with the residual's colour as part of the model."""
        return self._likelihood + float(np.log(self.residual.size)) * self._parameters

    @property
    def _likelihood(self) -> float:
        return self.residual.size * 2.0 * float(np.log(max(self.noise.innovation_std, np.finfo(float).tiny)))

    @property
    def _parameters(self) -> int:
        return self.structure.size + self.noise.order

    def gain(self, path: int = 0) -> Interval:
        """DC or integrator gain of a path."""
        return self.interval(lambda theta: transfer_functions(self.structure, theta)[path].gain())

    def coefficients(self, path: int = 0) -> tuple[tuple[Interval, ...], tuple[Interval, ...]]:
        """Numerator and free denominator coefficients, highest power first; without the leading 1 and integrators."""
        numerator, denominator, _, _ = slices(self.structure)[path]
        half = Z95 * np.sqrt(np.maximum(np.diag(self.covariance), 0.0))
        every = [Interval(float(v), float(v - h), float(v + h)) for v, h in zip(self.theta, half, strict=True)]
        return tuple(every[numerator]), tuple(every[denominator])

    def gain_band(self, frequency_rad_s: Array, path: int = 0) -> Array:
        """Half widths of the 95 % intervals of the gain at frequencies, by linearisation."""
        spread = np.sqrt(np.maximum(np.diag(self.covariance), 0.0))
        slopes = np.zeros((frequency_rad_s.size, self.theta.size))
        for i in np.flatnonzero(spread):
            step = np.zeros(self.theta.size)
            step[i] = max(0.01 * spread[i], 1e-9 * abs(self.theta[i]))
            up, down = (
                np.abs(transfer_functions(self.structure, moved)[path].frequency_response(frequency_rad_s))
                for moved in (self.theta + step, self.theta - step)
            )
            slopes[:, i] = (up - down) / (2.0 * step[i])
        return np.asarray(Z95 * np.sqrt(np.maximum(np.sum((slopes @ self.covariance) * slopes, axis=1), 0.0)))

    def delay(self, path: int = 0) -> Interval:
        """Delay of a path, s."""
        return self.interval(lambda theta: unpack(self.structure, theta)[0][path].delay_s)

    def pole_sizes(self, path: int = 0) -> tuple[Interval, ...]:
        """Magnitudes of the free poles, rad/s, slowest first."""
        return self._roots(path, np.abs)

    def pole_real_parts(self, path: int = 0) -> tuple[Interval, ...]:
        """Real parts of the free poles in the order of `pole_sizes`, rad/s."""
        return self._roots(path, np.real)

    def _roots(self, path: int, measure: Callable[[Complex], Array]) -> tuple[Interval, ...]:
        nominal = by_size(np.roots(unpack(self.structure, self.theta)[0][path].denominator))

        def of(theta: Array) -> Array:
            moved = np.asarray(np.roots(unpack(self.structure, theta)[0][path].denominator), dtype=np.complex128)
            order = [int(np.argmin(np.abs(moved - root))) for root in nominal]
            return measure(moved[order])

        return tuple(self.interval(lambda theta, i=i: float(of(theta)[i])) for i in range(nominal.size))  # type: ignore[misc]

    def bias(self, path: int = 0) -> Interval:
        """Input that explains the drift of an integrating path, in units of its input."""
        if not self.structure.drift:
            return Interval(0.0, 0.0, 0.0)
        return self.interval(lambda theta: float(theta[-1]) / transfer_functions(self.structure, theta)[path].gain())

    @property
    def cost(self) -> float:
        """Sum of squared simulation errors."""
        return float(self.residual @ self.residual)

    def interval(self, function: Callable[[Array], float]) -> Interval:
        """Interval of a function of the parameters by linearisation."""
        value = function(self.theta)
        half = Z95 * np.sqrt(max(variance_of(function, self.theta, self.covariance), 0.0))
        return Interval(value, value - half, value + half)

    def predict(self, data: Data) -> Array:
        """Simulation of other data with these dynamics; initial states, offset and drift are fitted to it."""
        return simulate(self, data)


def transfer_functions(structure: Structure, theta: Array) -> tuple[TransferFunction, ...]:
    """Physical transfer functions of a physical parameter vector."""
    return tuple(
        TransferFunction(
            tuple(values.numerator), (*values.denominator, *([0.0] * path.integrators)), max(values.delay_s, 0.0)
        )
        for path, values in zip(structure.paths, unpack(structure, theta)[0], strict=True)
    )


def variance_of(function: Callable[[Array], float], theta: Array, covariance: Array) -> float:
    """Variance of a scalar function of normally distributed parameters, by central differences along principal axes."""
    spread = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    gradient = np.zeros(theta.size)
    for i in np.flatnonzero(spread):
        step = 0.01 * spread[i]
        if abs(step) < 1e-9 * abs(theta[i]):
            step = 1e-9 * abs(theta[i])
        up, down = theta.copy(), theta.copy()
        up[i] += step
        down[i] -= step
        gradient[i] = (function(up) - function(down)) / (up[i] - down[i])
    return float(gradient @ covariance @ gradient)


def simulate(fitted: Estimate, data: Data) -> Array:
    """Simulated output on other data; only initial states, offset and drift are fitted to it, linearly."""
    structure = fitted.structure
    theta = rescaled(structure, fitted.theta, 1.0, fitted.rate_rad_s)
    loose = np.zeros(structure.size, dtype=bool)
    for where in slices(structure):
        loose[where[3]] = True
    loose[-1 - int(structure.drift) :] = True
    theta[loose] = 0.0
    forced, jacobian = respond(structure, theta, data, fitted.rate_rad_s)
    columns = jacobian[:, loose]
    scale = np.linalg.norm(columns, axis=0)
    scale[scale == 0.0] = 1.0
    columns = columns / scale
    return np.asarray(forced + columns @ np.linalg.lstsq(columns, data.output - forced, rcond=None)[0])


def _trend(structure: Structure, theta: Array) -> Array:
    return unpack(structure, theta)[1]
