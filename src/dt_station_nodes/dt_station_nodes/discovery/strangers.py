"""Forms outside the vocabulary beside a set of names: which of them makes the names doubtful."""

from collections.abc import Sequence

from ..core.models.effects import registry
from .candidates import in_vocabulary
from .selection import Explanation

SAME = 6.0  # twice the log-likelihood ratio: what is closer is not told apart
TRIFLE = 40.0  # so much more a stranger that holds the names must tell where they leave next to nothing


def stranger(best: Explanation, scored: Sequence[tuple[float, Explanation]], trifling: bool, rough: bool) -> str:
    """The name of the foremost form outside the vocabulary that explains as much as the best set; "" if none does.

    `scored`: how far each explanation is behind the best set, foremost first; `trifling`: that set leaves next to
    nothing. One that holds the names as special cases, and any where data are rough, has to explain clearly more.
    """
    more = TRIFLE if trifling else SAME
    for behind, other in scored:
        if other.inside or len(other.added) > len(best.added):
            continue
        if behind < (-more if rough or _contains(other, best) else SAME):
            return next(name for name in other.added if not in_vocabulary(name))
    return ""


def _contains(other: Explanation, best: Explanation) -> bool:
    special = {case for name in other.added for case in registry()[name].special_cases}
    return set(best.added) <= set(other.added) | special
