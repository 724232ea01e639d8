"""Of explanations with the same names, the one that counts."""

from collections.abc import Iterable

from .selection import Bench, Explanation, penalised


def distinct(bench: Bench, known: Iterable[Explanation]) -> list[Explanation]:
    """The best explanation of each set of names, in the order the sets came.

    An effect at one place may fit a run as well as at another and foretell the next one better.
    """
    listed = list(known)
    if not listed:
        return []
    nearest = min(listed, key=lambda e: e.fit.fitted.cost)
    samples, floors = bench.worth(nearest), bench.floors(nearest)
    best: dict[tuple[str, ...], tuple[tuple[bool, float], Explanation]] = {}
    for explanation in listed:
        key = tuple(sorted(explanation.added))
        score = explanation.hollow, penalised(bench, explanation, samples, floors)
        if key not in best or (key and score < best[key][0]):
            best[key] = (score, explanation)
    return [explanation for _, explanation in best.values()]
