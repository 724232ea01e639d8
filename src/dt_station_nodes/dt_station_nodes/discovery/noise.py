"""How small a gap can get: the noise floor, estimated from the data themselves."""

from math import comb

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_ORDER = 4
_GAIN = float(sum(comb(_ORDER, k) ** 2 for k in range(_ORDER + 1))) ** 0.5
# Mean square of the smallest nine tenths of normal deviates, over the variance.
_TRIMMED = 0.6231
# Mean squared autocorrelation, over that of white noise, below which a residual is taken for noise alone.
_WHITE = 2.0


def difference_noise(signal: Array) -> float:
    """Standard deviation of the white part of a signal (n,), by its fourth differences less their largest tenth.

    Smooth movement cancels in the differences; jumps are among those left out.
    """
    if len(signal) < 3 * _ORDER:
        return 0.0
    sizes = np.sort(np.abs(np.diff(signal, _ORDER)))
    kept = sizes[: int(np.ceil(0.9 * len(sizes)))]
    return float(np.sqrt(np.mean(kept**2) / _TRIMMED) / _GAIN)


def quantisation_step(signal: Array) -> float:
    """Smallest step between distinct values where the signal is clearly quantised, else 0."""
    values = np.unique(signal)
    if len(values) < 3 or len(values) > len(signal) // 2:
        return 0.0
    steps = np.diff(values)
    smallest = float(steps.min())
    multiples = steps / smallest
    return smallest if float(np.abs(multiples - np.round(multiples)).max()) < 0.05 else 0.0


def noise_floor(measured: Array, residual: Array) -> float:
    """Standard deviation (unit of the signal) that no model can get under on these data.

    `residual` is the gap of the best model at hand: what is smooth in the signal is already
    taken out of it, and a white one is noise altogether. Quantisation counts as its uniform noise; a
    relative 1e-5 keeps noise-free data from a floor of zero.
    """
    white = min(difference_noise(measured), difference_noise(residual))
    if whiteness(residual) < _WHITE:
        white = max(white, min(float(np.std(residual)), 1.3 * white))
    quantised = quantisation_step(measured) / 12**0.5
    return max(white, quantised, 1e-5 * float(np.std(measured)), 1e-12 * float(np.abs(measured).max(initial=0.0)))


def effective_samples(residual: Array, max_lag: int = 200) -> float:
    """Number of independent samples a residual (n,) is worth: n / (1 + 2 sum rho^2)-style, for log-likelihoods.

    The sum of squared autocorrelations governs the variance of a mean square (Bartlett); lags end
    where they are within chance.
    """
    n = len(residual)
    centred = residual - residual.mean()
    power = float(centred @ centred)
    if n < 16 or power <= 0.0:
        return float(n)
    size = 1 << (2 * n - 1).bit_length()
    spectrum = np.fft.rfft(centred, size)
    rho = np.fft.irfft(spectrum * np.conj(spectrum), size)[1 : min(max_lag, n // 4)] / power
    quiet = np.abs(rho) < 2.0 / n**0.5
    stop = int(np.argmax(quiet)) if quiet.any() else len(rho)
    return float(n / (1.0 + 2.0 * float(np.sum(rho[:stop] ** 2))))


def whiteness(residual: Array, lags: int = 20) -> float:
    """Mean squared autocorrelation over `lags`, times n: 1 for white noise, large where structure is left."""
    n = len(residual)
    centred = residual - residual.mean()
    power = float(centred @ centred)
    if n <= lags + 1 or power <= 0.0:
        return 1.0
    rho = np.array([float(centred[:-lag] @ centred[lag:]) / power for lag in range(1, lags + 1)])
    return float(n * np.mean(rho**2))
