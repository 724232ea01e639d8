"""Forward selection: every candidate fitted jointly with the nominal parameters, then pairs and triples."""

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..core.models import PathSpec
from .candidates import Candidate, Freed, hypothesis, in_vocabulary, library, plain_starts, refined_starts
from .hypothesis_fit import Fit, fit_hypothesis
from .noise import effective_samples, noise_floor
from .problem import Hypothesis, Problem, Term

Array = NDArray[np.float64]
Progress = Callable[[str], None]


@dataclass(frozen=True, slots=True)
class Explanation:
    """A set of effects fitted to a channel. `freed`: the parameters of each that the fit moved."""

    fit: Fit
    added: tuple[str, ...]
    freed: Freed

    @property
    def inside(self) -> bool:
        """Whether all of it may be named."""
        return all(in_vocabulary(name) for name in self.added)


@dataclass(frozen=True, slots=True)
class Bench:
    """One channel's problem with what all its fits share."""

    problem: Problem
    nominal: tuple[Term, ...]
    jobs: int = 1
    progress: Progress | None = None


# A residual below this share of the signal is form error that no one would call a gap.
NEGLIGIBLE = 1e-3
# Twice the log prior odds against forms that are rarely what a name means.
UNUSUAL = {("backlash", "input"): 4.0, ("overflow", "output"): 1.0}


def penalised(problem: Problem, explanation: Explanation, samples: float) -> float:
    """Twice the negative log-likelihood with `samples` effective samples, priors and complexity (BIC) included."""
    fit = explanation.fit
    count = len(problem.measured)
    negligible = count * (NEGLIGIBLE * problem.signal / problem.sigma) ** 2
    unusual = sum(UNUSUAL.get((e.name, e.at.value if e.at else ""), 0.0) for e in fit.path.effects)
    complexity = fit.freedoms * np.log(max(samples, 2.0)) + unusual
    return float(samples * np.log((fit.rss + negligible) / count) + fit.penalty + complexity)


def fit_null(bench: Bench, path: PathSpec) -> Explanation:
    """The path with its nominal parameters alone refitted."""
    fit = fit_hypothesis(bench.problem, Hypothesis(path, bench.nominal), iterations=12)
    return Explanation(fit, (), {})


def fit_candidate(bench: Bench, base: Explanation, candidate: Candidate) -> Explanation:
    """One more effect on a base, plain then refined; the refined form only where it earns its parameters."""
    problem = bench.problem
    base_freed = {name: freed for name, freed in base.freed.items() if name != candidate.name}
    added = (*(name for name in base.added if name != candidate.name), candidate.name)
    freed = {**base_freed, candidate.name: candidate.required}
    paths = plain_starts(problem, base.fit.path, candidate, base.fit.residual)
    hypotheses = [hypothesis(problem, path, bench.nominal, freed) for path in paths]
    starts = [h.start() for h in hypotheses]
    # A null refit may have bent the nominal parameters far off to hide the effect: begin from the given ones too.
    centres = np.array([term.centre for term in bench.nominal])
    starts += [np.concatenate([centres, x[len(centres) :]]) for x in starts]
    fit = fit_hypothesis(problem, hypotheses[0], starts, keep=3)
    plain = Explanation(fit, added, freed)
    if not candidate.optional:
        return plain
    freed = {**base_freed, candidate.name: candidate.required + candidate.optional}
    paths = refined_starts(problem, fit.path, candidate, base.fit.residual)
    hypotheses = [hypothesis(problem, path, bench.nominal, freed) for path in paths]
    finer = fit_hypothesis(problem, hypotheses[0], [h.start() for h in hypotheses], keep=2)
    refined = Explanation(finer, added, freed)
    samples = effective_samples(finer.residual)
    return min(plain, refined, key=lambda e: penalised(problem, e, samples))


def scan(
    bench: Bench, bases: Iterable[Explanation], candidates: Sequence[Candidate] | None = None
) -> tuple[Explanation, ...]:
    """Every candidate on every base, best first by cost; the same whatever the number of workers."""
    pool = library(bench.problem.channel) if candidates is None else candidates
    tasks = [(base, c) for base in bases for c in pool if c.name not in base.added]

    def work(task: tuple[Explanation, Candidate]) -> Explanation:
        base, candidate = task
        if bench.progress is not None:
            names = " + ".join((*base.added, candidate.name))
            bench.progress(f"{bench.problem.channel.value}: {names}")
        return fit_candidate(bench, base, candidate)

    if bench.jobs > 1 and len(tasks) > 1:
        with ThreadPoolExecutor(bench.jobs) as workers:
            found = list(workers.map(work, tasks))
    else:
        found = [work(task) for task in tasks]
    best: dict[tuple[str, ...], Explanation] = {}
    for explanation in found:
        key = tuple(sorted(explanation.added))
        if key not in best or explanation.fit.fitted.cost < best[key].fit.fitted.cost:
            best[key] = explanation
    return tuple(sorted(best.values(), key=lambda e: (e.fit.fitted.cost, e.added)))


def floor_of(problem: Problem, explanations: Sequence[Explanation]) -> float:
    """Noise floor (unit of the channel) seen in the residuals of the best explanations."""
    return min(noise_floor(problem.measured, e.fit.residual) for e in explanations)
