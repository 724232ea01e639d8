"""Which explanations are worth a closer look: those near the best, and those that a run does not tell from it."""

from collections.abc import Sequence

import numpy as np

from .measure import Measure
from .selection import Explanation
from .strangers import SAME

# The best few are looked at whatever they are worth: a form bent to one run may fail on the other.
_BEST = 3
# Of the others, explanations so far behind cannot come to anything by being simpler.
_BEHIND = 80.0
_MOST = 8


def foremost(known: Sequence[Explanation], measure: Measure) -> list[Explanation]:
    """Those near the best, best first; a form that is never named takes no place of one that could be."""
    ranked = sorted((e for e in known if e.added), key=measure.score)
    places = [index for index, e in enumerate(ranked) if e.inside][:_MOST]
    behind = ranked[_BEST : places[-1] + 1] if places else []
    return [*ranked[:_BEST], *(e for e in behind if measure.score(e) - measure.score(ranked[0]) < _BEHIND)]


def alike_here(known: Sequence[Explanation], near: Sequence[Explanation], measure: Measure) -> list[Explanation]:
    """Those of as few names that fit the run itself as well as the best of those `near`."""
    if not near:
        return []
    best = max(near[0].fit.fitted.cost, 1e-300)
    few = (e for e in known if 0 < len(e.added) <= len(near[0].added))
    alike = (e for e in few if measure.samples * np.log(max(e.fit.fitted.cost, 1e-300) / best) < SAME)
    return sorted(alike, key=lambda e: e.fit.fitted.cost)[:_BEST]
