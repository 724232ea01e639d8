"""How small a gap can get: the noise floor, estimated from the data themselves."""

from math import comb

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_ORDER = 4
_GAIN = float(sum(comb(_ORDER, k) ** 2 for k in range(_ORDER + 1))) ** 0.5
# Mean square of the smallest nine tenths of normal deviates, over the variance.
_TRIMMED = 0.6231
# Sizes of normal deviates that an eighth, a quarter and a half of them stay below, over the deviation.
_SHARES = (0.125, 0.25, 0.5)
_QUANTILES = np.array([0.1573, 0.3186, 0.6745])
_ALIKE = (0.05, 0.08)  # how well the smaller quantiles, over the half's, are those of noise
_PAIR_GAIN = 6.0**0.5  # of second differences
_JUMPY = 0.5  # times what the fourth differences say
# Mean squared autocorrelation, over that of white noise, below which a residual is taken for noise alone.
_WHITE = 2.0
_FAST = 0.05  # of a signal's standard deviation: white parts above it may be movement
_PAST = 6  # samples of voltage before
_SAME_VALUE = 1e-9  # of the span: values that differ by less are one
_ONE = 1.4  # times the smallest: gaps between values that are one step
_OFTEN = 0.02  # of the gaps are one step at least
_COUNTED = 8.0  # steps: in wider gaps the step's own error adds up
_ON_GRID = 0.1  # steps


def difference_noise(signal: Array) -> float:
    """Standard deviation of the white part of a signal (n,), by its fourth differences less their largest tenth.

    Smooth movement cancels in the differences; jumps are among those left out. Where a signal jumps every few samples,
    as with a fast sawtooth on it, few fourth differences are left alone: there the smaller half of its second ones says
    it, if they are spread as noise's are.
    """
    if len(signal) < 3 * _ORDER:
        return 0.0
    sizes = np.sort(np.abs(np.diff(signal, _ORDER)))
    kept = sizes[: int(np.ceil(0.9 * len(sizes)))]
    white = float(np.sqrt(np.mean(kept**2) / _TRIMMED) / _GAIN)
    quantiles = np.quantile(np.abs(np.diff(signal, 2)), _SHARES)
    between = float(quantiles[-1] / _QUANTILES[-1]) / _PAIR_GAIN
    if not 0.0 < between < _JUMPY * white:
        return white
    off = np.abs(quantiles / quantiles[-1] - _QUANTILES / _QUANTILES[-1])[:-1]
    return between if bool(np.all(off < _ALIKE)) else white


def quantisation_step(signal: Array) -> float:
    """Smallest step between distinct values where the signal is clearly quantised, else 0.

    Files print counts with a few digits: steps may differ by what rounding does to them.
    """
    values = np.unique(signal)
    gaps = np.diff(values)
    gaps = gaps[gaps > _SAME_VALUE * float(gaps.sum())]
    if len(gaps) < 2:
        return 0.0
    ones = gaps[gaps < _ONE * float(gaps.min())]
    if len(values) > len(signal) // 2 and len(ones) < _OFTEN * len(gaps):
        # Where hardly a value comes twice, only many single steps tell a grid from chance.
        return 0.0
    multiples = gaps / float(ones.mean())
    few = multiples[multiples < _COUNTED]
    return float(ones.mean()) if float(np.abs(few - np.round(few)).max()) < _ON_GRID else 0.0


def driven_noise(measured: Array, voltage: Array) -> float:
    """Standard deviation of the white part of a signal (n,): at most what the voltages (n,) before cannot foretell.

    Where a signal moves as fast as it is sampled its differences are movement, not noise. The voltage of a sample's own
    time acts after it; in a loop it answers the sample's noise.
    """
    white = difference_noise(measured)
    if white < _FAST * float(np.std(measured)) or not np.ptp(voltage) > 0.0:
        return white
    scaled = (voltage - voltage.mean()) / float(np.std(voltage))
    shapes = np.array([scaled, np.abs(scaled), scaled**2, scaled**3])
    count = len(measured) - _PAST
    past = [row[_PAST - lag : len(measured) - lag] for lag in range(1, _PAST + 1) for row in shapes]
    known = np.column_stack([np.ones(count), *past])
    for order in (0, 1):
        target = np.diff(measured, order)[_PAST - order :]
        left = target - known @ np.linalg.lstsq(known, target, rcond=None)[0]
        spare = max(count - known.shape[1], 1)
        white = min(white, float(np.sqrt(left @ left / spare)))
    return white


def noise_floor(measured: Array, residual: Array, noise: float) -> float:
    """Standard deviation (unit of the signal) that no model can get under on these data, of so much white `noise`.

    `residual` is the gap of the best model at hand: what is smooth in the signal is already
    taken out of it, and a white one is noise altogether. Quantisation counts as its uniform noise; a
    relative 1e-5 keeps noise-free data from a floor of zero.
    """
    white = min(noise, difference_noise(residual))
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
