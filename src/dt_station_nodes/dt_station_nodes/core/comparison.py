"""How well a simulated signal follows a measured one: ISE, RMS and fit, running or over whole arrays."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from .errors import StationError
from .summation import CompensatedSum, WindowSum

Array = NDArray[np.float64]
_STRIDE = 1 << 16


@dataclass(frozen=True, slots=True)
class Score:
    """Measured minus simulated, in the signal's unit; `fit_percent` = 100 (1 - |residual| / |measured - mean|).

    The fit is 100 for a perfect match and NaN where the measured signal has not moved and the match is not perfect.
    """

    residual: float
    ise: float
    rms: float
    window_rms: float
    fit_percent: float
    samples: int


@dataclass(frozen=True, slots=True)
class ComparisonState:
    """Sums over the samples compared so far; `level` (the first measured value) keeps the squares small."""

    window: WindowSum
    samples: int = 0
    level: float = 0.0
    squares: CompensatedSum = field(default_factory=CompensatedSum)
    deviation: CompensatedSum = field(default_factory=CompensatedSum)
    deviation_squares: CompensatedSum = field(default_factory=CompensatedSum)


class Comparison:
    """Running comparison of one signal: `step(state, measured, simulated) -> state, Score`."""

    __slots__ = ("_window", "sample_time_s")

    def __init__(self, sample_time_s: float, window_s: float = 5.0) -> None:
        if sample_time_s <= 0.0 or window_s < sample_time_s:
            raise StationError(f"the window ({window_s} s) must hold at least one sample of {sample_time_s} s")
        self.sample_time_s = sample_time_s
        self._window = max(1, round(window_s / sample_time_s))

    def initial_state(self) -> ComparisonState:
        """Nothing compared yet."""
        return ComparisonState(WindowSum(self._window))

    def step(self, state: ComparisonState, measured: float, simulated: float) -> tuple[ComparisonState, Score]:
        """Compare one sample. NaN in either is carried into the residual and kept out of the sums."""
        residual = measured - simulated
        if not math.isfinite(residual):
            return state, self._score(state, residual)
        level = state.level if state.samples else measured
        deviation = measured - level
        square = residual * residual
        state = ComparisonState(
            state.window.add(square),
            state.samples + 1,
            level,
            state.squares.add(square),
            state.deviation.add(deviation),
            state.deviation_squares.add(deviation * deviation),
        )
        return state, self._score(state, residual)

    def _score(self, state: ComparisonState, residual: float) -> Score:
        n = state.samples
        if not n:
            return Score(residual, 0.0, 0.0, 0.0, math.nan, 0)
        squares = state.squares.value
        spread = max(0.0, state.deviation_squares.value - state.deviation.value**2 / n)
        return Score(
            residual,
            squares * self.sample_time_s,
            math.sqrt(squares / n),
            math.sqrt(state.window.value / state.window.count),
            fit_percent(squares, spread),
            n,
        )


def fit_percent(residual_squares: float, spread_squares: float) -> float:
    """100 (1 - sqrt(sum of squared residuals / sum of squared deviations from the mean)), percent."""
    if residual_squares == 0.0:
        return 100.0
    if spread_squares <= 0.0:
        return math.nan
    return 100.0 * (1.0 - math.sqrt(residual_squares / spread_squares))


def score(measured: Array, simulated: Array, sample_time_s: float) -> Score:
    """Compare two arrays of shape (n,); samples where either is NaN are left out. Raises StationError."""
    measured, simulated = np.asarray(measured, dtype=np.float64), np.asarray(simulated, dtype=np.float64)
    if measured.shape != simulated.shape or measured.ndim != 1:
        raise StationError(f"cannot compare {measured.shape} measured with {simulated.shape} simulated samples")
    n = sum(len(each) for each, _ in _pieces(measured, simulated))
    if not n:
        raise StationError("nothing to compare: no sample has both a measured and a simulated value")
    squares = math.fsum(x for each, other in _pieces(measured, simulated) for x in ((each - other) ** 2).tolist())
    mean = math.fsum(x for each, _ in _pieces(measured, simulated) for x in each.tolist()) / n
    spread = math.fsum(x for each, _ in _pieces(measured, simulated) for x in ((each - mean) ** 2).tolist())
    rms = math.sqrt(squares / n)
    last = float(measured[-1] - simulated[-1])
    return Score(last, squares * sample_time_s, rms, rms, fit_percent(squares, spread), n)


def _pieces(measured: Array, simulated: Array) -> Iterator[tuple[Array, Array]]:
    """Samples that have both values, a stretch at a time: a day at 50 Hz leaves no room for copies."""
    for at in range(0, len(measured), _STRIDE):
        each, other = measured[at : at + _STRIDE], simulated[at : at + _STRIDE]
        good = np.isfinite(each - other)
        yield (each, other) if good.all() else (each[good], other[good])
