"""Fitting a hypothesis to a problem: simulation error, priors on the nominal parameters, several starts."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..core.models import PathSpec
from .fit import Fitted, Residual, least_squares
from .problem import Problem
from .terms import Hypothesis, Term

Array = NDArray[np.float64]
Costs = dict[bytes, float]  # of starts, by their numbers

_CHANCE = 3.0  # standard deviations of a sum of squares of noise
_NEARBY = 4.0  # priors of the nominal parameters, twice the log


@dataclass(frozen=True, slots=True, eq=False)
class Group:
    """Starts between which there is a way down, and how many of them to follow; `passed`: the best were followed."""

    starts: Sequence[Array]
    keep: int
    passed: int = 0


@dataclass(frozen=True, slots=True)
class Fit:
    """A hypothesis at its best parameters.

    `rss`: sum of squares of the residual over the working sigma; `penalty`: what the nominal parameters'
    priors cost; `residual` (n,) in the channel's unit.
    """

    hypothesis: Hypothesis
    path: PathSpec
    fitted: Fitted
    residual: Array
    rss: float
    penalty: float

    @property
    def names(self) -> tuple[str, ...]:
        """Effects on the path."""
        return tuple(effect.name for effect in self.path.effects)

    @property
    def furthest(self) -> float:
        """Widths of its prior by which the nominal parameter is off that is off most."""
        return max(map(abs, _Priors.of(self.hypothesis).deviations(self.fitted.x)), default=0.0)

    @property
    def full(self) -> bool:
        """Whether it leaves what noise would, and the nominal parameters about where they were given."""
        count = len(self.residual)
        return self.penalty <= _NEARBY and self.rss <= count + _CHANCE * (2.0 * count) ** 0.5

    @property
    def freedoms(self) -> int:
        """Free numbers."""
        return len(self.hypothesis.terms)


def _prior(deviation: float) -> float:
    """Residual of a heavy-tailed prior (Student's t): a square inside its width, a logarithm far outside."""
    return math.copysign(math.sqrt(4.0 * math.log1p(0.25 * deviation**2)), deviation)


@dataclass(frozen=True, slots=True)
class _Priors:
    """Terms that have a prior, and gains' asymmetries, each with its place: a fit asks for them thousands of times."""

    held: tuple[tuple[int, Term], ...]
    asymmetries: tuple[tuple[int, Term], ...]

    @classmethod
    def of(cls, hypothesis: Hypothesis) -> "_Priors":
        placed, effects = tuple(enumerate(hypothesis.terms)), hypothesis.path.effects
        unequal = tuple(
            (k, term)
            for k, term in placed
            if term.name == "asymmetry" and effects[term.effect].name == "asymmetric_gain"
        )
        return cls(tuple((k, term) for k, term in placed if term.prior), unequal)

    def deviations(self, x: Array) -> list[float]:
        """By how many widths of their priors numbers x (p,) are off, those that have one.

        Of a gain that differs from side to side the nearer one counts: the given gain may be that of either.
        """
        values = x.tolist()
        found = [(values[k] - term.centre) / term.prior for k, term in self.held]
        unequal = [term.to_value(values[k]) for k, term in self.asymmetries if values[k]]
        for side in (sign * one for one in unequal for sign in (1.0, -1.0)):
            for n, (k, term) in enumerate(self.held):
                if term.name == "gain":
                    reached = term.to_x(term.to_value(values[k]) * (1.0 + side))
                    found[n] = min(found[n], (reached - term.centre) / term.prior, key=abs)
        return found

    def gaps(self, x: Array) -> Array:
        """Residuals (k,) of the priors at the numbers x (p,)."""
        return np.array([_prior(deviation) for deviation in self.deviations(x)])


def prior_gaps(hypothesis: Hypothesis, x: Array) -> Array:
    """Residuals (k,) of the priors of the numbers x (p,) that have one."""
    return _Priors.of(hypothesis).gaps(x)


def _cost(gap: Array) -> float:
    cost = float(np.sum(gap**2))
    return cost if np.isfinite(cost) else float(np.sum(np.nan_to_num(gap, nan=1e9) ** 2))


def _residuals(problem: Problem, hypothesis: Hypothesis, mask: Array | None = None) -> Residual:
    sigma, priors = problem.sigma, _Priors.of(hypothesis)

    def residuals(x: Array) -> Array:
        gap = problem.residual(hypothesis.path_at(x)) / sigma
        if mask is not None:
            gap = gap * mask
        return np.concatenate([gap, priors.gaps(x)])

    return residuals


def _known_costs(
    residuals: Residual, hypothesis: Hypothesis, starts: Sequence[Array], known: Costs, of: bytes = b""
) -> list[float]:
    bounds = hypothesis.bounds
    keys = [of + x.tobytes() for x in starts]
    for key, x in zip(keys, starts, strict=True):
        if key not in known:
            known[key] = _cost(residuals(np.clip(x, bounds[:, 0], bounds[:, 1])))
    return [known[key] for key in keys]


def costs_of_part(part: Problem, hypothesis: Hypothesis, starts: Sequence[Array], known: Costs) -> list[float]:
    """What starts cost on a part of a run alone; `known` is added to, beside what they cost on the whole."""
    return _known_costs(_residuals(part.coarse(hypothesis.path), hypothesis), hypothesis, starts, known, b"part")


def fit_hypothesis(
    problem: Problem,
    hypothesis: Hypothesis,
    starts: Sequence[Array] = (),
    iterations: int = 10,
    keep: int = 2,
    mask: Array | None = None,
    rival: float = np.inf,
    passed: int = 0,
    known: Costs | None = None,
    lasting: int = 0,
) -> Fit:
    """The best of the `keep` most promising starts, each refined; `mask` (n,) weighs samples for held-out blocks.

    Of a long run, starts are told apart and slopes taken by a coarse simulation; what is left is simulated as it is.
    The best `passed` of more starts than these are passed over. What will not get below the best before it, or below
    the cost of a `rival`, is given up. `known`: costs of starts of this hypothesis, which are added to. `lasting`: how
    many of its first numbers have slopes that are worth keeping for a while.
    """
    bounds = hypothesis.bounds
    residuals, about = _residuals(problem, hypothesis, mask), problem.coarse(hypothesis.path)
    coarse = residuals if about is problem else _residuals(about, hypothesis, mask)
    candidates = list(starts) or [hypothesis.start()]
    steps = hypothesis.steps
    if len(candidates) > keep:
        costs = _known_costs(coarse, hypothesis, candidates, {} if known is None else known)
        order = sorted(range(len(candidates)), key=lambda i: (costs[i], i))
        # Starts of one cost do the same, most often nothing: one of them is enough.
        apart = [i for n, i in enumerate(order) if n == 0 or costs[i] - costs[order[n - 1]] > 1e-9 * costs[i]]
        candidates = [candidates[i] for i in apart[passed : passed + keep] or apart[:1]]
    best: Fitted | None = None
    for x in candidates:
        found = least_squares(
            residuals, x, bounds[:, 0], bounds[:, 1], steps, iterations, rival=rival, lasting=lasting, coarse=coarse
        )
        rival = min(rival, found.cost)
        if best is None or found.cost < best.cost:
            best = found
    assert best is not None
    path = hypothesis.path_at(best.x)
    residual = problem.residual(path)
    penalty = float(np.sum(prior_gaps(hypothesis, best.x) ** 2))
    return Fit(hypothesis, path, best, residual, float(residual @ residual) / problem.sigma**2, penalty)


def fit_groups(
    problem: Problem,
    hypothesis: Hypothesis,
    groups: Sequence[Group],
    anew: Sequence[Group],
    iterations: int,
    rival: float = np.inf,
    known: Costs | None = None,
    lasting: int = 0,
) -> list[Fit]:
    """The best fit from groups of starts, and each other group's, best first; empty groups are passed over.

    `known`: costs of starts, which are added to; `lasting`: numbers whose slopes are kept for a while.
    Those `anew` are begun only where the others leave more than noise, or bend the nominal parameters.
    """
    found: list[Fit] = []
    for group in (*groups, *anew):
        if not group.starts or (group in anew and found and found[0].full):
            continue
        fit = fit_hypothesis(
            problem, hypothesis, group.starts, iterations, group.keep, None, rival, group.passed, known, lasting
        )
        rival = min(rival, fit.fitted.cost)
        found = sorted([*found, fit], key=lambda one: one.fitted.cost)
    return found
