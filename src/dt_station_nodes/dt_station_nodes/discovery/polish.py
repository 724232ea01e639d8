"""Last touch on the parameters found: on all samples of a long run, and within short windows of a dense one."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ..core.models import PathSpec
from ..core.models.effects import registry
from ..workers import ALONE, Workers
from .channel import Finding, base_paths
from .earlier import begun_earlier
from .effect_terms import effect_term
from .fit import least_squares
from .hypothesis_fit import Fit, fit_hypothesis
from .noise import difference_noise, noise_floor
from .problem import Problem
from .result import Verdict
from .selection import Explanation
from .terms import Hypothesis
from .timing import without
from .unseen import has_chance
from .windows import make_windows

Array = NDArray[np.float64]

# Data sampled faster than this are polished in windows of so many samples.
DENSE_S = 0.005
SAMPLES = 50
# They must move so far above the noise.
TELLING = 30.0
# Steps of a fit that begins where the search on fewer samples ended.
CARRY = 6
# An effect that, left out, raises the misfit less than this has no part in what forces do.
IDLE = 1.02
# Fits of stick and slip have many shallow minima: begin around the parameters found, and from the best ones again.
AROUND = (1.0, 0.9, 1.1, 0.75, 1.3, 0.6)
AGAIN, NEARBY, TURNS = 4, (0.94, 0.97, 1.0, 1.03, 1.06), 3
# Gain below which a fit begun anew has come no further.
SETTLED = 1e-4
# Rounds of weighing the two anew.
ROUNDS = 4
# In each, steps at most, and what the last one may still gain.
STEPS, CLOSE = 20, 1e-6
# Refinements that a measured force needs as much as its level: its two directions differ.
KEPT = ("asymmetry",)
LEANING = (-0.3, -0.15, 0.0, 0.15, 0.3)


def _textbook(found: Hypothesis) -> Hypothesis:
    """The same effects with their optional parameters back at what changes nothing."""
    effects = []
    optional: set[tuple[int, str]] = set()
    for index, spec in enumerate(found.path.effects):
        rest = [p for p in registry()[spec.name].parameters if p.optional and p.name not in KEPT]
        optional |= {(index, p.name) for p in rest}
        effects.append(spec.model_copy(update={"parameters": {**spec.parameters, **{p.name: p.neutral for p in rest}}}))
    terms = tuple(term for term in found.terms if (term.effect, term.name) not in optional)
    return Hypothesis(found.path.model_copy(update={"effects": tuple(effects)}), terms)


def _refitted_on(problem: Problem, fit: Fit, steps: int) -> Fit:
    hypothesis = Hypothesis(fit.path, fit.hypothesis.terms)
    return fit_hypothesis(problem, hypothesis, [hypothesis.start()], steps)


def _carried(explanation: Explanation, problem: Problem, refit: bool, earlier_s: float) -> Explanation:
    fit = replace(explanation.fit, path=begun_earlier(explanation.fit.path, earlier_s))
    return replace(explanation, fit=_refitted_on(problem, fit, CARRY if refit else 0))


def _less(fit: Fit, name: str) -> Hypothesis:
    """The free numbers without those of one effect."""
    gone = next(index for index, effect in enumerate(fit.path.effects) if effect.name == name)
    terms = tuple(
        replace(term, effect=term.effect - (term.effect > gone)) for term in fit.hypothesis.terms if term.effect != gone
    )
    return Hypothesis(without(fit.path, name), terms)


def _needed(
    fit: Fit,
    added: tuple[str, ...],
    refit: Callable[[Fit], Fit],
    noise: float = np.inf,
    less: Callable[[Fit, str], Hypothesis] = _less,
) -> tuple[Fit, tuple[str, ...]]:
    """A fit of a set less the effects without which it is as good, and the names that stay.

    What explains less than the whole set leaves beyond the `noise` that is in the misfit may be a part of that.
    """
    kept = added
    while len(kept) > 1:
        bare = [replace(fit, path=rest.path, hypothesis=rest) for rest in (less(fit, name) for name in kept)]
        refitted = [refit(one) for one in bare]
        least = min(range(len(kept)), key=lambda i: refitted[i].fitted.cost)
        told, left = refitted[least].fitted.cost - fit.fitted.cost, fit.fitted.cost - noise
        if told >= max((IDLE - 1.0) * fit.fitted.cost, left):
            break
        fit, kept = refitted[least], tuple(name for i, name in enumerate(kept) if i != least)
    return fit, kept


def _keeping(finding: Finding, kept: tuple[str, ...]) -> Finding:
    """A finding with the alternatives of the names that stay."""
    places = [finding.best.added.index(name) for name in kept]
    others = tuple(finding.alternatives[place] for place in places) if finding.alternatives else ()
    return replace(finding, alternatives=others)


def carried_over(finding: Finding, problem: Problem, path: PathSpec, earlier_s: float = 0.0) -> Finding:
    """A finding of a condensed run, brought to the whole of it: numbers refitted, residuals of all samples.

    `earlier_s` (s): how much earlier the whole begins.
    """
    null = _carried(finding.null, problem, not finding.interrupted, earlier_s)
    best = _carried(finding.best, problem, not finding.interrupted, earlier_s) if finding.best.added else null
    if len(best.added) > 1 and not finding.interrupted:
        fit, kept = _needed(best.fit, best.added, lambda bare: _refitted_on(problem, bare, CARRY))
        finding = _keeping(finding, kept)
        best = replace(best, fit=fit, added=kept)
    given = min((problem.residual(base) for base in base_paths(path)), key=lambda r: float(r @ r))
    sigma = noise_floor(problem.measured, best.fit.residual, problem.noise)
    return replace(finding, problem=problem, given=given, null=null, best=best, sigma=sigma)


def polished(finding: Finding, check: Problem | None = None, workers: Workers = ALONE) -> Finding:
    """A named finding with its parameters refitted in short windows, offset and slope of each left free.

    Such windows say too little to choose by, but what they say of forces is free of the drift that all that is not
    modelled leaves in a position. What they leave open, the drift of the free runs decides, that of the validation
    run (`check`) too. Coarsely sampled runs and paths that do not integrate stay as they are.
    """
    problem = finding.problem
    step = problem.simulator.sample_time_s
    if finding.verdict is not Verdict.NAMED or finding.interrupted or not problem.windows.anchored or step > DENSE_S:
        return finding
    windows = make_windows(len(problem.measured), step, SAMPLES * step, True, trend=True)
    near = replace(problem, windows=windows)
    noise = difference_noise(problem.measured)
    if float(np.std(windows.project(problem.measured))) < TELLING * noise:
        return finding
    hiss = len(problem.measured) * (noise / problem.sigma) ** 2
    whole = _refitted(near, workers, finding.best.fit)
    added = finding.best.added
    best, kept = _needed(whole, added, partial(_refitted, near, workers), hiss, partial(_less_or_leaning, near))
    best = _less_adrift(near, best, check)
    residual = problem.residual(best.path)
    seen = replace(best, residual=residual, rss=float(residual @ residual) / problem.sigma**2)
    return replace(_keeping(finding, kept), best=replace(finding.best, fit=seen, added=kept))


def _less_or_leaning(problem: Problem, fit: Fit, name: str) -> Hypothesis:
    """The same, with directions that may differ: that may be what the effect was there for."""
    bare = _less(fit, name)
    path, terms = bare.path, bare.terms
    known = {(term.effect, term.name) for term in terms}
    parameters = ((i, spec, p) for i, spec in enumerate(path.effects) for p in registry()[spec.name].parameters)
    new = ((i, spec, p) for i, spec, p in parameters if p.name in KEPT and (i, p.name) not in known)
    return Hypothesis(path, (*terms, *(effect_term(problem, i, p, spec.place) for i, spec, p in new)))


def _leaning(hypothesis: Hypothesis) -> list[Array]:
    """Starts whose directions differ otherwise."""
    start = hypothesis.start()
    kept = np.array([term.name in KEPT for term in hypothesis.terms])
    return [np.where(kept, lean, start) for lean in LEANING] if kept.any() else []


def _begun(near: Problem, start: tuple[Hypothesis, Array]) -> Fit:
    return fit_hypothesis(near, start[0], [start[1]], iterations=15)


def _settled(near: Problem, fit: Fit) -> Fit:
    """A fit begun anew around where it ended, until that gains nothing."""
    for _ in range(TURNS):
        here = Hypothesis(fit.path, fit.hypothesis.terms)
        best = fit
        for factor in NEARBY:
            start, rival = here.scaled(here.start(), factor), best.fitted.cost
            best = min(best, fit_hypothesis(near, here, [start], 15, rival=rival), key=lambda f: f.fitted.cost)
        if best.fitted.cost >= fit.fitted.cost * (1.0 - SETTLED):
            break
        fit = best
    return fit


def _refitted(near: Problem, workers: Workers, fit: Fit) -> Fit:
    """The effects of a fit, plain and as they are, fitted to a problem; the best."""
    here = Hypothesis(fit.path, fit.hypothesis.terms)
    begun = []
    for hypothesis in (_textbook(here), here):
        starts = [hypothesis.scaled(hypothesis.start(), factor) for factor in AROUND] + _leaning(hypothesis)
        begun += [(hypothesis, x) for x in starts]
    fits = workers.results(partial(_begun, near), begun)
    best = sorted(fits, key=lambda f: f.fitted.cost)[:AGAIN]
    return min(workers.results(partial(_settled, near), best), key=lambda f: f.fitted.cost)


def _less_adrift(near: Problem, fit: Fit, check: Problem | None) -> Fit:
    """A fit to short windows moved to where the runs simulated from their starts drift less, at little cost to them.

    A twin runs free: what forces hardly tell, such as a small standing force, its position adds up. The product of
    the square sums is minimised, so that no unit matters. Each free run counts as often as there are runs: what two
    drift by is less an accident of one.
    """
    hypothesis = Hypothesis(fit.path, fit.hypothesis.terms)
    bounds = hypothesis.bounds
    runs = [near] if check is None or has_chance(fit.path) else [near, check]

    def gaps(x: Array) -> list[Array]:
        path = hypothesis.path_at(x)
        simulated = [run.simulate(path) for run in runs]
        return [near.compare(simulated[0]), *(run.measured - own for run, own in zip(runs, simulated, strict=True))]

    def sizes(x: Array) -> list[float]:
        return [max(float(np.linalg.norm(gap)), 1e-300) for gap in gaps(x)]

    weight = float(len(runs))

    def product(x: Array) -> float:
        windows, *free = np.log(sizes(x))
        return float(windows + weight * sum(free))

    def settled(x: Array) -> Array:
        for _ in range(ROUNDS):
            begun = sizes(x)
            weights = [1.0 / begun[0], *(weight**0.5 / size for size in begun[1:])]

            def parts(x: Array, weights: list[float] = weights) -> Array:
                return np.concatenate([gap * weight for gap, weight in zip(gaps(x), weights, strict=True)])

            x = least_squares(parts, x, bounds[:, 0], bounds[:, 1], hypothesis.steps, STEPS, CLOSE).x
        return x

    x = fit.fitted.x
    for _ in range(TURNS):
        x = min((settled(hypothesis.scaled(x, factor)) for factor in NEARBY), key=product)
    return fit_hypothesis(near, hypothesis, [x], iterations=0)
