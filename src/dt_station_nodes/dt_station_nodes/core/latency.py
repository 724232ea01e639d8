"""A histogram of delays with fixed memory: percentiles to 2 %, the maximum exactly."""

import math
from dataclasses import dataclass, field

_PER_DECADE = 128
_LOWEST_S = 1e-6
_BINS = 8 * _PER_DECADE


@dataclass(slots=True)
class LatencyHistogram:
    """Counts delays (s) in 128 bins a decade from 1 us to 100 s. Mutable: an accumulator, not a value."""

    count: int = 0
    maximum_s: float = 0.0
    bins: list[int] = field(default_factory=lambda: [0] * _BINS)

    def add(self, delay_s: float) -> None:
        """Count one delay."""
        self.count += 1
        self.maximum_s = max(self.maximum_s, delay_s)
        index = 0 if delay_s <= _LOWEST_S else int(math.log10(delay_s / _LOWEST_S) * _PER_DECADE)
        self.bins[min(index, _BINS - 1)] += 1

    def percentile(self, share: float) -> float:
        """The delay (s) that `share` (0..1) of all do not exceed; 0 without any."""
        if not self.count:
            return 0.0
        rank, seen = math.ceil(share * self.count), 0
        for index, number in enumerate(self.bins):
            seen += number
            if seen >= rank:
                return min(self.maximum_s, _LOWEST_S * 10.0 ** ((index + 1) / _PER_DECADE))
        return self.maximum_s
