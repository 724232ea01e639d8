"""Forward selection: every candidate fitted jointly with the nominal parameters, then pairs and triples."""

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..core.models import PathSpec
from .candidates import Candidate, Freed, hypothesis, in_vocabulary, library, plain_starts, refined_starts
from .held_out import held_out_power
from .hypothesis_fit import Fit, fit_hypothesis
from .noise import effective_samples, noise_floor
from .problem import Problem
from .terms import Hypothesis, Term

Array = NDArray[np.float64]
Progress = Callable[[str], None]
Task = tuple["Explanation", Candidate]


# Twice the log prior odds against forms that are rarely what a name means.
UNUSUAL = {
    ("backlash", "input"): 4.0,
    # Play in a linkage shows in a position; a pressure has none.
    ("backlash", "pressure"): 12.0,
    ("overflow", "output"): 1.0,
    # A search over hundreds of frequencies finds one in any noise.
    ("periodic_disturbance", "position"): 13.0,
    ("periodic_disturbance", "pressure"): 13.0,
    ("periodic_disturbance", "input"): 13.0,
}


_MOST_AFRESH = 150


@dataclass(frozen=True, slots=True)
class Explanation:
    """A set of effects fitted to a channel. `freed`: the parameters of each that the fit moved.

    `powers`: sum of squares (unit^2) on the run and on the validation run, which the fit has not seen; where
    `held`, the run's is that of blocks held out of the fit in turn.
    """

    fit: Fit
    added: tuple[str, ...]
    freed: Freed
    powers: tuple[float, ...]
    unseen: Array | None = None
    held: bool = False

    @property
    def inside(self) -> bool:
        """Whether all of it may be named."""
        return all(in_vocabulary(name) for name in self.added)


@dataclass(frozen=True, slots=True)
class Bench:
    """One channel's problem with what all its fits share."""

    problem: Problem
    nominal: tuple[Term, ...]
    check: Problem | None = None
    jobs: int = 1
    progress: Progress | None = None

    @property
    def iterations(self) -> int:
        """Steps a fit may take: more where a whole linear path is refitted."""
        return 10 if len(self.nominal) <= 3 else 30

    @property
    def rough(self) -> bool:
        """Whether a whole linear path is refitted to data that no model of ours reaches the noise of."""
        return any(term.name.startswith("denominator_") for term in self.nominal)

    @property
    def problems(self) -> tuple[Problem, ...]:
        """The run's problem, and the validation run's where there is one."""
        return (self.problem,) if self.check is None else (self.problem, self.check)

    @property
    def count(self) -> int:
        """Samples compared, of both runs."""
        return sum(len(p.measured) for p in self.problems)

    def explained(self, fit: Fit, added: tuple[str, ...], freed: Freed) -> "Explanation":
        """A fit with its residual on the validation run."""
        powers = [float(fit.residual @ fit.residual)]
        unseen = None
        if self.check is not None:
            unseen = self.check.residual(fit.path)
            powers.append(float(unseen @ unseen))
        return Explanation(fit, added, freed, tuple(powers), unseen)

    def judged(self, explanation: "Explanation") -> "Explanation":
        """As it is judged: where data are rough, by what it says of blocks held out of the fit."""
        if not self.rough or explanation.held:
            return explanation
        power = held_out_power(self.problem, explanation.fit)
        return replace(explanation, powers=(power, *explanation.powers[1:]), held=True)

    def floors(self, explanation: "Explanation") -> tuple[float, ...]:
        """Each run's noise power (unit^2), seen in an explanation's residuals; runs may differ in noise."""
        gaps = (explanation.fit.residual, explanation.unseen)
        found = [noise_floor(p.measured, gap) for p, gap in zip(self.problems, gaps, strict=False) if gap is not None]
        return tuple(sigma**2 for sigma in found)

    def misfits(self, explanation: "Explanation", floors: tuple[float, ...]) -> list[float]:
        """Each run's sum of squares over its own noise; as many as samples where nothing but noise is left."""
        found = []
        for problem, power, floor in zip(self.problems, explanation.powers, floors, strict=True):
            negligible = problem.negligible**2
            found.append((power + len(problem.measured) * negligible) / (floor + negligible))
        return found

    def misfit(self, explanation: "Explanation", floors: tuple[float, ...]) -> float:
        """Their sum."""
        return sum(self.misfits(explanation, floors))

    def noise(self, floors: tuple[float, ...]) -> float:
        """What noise alone leaves of `misfit`: samples, less those that windows' offsets take."""
        total = float(self.count)
        for problem, floor in zip(self.problems, floors, strict=True):
            lost = len(problem.measured) - float(problem.weights.sum()) + problem.windows.freedoms
            total -= lost * floor / (floor + problem.negligible**2)
        return total

    def worth(self, explanation: "Explanation") -> float:
        """Effective number of samples of both runs, by an explanation's residual."""
        residual = explanation.fit.residual
        return effective_samples(residual) * self.count / len(residual)


def penalised(bench: Bench, explanation: Explanation, samples: float, floors: tuple[float, ...]) -> float:
    """Twice the negative log-likelihood with `samples` effective samples, priors and complexity (BIC) included."""
    fit = explanation.fit
    places = [(e.name, e.at.value if e.at else bench.problem.channel.value) for e in fit.path.effects]
    unusual = sum(UNUSUAL.get(place, 0.0) for place in places)
    # What held-out blocks say has paid for its freedoms already.
    complexity = unusual + (0.0 if explanation.held else fit.freedoms * np.log(max(samples, 2.0)))
    # Each run with a variance of its own: one waveform on which a form fails does not outweigh another it explains.
    lengths = [len(problem.measured) for problem in bench.problems]
    gaps = zip(bench.misfits(explanation, floors), lengths, strict=True)
    level = sum(n / bench.count * np.log(misfit / n) for misfit, n in gaps)
    return float(samples * level + fit.penalty + complexity)


def fit_null(bench: Bench, path: PathSpec) -> Explanation:
    """The path with its nominal parameters alone refitted."""
    fit = fit_hypothesis(bench.problem, Hypothesis(path, bench.nominal), iterations=12)
    return bench.judged(bench.explained(fit, (), {}))


def fit_candidate(bench: Bench, base: Explanation, candidate: Candidate, hasty: bool = False) -> Explanation:
    """One more effect on a base, plain then refined; the refined form only where it earns its parameters.

    A `hasty` fit is a few steps of the plain form: enough to see which candidates deserve the whole.
    """
    problem = bench.problem
    base_freed = {name: freed for name, freed in base.freed.items() if name != candidate.name}
    added = (*(name for name in base.added if name != candidate.name), candidate.name)
    freed = {**base_freed, candidate.name: candidate.required}
    paths = plain_starts(problem, base.fit.path, candidate, base.fit.residual)
    hypotheses = [hypothesis(problem, path, bench.nominal, freed) for path in paths]
    starts = [h.start() for h in hypotheses]
    # A null refit may have bent the nominal parameters far off to hide the effect: begin from the given ones too.
    centres = np.array([term.centre for term in bench.nominal])
    near = [np.concatenate([centres, x[len(centres) :]]) for x in starts]
    if hasty:
        fit = fit_hypothesis(problem, hypotheses[0], starts + near, 3, 1)
    else:
        groups = [(starts, 2), (near, 2)]
        if len(base.added) == 1:
            groups.append((_afresh(bench, base, candidate, hypotheses[0]), 2))
        fits = [fit_hypothesis(problem, hypotheses[0], group, bench.iterations, keep) for group, keep in groups]
        fit = min(fits, key=lambda f: f.fitted.cost)
    plain = bench.explained(fit, added, freed)
    if hasty or not candidate.optional:
        return plain if hasty else bench.judged(plain)
    freed = {**base_freed, candidate.name: candidate.required + candidate.optional}
    paths = refined_starts(problem, fit.path, candidate, base.fit.residual)
    hypotheses = [hypothesis(problem, path, bench.nominal, freed) for path in paths]
    finer = fit_hypothesis(problem, hypotheses[0], [h.start() for h in hypotheses], bench.iterations, keep=3)
    refined = bench.explained(finer, added, freed)
    samples = bench.worth(refined)
    floors = bench.floors(refined)
    return min(bench.judged(plain), bench.judged(refined), key=lambda e: penalised(bench, e, samples, floors))


def _afresh(bench: Bench, base: Explanation, candidate: Candidate, like: Hypothesis) -> list[Array]:
    """Starts of a pair that forget what its first member was alone: there it had to do the work of both."""
    path, problem = base.fit.path, bench.problem
    index = next(i for i, effect in enumerate(path.effects) if effect.name == base.added[0])
    former = Candidate(base.added[0], path.effects[index].at)
    bare = path.model_copy(update={"effects": path.effects[:index] + path.effects[index + 1 :]})
    centres = np.array([term.centre for term in bench.nominal])
    found: list[Array] = []
    for one in plain_starts(problem, bare, former, base.fit.residual):
        paths = plain_starts(problem, one, candidate, base.fit.residual)
        for both in paths:
            by_name = {effect.name: effect for effect in both.effects}
            ordered = both.model_copy(update={"effects": tuple(by_name[e.name] for e in like.path.effects)})
            x = Hypothesis(ordered, like.terms).start()
            found.append(np.concatenate([centres, x[len(centres) :]]))
    stride = -(-len(found) // _MOST_AFRESH)
    return found[::stride]


def _each(bench: Bench, tasks: Sequence[Task], hasty: bool) -> list[Explanation]:
    """Fits of all tasks in their order, whatever the number of workers."""

    def work(task: Task) -> Explanation:
        base, candidate = task
        if bench.progress is not None and not hasty:
            names = " + ".join((*base.added, candidate.name))
            bench.progress(f"{bench.problem.channel.value}: {names}")
        return fit_candidate(bench, base, candidate, hasty)

    if bench.jobs > 1 and len(tasks) > 1:
        with ThreadPoolExecutor(bench.jobs) as workers:
            return list(workers.map(work, tasks))
    return [work(task) for task in tasks]


def scan(bench: Bench, bases: Iterable[Explanation], most: int = 0) -> list[Explanation]:
    """Every candidate on every base, the best of each set of names, best first by cost.

    With `most` given, a hasty fit of all chooses that many for the whole fit.
    """
    pool = library(bench.problem.channel)
    tasks = [(base, c) for base in bases for c in pool if c.name not in base.added]
    if 0 < most < len(tasks):
        first = _each(bench, tasks, True)
        order = sorted(range(len(tasks)), key=lambda i: (first[i].fit.fitted.cost, i))
        tasks = [tasks[i] for i in sorted(order[:most])]
    best: dict[tuple[str, ...], Explanation] = {}
    for explanation in _each(bench, tasks, False):
        key = tuple(sorted(explanation.added))
        if key not in best or explanation.fit.fitted.cost < best[key].fit.fitted.cost:
            best[key] = explanation
    return sorted(best.values(), key=lambda e: (e.fit.fitted.cost, e.added))
