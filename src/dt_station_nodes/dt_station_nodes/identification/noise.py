"""Colour of the residual: what it does to intervals and how it is tested."""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_toeplitz
from scipy.signal import lfilter
from scipy.special import chdtri

from ..core.run import Array

Z95 = 1.959963984540054
SINGULAR = 1e-14
"""Information along an axis, relative to the best known one, below which it is rounding."""


@dataclass(frozen=True, slots=True)
class NoiseColour:
    """Autoregressive model of a residual: e[k] + c1 e[k-1] + ... = w[k], w white with `innovation_std`."""

    coefficients: Array
    innovation_std: float
    effective_samples: float

    @property
    def order(self) -> int:
        """Autoregressive order; 0 for a white residual."""
        return self.coefficients.size - 1

    def covariance(self, jacobian: Array) -> Array:
        """Covariance of least-squares parameters whose residual has this colour (sandwich), shape (p, p).

        With residual covariance S = L L', L the noise filter, it is H J' S J H, H = inv(J'J).
        """
        scale = np.linalg.norm(jacobian, axis=0)
        scale[scale == 0.0] = 1.0
        unit = jacobian / scale
        coloured = lfilter([1.0], self.coefficients, unit[::-1], axis=0)
        sizes, axes = np.linalg.eigh(unit.T @ unit)
        # a direction the data do not show at all gets a huge variance, not none
        least = SINGULAR * float(sizes[-1])
        floored = np.maximum(sizes, least)
        shown = coloured @ axes
        meat = self.innovation_std**2 * (shown.T @ shown)
        lost = np.flatnonzero(sizes < least)
        meat[lost, lost] = np.maximum(meat[lost, lost], self.innovation_std**2 * least)
        bread = axes / floored
        return np.asarray((bread @ meat @ bread.T) / np.outer(scale, scale))


def autocorrelation(signal: Array, lags: int) -> Array:
    """Biased autocovariance at lags 0..lags."""
    centred = signal - signal.mean()
    size = 1 << int(np.ceil(np.log2(2 * centred.size)))
    spectrum = np.abs(np.fft.rfft(centred, size)) ** 2
    return np.asarray(np.fft.irfft(spectrum, size)[: lags + 1] / centred.size)


def noise_colour(residual: Array, parameters: int) -> NoiseColour:
    """Autoregressive model of a residual, its order chosen by BIC; `parameters` were fitted to leave it."""
    samples = residual.size
    freedom = max(samples - parameters, 1)
    highest = int(min(40, max(samples // 10, 1)))
    covariance = autocorrelation(residual, highest) * samples / freedom
    best = (np.inf, np.ones(1), float(np.sqrt(max(covariance[0], 0.0))))
    if covariance[0] > 0.0:
        for order in range(highest + 1):
            coefficients = np.ones(1)
            if order:
                coefficients = np.append(1.0, -solve_toeplitz(covariance[:order], covariance[1 : order + 1]))
            variance = float(coefficients @ covariance[: order + 1])
            if variance <= 0.0:
                break
            score = samples * np.log(variance) + order * np.log(samples)
            if score < best[0]:
                best = (score, coefficients, float(np.sqrt(variance)))
    _, coefficients, std = best
    impulse = np.zeros(4096)
    impulse[0] = 1.0
    shape = autocorrelation_of_filter(lfilter([1.0], coefficients, impulse))
    correlation_samples = 1.0 + 2.0 * float(np.sum((shape[1:] / shape[0]) ** 2))
    return NoiseColour(coefficients, std, samples / correlation_samples)


def autocorrelation_of_filter(impulse_response: Array) -> Array:
    """Autocovariance of white noise through a filter, lags 0..n-1."""
    size = 2 * impulse_response.size
    spectrum = np.abs(np.fft.rfft(impulse_response, size)) ** 2
    return np.asarray(np.fft.irfft(spectrum, size)[: impulse_response.size])


@dataclass(frozen=True, slots=True)
class CheckResult:
    """A residual test: passes where the statistic does not exceed the 99 % limit."""

    name: str
    statistic: float
    limit: float

    @property
    def passed(self) -> bool:
        """Whether nothing speaks against the model."""
        return self.statistic <= self.limit


def whiteness(residual: Array, lags: int = 25) -> CheckResult:
    """Ljung-Box test that the residual is white (Ljung and Box 1978)."""
    samples = residual.size
    lags = min(lags, samples // 4)
    covariance = autocorrelation(residual, lags)
    rho = covariance[1:] / covariance[0] if covariance[0] > 0.0 else np.zeros(lags)
    statistic = samples * (samples + 2.0) * float(np.sum(rho**2 / (samples - np.arange(1, lags + 1))))
    return CheckResult("residual is white", statistic, float(chdtri(lags, 0.01)))


def independence(residual: Array, signal: Array, colour: NoiseColour, name: str, lags: int = 25) -> CheckResult:
    """Test that past inputs do not explain the residual (Ljung 1999, 16.6), its colour removed from both."""
    samples = residual.size
    lags = min(lags, samples // 4)
    white = lfilter(colour.coefficients, [1.0], residual - residual.mean())[colour.order :]
    driven = lfilter(colour.coefficients, [1.0], signal - signal.mean())[colour.order :]
    rows = np.stack([driven[lags - lag : driven.size - lag] for lag in range(lags)])
    target = white[lags:]
    gram = rows @ rows.T
    cross = rows @ target
    variance = float(np.var(target))
    if variance == 0.0:
        return CheckResult(name, 0.0, float(chdtri(lags, 0.01)))
    rank = int(np.linalg.matrix_rank(gram, hermitian=True))
    statistic = float(cross @ np.linalg.pinv(gram, hermitian=True) @ cross) / variance
    return CheckResult(name, statistic, float(chdtri(max(rank, 1), 0.01)))
