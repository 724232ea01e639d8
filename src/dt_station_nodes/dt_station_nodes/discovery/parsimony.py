"""Each explanation in its simplest form: refinements that the data do not hold go back to a plain value."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import partial

import numpy as np

from ..core.models import PathSpec
from ..core.models.effects import registry
from .candidates import hypothesis
from .foremost import alike_here, foremost
from .hypothesis_fit import Fit, fit_hypothesis
from .measure import Measure
from .selection import Bench, Explanation, exchanged
from .strangers import SAME
from .terms import Hypothesis

# A refinement that changes nothing goes,
_NOTHING = 0.01
# and one that a bound holds there: free, it may let the numbers beside it move on the validation run by as little.
_HELD = 1.0
# Fits about one that ended begin at these times its effects' numbers.
_AROUND = (0.95, 1.05)
_ROUNDS = 3
# Times its first number at which an effect's other form begins.
_SIZES = (0.7, 0.8, 0.85, 0.9, 0.95, 1.05, 1.1, 1.2)


def _set(path: PathSpec, effect: int, name: str, value: float) -> PathSpec:
    """The path with one parameter at a value."""
    specs = list(path.effects)
    spec = specs[effect]
    specs[effect] = spec.model_copy(update={"parameters": {**spec.parameters, name: value}})
    return path.model_copy(update={"effects": tuple(specs)})


def at_usual(bench: Bench, name: str, forms: Mapping[str, Explanation]) -> list[Explanation]:
    """Forms of an effect, each with one parameter free that refines it, with that at its usual value; not judged.

    A choice of form costs nothing: among forms that the run does not tell apart it is the likelier one.
    """
    costs = {parameter: max(form.fit.fitted.cost, 1e-300) for parameter, form in forms.items()}
    found = []
    for parameter, form in forms.items():
        usual = registry()[name].parameter(parameter).usual
        if not usual or bench.worth(form) * np.log(costs[parameter] / min(costs.values())) > SAME:
            continue
        effect = next(index for index, spec in enumerate(form.fit.path.effects) if spec.name == name)
        here = form.fit.path.effects[effect].parameters[parameter]
        path = _set(form.fit.path, effect, parameter, min(usual, key=lambda value: abs(value - here)))
        freed = {**form.freed, name: tuple(p for p in form.freed[name] if p != parameter)}
        fit = fit_hypothesis(bench.problem, hypothesis(bench.problem, path, bench.nominal, freed), iterations=4)
        found.append(bench.explained(fit, form.added, freed, glance=True))
    return found


def as_near(bench: Bench, best: Explanation, others: Iterable[Fit]) -> tuple[Explanation, ...]:
    """Other ends of a form's fit that the run does not tell from its `best`, for the validation run to tell."""
    if bench.check is None or bench.rough:
        return ()
    cost, worth = max(best.fit.fitted.cost, 1e-300), bench.worth(best)
    near = (fit for fit in others if worth * np.log(max(fit.fitted.cost, 1e-300) / cost) < SAME)
    return tuple(bench.explained(fit, best.added, best.freed, glance=True) for fit in near)


def _doubtful(explanation: Explanation, measure: Measure) -> list[tuple[int, str, float]]:
    """Freed refinements (effect, name), a plain value for each: what may do nothing first, the least sure to be off."""
    fit = explanation.fit
    samples = measure.samples * len(fit.residual) / measure.bench.count
    covariance = fit.fitted.covariance(samples, len(fit.residual))
    found = []
    for index, term in enumerate(fit.hypothesis.terms):
        if term.effect < 0:
            continue
        spec = fit.path.effects[term.effect]
        parameter = registry()[spec.name].parameter(term.name)
        if not parameter.optional or spec.parameters[term.name] == parameter.neutral or term.logarithmic:
            continue
        for value in (parameter.neutral, *parameter.usual):
            away = float(fit.fitted.x[index]) - term.to_x(value)
            sure = away**2 / max(float(covariance[index, index]), 1e-300)
            found.append((value != parameter.neutral, sure, term.effect, term.name, value))
    return [(effect, name, value) for *_, effect, name, value in sorted(found)]


def _plain(explanation: Explanation, doubtful: list[tuple[int, str, float]]) -> list[list[tuple[int, str, float]]]:
    """All doubtful refinements of an effect at once, each at its nearest plain value or doing nothing; if several."""
    found = []
    for effect, spec in enumerate(explanation.fit.path.effects):
        nearest: dict[str, float] = {}
        neutral = {name: registry()[spec.name].parameter(name).neutral for i, name, _ in doubtful if i == effect}
        for _, name, value in (one for one in doubtful if one[0] == effect):
            here = spec.parameters[name]
            if name not in nearest or abs(value - here) < abs(nearest[name] - here):
                nearest[name] = value
        if len(nearest) > 1:
            values = [nearest] if nearest == neutral else [nearest, neutral]
            found += [[(effect, name, value) for name, value in one.items()] for one in values]
    return found


def _held(explanation: Explanation) -> list[list[tuple[int, str, float]]]:
    """Freed refinements of each effect that a bound holds at doing nothing."""
    found = []
    for effect, spec in enumerate(explanation.fit.path.effects):
        free = (registry()[spec.name].parameter(name) for name in explanation.freed.get(spec.name, ()))
        held = [(effect, p.name, p.neutral) for p in free if p.optional and spec.parameters[p.name] == p.neutral]
        found += [held] if held else []
    return found


def left_out(bench: Bench, explanation: Explanation, less: list[tuple[int, str, float]]) -> Explanation:
    """The explanation with refinements (effect, name) of one effect at the values given; not judged."""
    path = explanation.fit.path
    for effect, name, value in less:
        path = _set(path, effect, name, value)
    own, names = path.effects[less[0][0]].name, {name for _, name, _ in less}
    freed = {**explanation.freed, own: tuple(p for p in explanation.freed.get(own, ()) if p not in names)}
    begin = hypothesis(bench.problem, path, bench.nominal, freed)
    # In another form the effect is of another size: a dead zone that jumps open is wider than one that does not.
    main = next((i for i, term in enumerate(begin.terms) if term.effect == less[0][0]), None)
    chosen = any(p.tried_first and p.apart for p in map(registry()[own].parameter, names))
    starts = [begin.start()]
    if main is not None and chosen:
        starts += [np.where(np.arange(len(starts[0])) == main, size * starts[0], starts[0]) for size in _SIZES]
    fit = fit_hypothesis(bench.problem, begin, starts, iterations=10, keep=1)
    return bench.explained(fit, explanation.added, freed)


def without(bench: Bench, explanation: Explanation, name: str, parameters: Iterable[str]) -> Explanation:
    """The explanation with some refinements of an effect doing nothing; not judged."""
    effect = next(index for index, spec in enumerate(explanation.fit.path.effects) if spec.name == name)
    return left_out(bench, explanation, [(effect, p, registry()[name].parameter(p).neutral) for p in parameters])


def _simpler(bench: Bench, explanation: Explanation, measure: Measure) -> Explanation | None:
    """The explanation without an effect's refinements, or one of them, if that scores better; else None.

    Refinements that undo each other cannot be left out one by one.
    """
    doubtful = _doubtful(explanation, measure)
    plainer = [*_plain(explanation, doubtful), *([one] for one in doubtful)]
    for less, worth in [*((one, _NOTHING) for one in plainer), *((one, _HELD) for one in _held(explanation))]:
        found = bench.judged(left_out(bench, explanation, less))
        if measure.score(found) < measure.score(explanation) + worth:
            return found
    return None


def _same(bench: Bench, one: PathSpec, other: PathSpec) -> bool:
    """Whether two paths are one on both runs: an end that this one does not come to may be told by the other."""
    return all(np.array_equal(problem.residual(one), problem.residual(other)) for problem in bench.problems)


def _rested(bench: Bench, explanation: Explanation) -> Explanation:
    """The explanation with numbers that do nothing at the value that says so."""
    fit = explanation.fit
    path, freed = fit.path, dict(explanation.freed)
    kept = list(range(fit.freedoms))
    for index in np.flatnonzero(fit.fitted.idle):
        term = fit.hypothesis.terms[index]
        if term.effect < 0:
            continue
        own = path.effects[term.effect].name
        rested = _set(path, term.effect, term.name, registry()[own].parameter(term.name).neutral)
        if _same(bench, path, rested):
            path = rested
            freed[own] = tuple(p for p in freed.get(own, ()) if p != term.name)
            kept.remove(int(index))
    if path is fit.path:
        return explanation
    # Both runs are answered as before, so what was fitted and settled stands.
    fitted = replace(fit.fitted, x=fit.fitted.x[kept], jacobian=fit.fitted.jacobian[:, kept])
    less = Hypothesis(path, tuple(fit.hypothesis.terms[index] for index in kept))
    return replace(explanation, fit=replace(fit, hypothesis=less, path=path, fitted=fitted), freed=freed)


def _around(bench: Bench, explanation: Explanation) -> Explanation:
    """The explanation from the best of the minima about it, where stick and slip make these many and shallow."""
    if "friction" not in explanation.added:
        return explanation
    fit = explanation.fit
    for _ in range(_ROUNDS):
        starts = [fit.hypothesis.scaled(fit.fitted.x, factor) for factor in _AROUND]
        found = min((fit_hypothesis(bench.problem, fit.hypothesis, [x]) for x in starts), key=lambda f: f.fitted.cost)
        if found.fitted.cost >= fit.fitted.cost:
            break
        fit = found
    if fit is explanation.fit:
        return explanation
    return bench.judged(bench.explained(fit, explanation.added, explanation.freed))


def told_exactly(bench: Bench, known: Iterable[Explanation], measure: Measure) -> list[Explanation]:
    """What is known, those near the best, or that the run itself does not tell from it, judged by both exactly."""
    listed = list(known)
    if bench.rough or bench.check is None:
        return listed
    near = foremost(listed, measure)
    near += [e for e in alike_here(listed, near, measure) if e not in near]
    return exchanged(listed, near, bench.workers.results(partial(bench.alone.settled, exactly=True), near))


def simplified(bench: Bench, known: Iterable[Explanation], measure: Measure) -> list[Explanation]:
    """What is known, those near the best in their simplest form; in the order they came."""
    listed = list(known)
    if bench.rough:
        return listed
    near = foremost(listed, measure)
    simpler = bench.workers.results(partial(_simplest, replace(measure, bench=bench.alone)), near)
    # What another process hands back unchanged is a copy: what is known stays what it was.
    return exchanged(listed, near, [found or e for e, found in zip(near, simpler, strict=True)])


def _simplest(measure: Measure, explanation: Explanation) -> Explanation | None:
    """An explanation in its simplest form, if that is another."""
    bench = measure.bench
    best = _rested(bench, explanation)
    simpler = _simpler(bench, best, measure)
    while simpler is not None:
        best, simpler = simpler, _simpler(bench, simpler, measure)
    # A lower minimum of the run that foretells the other worse is none.
    best = min((best, _around(bench, best)), key=measure.score)
    return None if best is explanation else best
