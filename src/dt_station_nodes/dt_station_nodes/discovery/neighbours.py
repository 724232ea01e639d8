"""Sets beside a found one: less one effect, with one exchanged, the best form of each."""

from collections.abc import Iterable
from dataclasses import replace

from .candidates import hypothesis
from .hypothesis_fit import fit_hypothesis
from .search import scan
from .selection import Bench, Explanation


def _without(bench: Bench, explanation: Explanation, name: str) -> Explanation:
    """An explanation less one effect, the others as they were fitted beside it."""
    fit = explanation.fit
    path = fit.path.model_copy(update={"effects": tuple(e for e in fit.path.effects if e.name != name)})
    residual = bench.problem.residual(path)
    bare = replace(fit, path=path, residual=residual, rss=float(residual @ residual) / bench.problem.sigma**2)
    freed = {key: value for key, value in explanation.freed.items() if key != name}
    return bench.explained(bare, tuple(n for n in explanation.added if n != name), freed)


def reduced(bench: Bench, explanations: Iterable[Explanation]) -> list[Explanation]:
    """Each set less each of its effects, the rest fitted on from there: a larger set may have found the way for it."""
    found = []
    for explanation in explanations:
        for name in explanation.added:
            bare = _without(bench, explanation, name)
            if not bare.added:
                continue
            start = hypothesis(bench.problem, bare.fit.path, bench.nominal, bare.freed)
            fit = fit_hypothesis(bench.problem, start, iterations=bench.iterations)
            found.append(bench.judged(bench.explained(fit, bare.added, bare.freed)))
    return found


def exchange(bench: Bench, leader: Explanation, most: int, finest: int) -> list[Explanation]:
    """Every candidate in place of each of a set's effects: the order they were found in may have misled the search."""
    return scan(bench, [_without(bench, leader, name) for name in leader.added], most, finest)


def distinct(known: Iterable[Explanation]) -> list[Explanation]:
    """The best explanation of each set of names, in the order the sets came."""
    best: dict[tuple[str, ...], Explanation] = {}
    for explanation in known:
        key = tuple(sorted(explanation.added))
        if key not in best or (key and explanation.fit.fitted.cost < best[key].fit.fitted.cost):
            best[key] = explanation
    return list(best.values())
