"""What makes a set of names doubtful, however far it is ahead of other sets that could be believed."""

from collections.abc import Sequence

from .growth import MISSES
from .measure import Measure
from .selection import Explanation

LEFT_NOISE = 0.2  # of the noise power: what leaves less leaves nothing
DOUBT = 300.0  # a set not believed by itself but so far ahead
DOUBT_SHARE = 0.005  # where the best leaves more than this of the gap,
DOUBT_LEAVES = 0.2  # that leaves so little, says that the one believed is not all


def doubted(best: Explanation, gap: float, others: Sequence[tuple[float, Explanation]], measure: Measure) -> bool:
    """Whether the best set is not to be believed; `others`: how far those that do without it are behind."""
    missed = not measure.rough and measure.missed(best) > MISSES
    return missed or crowded(best.added, measure.left(best), measure) or outdone(best, gap, others, measure)


def crowded(names: tuple[str, ...], left: float, measure: Measure) -> bool:
    """Whether more than two names leave more than noise: together they bend to nearly anything."""
    return not measure.rough and len(names) > 2 and left > LEFT_NOISE * measure.noise


def outdone(best: Explanation, gap: float, others: Sequence[tuple[float, Explanation]], measure: Measure) -> bool:
    """Whether what is not believed by itself says that the best set is not all, far ahead of it as it is."""
    left = measure.left(best)
    if left <= max(LEFT_NOISE * measure.noise, DOUBT_SHARE * gap):
        return False
    return any(behind < -DOUBT and measure.left(e) < DOUBT_LEAVES * left for behind, e in others)
