"""Re-anchored windows: what is compared of a path that integrates, so that drift does not swamp the rest."""

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Windows:
    """Consecutive windows of a run; `anchored` ones have their own free offset, with `trend` a free slope too.

    `edges`: window borders, shape (windows + 1,), first 0, last n.
    """

    edges: NDArray[np.int64]
    anchored: bool
    trend: bool = False

    def project(self, residual: Array) -> Array:
        """The residual (n,) less each window's mean where windows are anchored, else as it is."""
        if not self.anchored:
            return residual
        level = _level(residual, self.edges)
        if not self.trend:
            return level
        starts = self.edges[:-1]
        lengths = np.diff(self.edges)
        time = np.arange(len(residual)) - np.repeat(starts + 0.5 * (lengths - 1), lengths)
        slopes = np.add.reduceat(level * time, starts) / np.maximum(np.add.reduceat(time * time, starts), 1e-300)
        return level - np.repeat(slopes, lengths) * time

    @property
    def freedoms(self) -> int:
        """Offsets and slopes estimated."""
        return (len(self.edges) - 1) * (2 if self.trend else 1) if self.anchored else 0

    def blocks(self, count: int) -> NDArray[np.int64]:
        """Fold number of each sample, shape (n,): contiguous groups of windows dealt in turn to `count` folds."""
        folds = np.arange(len(self.edges) - 1) % count
        return np.repeat(folds, np.diff(self.edges))


def make_windows(
    samples: int, sample_time_s: float, window_s: float, anchored: bool, trend: bool = False, first: int = 0
) -> Windows:
    """Windows of nearly equal length of about `window_s`; at least two where the run allows, one if it is infinite.

    The `first` samples, where given, are a window of their own: what they say of the start leaves the others alone.
    """
    count = max(1 if window_s == np.inf else 2, round((samples - first) * sample_time_s / window_s))
    count = min(count, max(1, (samples - first) // 8))
    edges = np.linspace(first, samples, count + 1).round().astype(np.int64)
    return Windows(np.concatenate([[0], edges]) if first > 0 else edges, anchored, trend)


@njit(cache=True)
def _level(values: Array, edges: NDArray[np.int64]) -> Array:
    """Values (n,) less each window's mean, between `edges` (windows + 1,)."""
    level = np.empty(values.size)
    for k in range(edges.size - 1):
        first, end = edges[k], edges[k + 1]
        total = 0.0
        for i in range(first, end):
            total += values[i]
        mean = total / (end - first)
        for i in range(first, end):
            level[i] = values[i] - mean
    return level
