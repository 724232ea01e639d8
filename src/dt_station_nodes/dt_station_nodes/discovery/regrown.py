"""Sets begun anew from their plain forms: the best one, and those next behind it."""

from collections.abc import Iterable, Sequence
from functools import partial

from ..core.models.effects import registry
from .candidates import Candidate
from .choice import best_set
from .measure import Measure
from .parsimony import without
from .retold import told
from .selection import Bench, Explanation, exchanged
from .strangers import SAME

_MISFIT = 12.0  # twice the log-likelihood ratio by which a single effect misses the runs: it may be another
_MISSED = 0.5  # of the gap, which one behind may leave at most,
_MOST = 4  # of which so many are begun anew


def regrown(
    bench: Bench,
    null: Explanation,
    known: Iterable[Explanation],
    measure: Measure,
    where_full: bool = False,
    begun: Sequence[Explanation] = (),
) -> tuple[list[Explanation], list[Explanation]]:
    """What is known; the best set and those next behind it, grown from their plain forms where that serves them better.

    Beside another effect a form is refined by what helps it most at once, and from there no step may lead on; of the
    many sets tried only the foremost are refined at all. `where_full`: only where the best one leaves noise of the run.
    Plain forms like those `begun` from before would lead to the same again; all that were begun from are given too.
    """
    listed = list(known)
    doubtful = [] if bench.rough or bench.check is None else _doubtful(null, listed, measure, where_full)
    plain = bench.workers.results(partial(_plain, bench.alone), doubtful)
    pairs = zip(doubtful, plain, strict=True)
    anew = [(e, one) for e, one in pairs if not any(_alike(one, other, measure) for other in begun)]
    grown = told(measure, [one for _, one in anew])
    found = [min(e, new, key=measure.score) for (e, _), new in zip(anew, grown, strict=True)]
    return exchanged(listed, [e for e, _ in anew], found), [*begun, *(one for _, one in anew)]


def _alike(one: Explanation, other: Explanation, measure: Measure) -> bool:
    """Whether two plain forms of the same effects are one, found from different sides."""
    places = [[(effect.name, effect.at) for effect in e.fit.path.effects] for e in (one, other)]
    return places[0] == places[1] and abs(measure.score(one) - measure.score(other)) < SAME


def _doubtful(null: Explanation, known: list[Explanation], measure: Measure, where_full: bool) -> list[Explanation]:
    """The best set and those next behind it, as small; of single effects, each refined already, where all miss much."""
    best = best_set(null, known, measure)
    if not best.added or (where_full and not best.fit.full):
        return []
    if len(best.added) == 1 and measure.missed_by(best) < _MISFIT:
        return []
    as_small = [e for e in known if e.inside and 0 < len(e.added) <= len(best.added) and e is not best]
    near = [e for e in as_small if measure.left(e) < _MISSED * measure.left(null)]
    return [best, *sorted(near, key=measure.score)[:_MOST]]


def _plain(bench: Bench, explanation: Explanation) -> Explanation:
    """A set with each of its effects in its plain form, fitted from where it stands."""
    for name in explanation.added:
        spec, free = explanation.fit.path.effect(name), explanation.freed[name]
        others = (p for p in registry()[name].parameters if p.name not in Candidate(name, spec.at).required)
        refined = [p.name for p in others if p.name in free or spec.parameters[p.name] != p.neutral]
        explanation = without(bench, explanation, name, refined) if refined else explanation
    return explanation
