"""Re-anchored windows: what is compared of a path that integrates, so that drift does not swamp the rest."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Windows:
    """Consecutive windows of a run; `anchored` ones have their own free offset.

    `edges`: window borders, shape (windows + 1,), first 0, last n.
    """

    edges: NDArray[np.int64]
    anchored: bool

    def project(self, residual: Array) -> Array:
        """The residual (n,) less each window's mean where windows are anchored, else as it is."""
        if not self.anchored:
            return residual
        starts = self.edges[:-1]
        lengths = np.diff(self.edges)
        means = np.add.reduceat(residual, starts) / lengths
        return residual - np.repeat(means, lengths)

    @property
    def freedoms(self) -> int:
        """Offsets estimated."""
        return len(self.edges) - 1 if self.anchored else 0

    def blocks(self, count: int) -> NDArray[np.int64]:
        """Fold number of each sample, shape (n,): contiguous groups of windows dealt in turn to `count` folds."""
        folds = np.arange(len(self.edges) - 1) % count
        return np.repeat(folds, np.diff(self.edges))


def make_windows(samples: int, sample_time_s: float, window_s: float, anchored: bool) -> Windows:
    """Windows of nearly equal length of about `window_s`; at least two where the run allows."""
    count = max(2, round(samples * sample_time_s / window_s))
    count = min(count, max(1, samples // 8))
    edges = np.linspace(0, samples, count + 1).round().astype(np.int64)
    return Windows(edges, anchored)
