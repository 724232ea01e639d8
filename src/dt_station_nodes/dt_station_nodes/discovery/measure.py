"""What explanations are measured by: the noise and the effective samples that the best one so far shows."""

import math
from dataclasses import dataclass

from .selection import Bench, Explanation, penalised

FAR_OFF = 4.0  # priors of the nominal parameters, twice the log: one of them off by 2.6 of their widths
LEAD = 0.2  # of what the best misses, both twice a log-likelihood ratio: one that leads by less leads by its form
SEEN = 2.0  # times what no one would call a gap: less is none


@dataclass(frozen=True, slots=True)
class Measure:
    """What gaps are measured with: noise power and effective samples, seen in the best explanation so far."""

    bench: Bench
    floors: tuple[float, ...]
    samples: float
    rough: bool

    @property
    def noise(self) -> float:
        """What noise, and form error not worth a word, would leave."""
        return self.bench.noise(self.floors)

    def score(self, explanation: Explanation) -> float:
        """Penalised misfit."""
        return penalised(self.bench, explanation, self.samples, self.floors)

    def left(self, explanation: Explanation) -> float:
        """What an explanation leaves beyond noise."""
        return max(self.bench.misfit(explanation, self.floors) - self.noise, 0.0)

    def missed_by(self, explanation: Explanation) -> float:
        """Twice the log-likelihood ratio by which an explanation misses the runs beyond noise."""
        return self.samples * math.log1p(self.left(explanation) / max(self.noise, 1e-300))

    def told(self, before: Explanation, after: Explanation) -> list[float]:
        """What each run says for one explanation over another: twice the log-likelihood ratio."""
        bench = self.bench
        pairs = zip(bench.misfits(before, self.floors), bench.misfits(after, self.floors), strict=True)
        worths = (self.samples * len(problem.measured) / bench.count for problem in bench.problems)
        return [worth * math.log(one / other) for worth, (one, other) in zip(worths, pairs, strict=True)]

    def bent(self, explanation: Explanation) -> bool:
        """Whether nominal parameters are so far off that a further effect may hide behind them."""
        return not self.rough and explanation.fit.penalty > FAR_OFF

    def seen(self, explanation: Explanation) -> bool:
        """Whether an explanation leaves more than form error and the measured load's errors on any run."""
        gaps = self.gaps(explanation)
        return any(gap > (SEEN * p.negligible) ** 2 for p, gap in zip(self.bench.problems, gaps, strict=True))

    def missed(self, explanation: Explanation) -> float:
        """What an explanation misses beyond noise, RMS, of the signal of the run where that is most."""
        gaps = zip(self.bench.problems, self.gaps(explanation), strict=True)
        return max(max(gap, 0.0) ** 0.5 / p.signal for p, gap in gaps)

    def gaps(self, explanation: Explanation) -> list[float]:
        """Mean squares beyond noise (unit^2) on each run."""
        runs = zip(self.bench.problems, explanation.powers, self.floors, strict=True)
        return [power / len(p.measured) - floor for p, power, floor in runs]


def take_measure(bench: Bench, known: list[Explanation]) -> Measure:
    """The measure that the best explanation so far gives."""
    nearest = min(known, key=lambda e: e.fit.rss)
    return Measure(bench, bench.floors(nearest), bench.worth(nearest), bench.rough)
