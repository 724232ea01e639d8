"""Explanations: sets of effects fitted to a channel, and what they are measured by."""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..core.models import PathSpec
from ..core.models.effects import registry
from ..workers import ALONE, Workers
from .candidates import Freed, in_vocabulary
from .fit import Fitted
from .foretold import foretold
from .held_out import held_out_power
from .hypothesis_fit import Fit, fit_hypothesis
from .noise import effective_samples, noise_floor
from .odds import against
from .out_of_reach import ends_elsewhere
from .problem import Problem
from .terms import Hypothesis, Term
from .unseen import unseen_residual

Array = NDArray[np.float64]
Progress = Callable[[str], None]

NOTHING = 1e-6  # of a parameter's scale: it is at what changes nothing


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

    @property
    def hollow(self) -> bool:
        """Whether one of its effects is there only in name: what would show it is at what changes nothing."""
        specs = {effect.name: effect for effect in self.fit.path.effects}
        scales = {
            (self.fit.path.effects[t.effect].name, t.name): t.scale for t in self.fit.hypothesis.terms if t.effect >= 0
        }
        for name in self.added:
            showing = [p for p in registry()[name].parameters if p.shows_presence]
            away = [abs(specs[name].parameters[p.name] - p.neutral) / scales.get((name, p.name), 1.0) for p in showing]
            if max(away, default=0.0) <= NOTHING:
                return True
        return False


@dataclass(frozen=True, slots=True)
class Bench:
    """One channel's problem with what all its fits share."""

    problem: Problem
    nominal: tuple[Term, ...]
    check: Problem | None = None
    workers: Workers = ALONE
    progress: Progress | None = None

    @property
    def alone(self) -> "Bench":
        """The same for one worker among others."""
        return replace(self, workers=ALONE, progress=None)

    @property
    def iterations(self) -> int:
        """Steps a fit may take: more where a whole linear path is refitted."""
        return 30 if self.rough else 10

    @property
    def rough(self) -> bool:
        """Whether a whole linear path is refitted to data that no model of ours reaches the noise of."""
        return self.problem.rough

    @property
    def problems(self) -> tuple[Problem, ...]:
        """The run's problem, and the validation run's where there is one."""
        return (self.problem,) if self.check is None else (self.problem, self.check)

    @property
    def count(self) -> int:
        """Samples compared, of both runs."""
        return sum(len(p.measured) for p in self.problems)

    def explained(self, fit: Fit, added: tuple[str, ...], freed: Freed, glance: bool = False) -> "Explanation":
        """A fit with what it leaves of both runs; at a `glance` with its numbers as they are."""
        powers = [float(fit.residual @ fit.residual)]
        unseen = None
        if self.check is not None:
            fit = ends_elsewhere(self.check, fit)
            unseen = unseen_residual(self.check, fit.path)
            powers.append(float(unseen @ unseen))
        found = Explanation(fit, added, freed, tuple(powers), unseen)
        return found if glance else self.settled(found)

    def settled(self, explanation: "Explanation", exactly: bool = False) -> "Explanation":
        """With what it leaves of both runs where the validation run may settle what the run leaves open."""
        if self.check is None or self.rough:
            return explanation
        left, unseen = foretold(self.problem, self.check, explanation.fit, exactly)
        return replace(explanation, powers=(left, float(unseen @ unseen)), unseen=unseen)

    def judged(self, explanation: "Explanation") -> "Explanation":
        """As it is judged: where data are rough, by what it says of blocks held out of the fit."""
        if not self.rough or explanation.held:
            return explanation
        power = held_out_power(self.problem, explanation.fit)
        return replace(explanation, powers=(power, *explanation.powers[1:]), held=True)

    def floors(self, explanation: "Explanation") -> tuple[float, ...]:
        """Each run's noise power (unit^2), seen in an explanation's residuals; runs may differ in noise."""
        gaps = (explanation.fit.residual, explanation.unseen)
        runs = [(p, gap) for p, gap in zip(self.problems, gaps, strict=False) if gap is not None]
        found = [noise_floor(p.measured, gap, p.noise) for p, gap in runs]
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

    def tells(self, before: Fit, after: Fit, samples: float) -> float:
        """What the run alone says for one fit over another, as they were fitted: twice the log-likelihood ratio."""
        return samples * len(after.residual) / self.count * math.log(before.rss / after.rss)

    def worth(self, explanation: "Explanation") -> float:
        """Effective number of samples of both runs, by an explanation's residual."""
        residual = explanation.fit.residual
        return effective_samples(residual) * self.count / len(residual)


def _spent(fit: Fit) -> int:
    """Free numbers, less effects' that change nothing: left where they do not, or out of reach of the run."""
    unused = 0
    out_of_reach = fit.fitted.idle
    for index, term in enumerate(fit.hypothesis.terms):
        if term.effect >= 0:
            spec = fit.path.effects[term.effect]
            parameter = registry()[spec.name].parameter(term.name)
            idle = abs(spec.parameters[term.name] - parameter.neutral) <= 1e-9 * term.scale
            unused += (parameter.optional and idle) or bool(out_of_reach[index])
    return fit.freedoms - unused


def penalised(bench: Bench, explanation: Explanation, samples: float, floors: tuple[float, ...]) -> float:
    """Twice the negative log-likelihood with `samples` effective samples, priors and complexity (BIC) included."""
    fit = explanation.fit
    unusual = against(fit.path, bench.problem.channel)
    # What held-out blocks say has paid for its freedoms already.
    complexity = unusual + (0.0 if explanation.held else _spent(fit) * np.log(max(samples, 2.0)))
    # Each run with a variance of its own: one waveform on which a form fails does not outweigh another it explains.
    lengths = [len(problem.measured) for problem in bench.problems]
    gaps = zip(bench.misfits(explanation, floors), lengths, strict=True)
    level = sum(n / bench.count * np.log(misfit / n) for misfit, n in gaps)
    return float(samples * level + fit.penalty + complexity)


def as_given(bench: Bench, path: PathSpec) -> Explanation:
    """The path with its parameters as they are: data that tell little of them must not bend them."""
    residual = bench.problem.residual(path)
    cost = float(residual @ residual) / bench.problem.sigma**2
    fitted = Fitted(np.zeros(0), residual, np.zeros((len(residual), 0)), cost, 1)
    return bench.explained(Fit(Hypothesis(path, ()), path, fitted, residual, cost, 0.0), (), {})


def fit_null(bench: Bench, path: PathSpec) -> Explanation:
    """The path with its nominal parameters alone refitted."""
    fit = fit_hypothesis(bench.problem, Hypothesis(path, bench.nominal), iterations=12)
    return bench.judged(bench.explained(fit, (), {}))


def exchanged(
    known: Iterable[Explanation], those: Iterable[Explanation], found: Iterable[Explanation]
) -> list[Explanation]:
    """What is known, each of `those` exchanged for what was found in its place; in the order they came."""
    instead = {id(explanation): new for explanation, new in zip(those, found, strict=True)}
    return [instead.get(id(explanation), explanation) for explanation in known]
