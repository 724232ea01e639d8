"""The frequencies that a residual holds most of."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_FINER = 4  # frequencies per line of the plain spectrum
_SLOWEST_CYCLES = 1.5


def spectral_peaks(residual: Array, sample_time_s: float, count: int = 3) -> list[float]:
    """Frequencies (Hz) of the highest peaks of a residual's (n,) spectrum."""
    n = len(residual)
    power = np.abs(np.fft.rfft((residual - residual.mean()) * np.hanning(n), _FINER * n)) ** 2
    frequencies = np.fft.rfftfreq(_FINER * n, sample_time_s)
    power[frequencies < _SLOWEST_CYCLES / (n * sample_time_s)] = 0.0
    peaks = []
    for _ in range(count):
        k = int(np.argmax(power))
        peaks.append(float(frequencies[k]))
        power[max(0, k - 3 * _FINER) : k + 3 * _FINER + 1] = 0.0
    return peaks
