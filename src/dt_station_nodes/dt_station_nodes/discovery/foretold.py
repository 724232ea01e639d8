"""What an explanation leaves of two runs where the second may settle what the first leaves open."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ..core.models import PathSpec
from .fit import finite_differences, least_squares
from .hypothesis_fit import Fit, fit_hypothesis, prior_gaps
from .problem import Problem
from .unseen import unseen_residual

Array = NDArray[np.float64]

# Rounds, between which each run's own variance is seen anew, and steps in each:
_ROUNDS = 2
# of those with the slopes at the fit,
_STEPS = 2
# and of those with slopes seen anew.
_EXACT_STEPS = 4


@dataclass(frozen=True, slots=True)
class _Place:
    """Numbers x (p,), sum of squares (unit^2) that they leave of the run, residual (n,) of the other."""

    x: Array
    left: float
    unseen: Array

    def cost(self, problem: Problem, check: Problem) -> float:
        """Twice the negative log-likelihood, each run with a variance of its own."""
        return 2.0 * sum(
            len(of.measured) * float(np.log(s))
            for of, s in zip((problem, check), self.spreads(problem, check), strict=True)
        )

    def spreads(self, problem: Problem, check: Problem) -> tuple[float, float]:
        """Standard deviation of each run's residual, and what counts as nothing."""
        powers = (self.left, problem), (float(self.unseen @ self.unseen), check)
        run, other = (float(np.sqrt(power / len(of.measured) + of.negligible**2)) for power, of in powers)
        return run, other


def foretold(problem: Problem, check: Problem, fit: Fit, exactly: bool = False) -> tuple[float, Array]:
    """Sum of squares (unit^2) left of the run, and the residual (n,) left of `check`, which no fit has seen.

    A number that the run hardly holds says little of another run, and its error there is not the effect's. So numbers
    move where the run's own curvature lets them (recursive least squares); the fit itself stays as it is. `exactly`:
    with the run simulated anew for each step, as far as the two lead.
    """
    begin = _begun(check, fit)
    if not len(begin.x):
        return begin.left, begin.unseen
    found = _by_curvature(problem, check, fit, begin)
    if exactly:
        found = _simulated(problem, check, fit, found)
    return found.left, found.unseen


def agreed(problem: Problem, check: Problem, fit: Fit) -> Fit:
    """A fit with the numbers that both runs agree on, each simulated anew, about where it stands; held by both."""
    hypothesis = fit.hypothesis
    place = _simulated(problem, check, fit, _begun(check, fit))
    there = fit_hypothesis(problem, hypothesis, [place.x], 0, 1)
    slopes = finite_differences(
        lambda moved: unseen_residual(check, hypothesis.path_at(moved)),
        there.fitted.x,
        unseen_residual(check, there.path),
        hypothesis.steps,
        *_bounds(there).T,
    )
    run, other = place.spreads(problem, check)
    # In the run's own units, so that the other counts by its own variance.
    both = np.concatenate([there.fitted.jacobian, slopes * (run / (other * problem.sigma))])
    return replace(there, fitted=replace(there.fitted, jacobian=both))


def cost_of_both(problem: Problem, check: Problem, path: PathSpec) -> float:
    """Twice the negative log-likelihood of both runs at a path, but for a constant; no end where one runs away."""
    run = problem.residual(path)
    cost = _Place(np.zeros(0), float(run @ run), unseen_residual(check, path)).cost(problem, check)
    return cost if np.isfinite(cost) else np.inf


def _begun(check: Problem, fit: Fit) -> _Place:
    return _Place(fit.fitted.x, float(fit.residual @ fit.residual), unseen_residual(check, fit.path))


def _bounds(fit: Fit) -> Array:
    """Bounds (p, 2) of numbers that the other run may move: what is out of the run's reach stays, unvouched for."""
    bounds, idle = fit.hypothesis.bounds, fit.fitted.idle
    bounds[idle] = fit.fitted.x[idle, None]
    return bounds


def _by_curvature(problem: Problem, check: Problem, fit: Fit, begin: _Place) -> _Place:
    hypothesis = fit.hypothesis
    curvature = np.asarray(np.linalg.qr(fit.fitted.jacobian, mode="r"))
    # Numbers move little: the slopes at the fit serve for every step.
    coarse = check.coarse(fit.path)
    slopes = finite_differences(
        lambda moved: unseen_residual(coarse, hypothesis.path_at(moved)),
        begin.x,
        begin.unseen if coarse is check else unseen_residual(coarse, fit.path),
        hypothesis.steps,
        *_bounds(fit).T,
    )

    def gaps(here: float, there: float, moved: Array) -> Array:
        gap = unseen_residual(check, hypothesis.path_at(moved)) / there
        return np.concatenate([gap, curvature @ (moved - begin.x) / (here / problem.sigma)])

    def both(here: float, there: float) -> Array:
        return np.concatenate([slopes / there, curvature / (here / problem.sigma)])

    return _led(problem, check, fit, begin, gaps, _STEPS, both)


def _simulated(problem: Problem, check: Problem, fit: Fit, begin: _Place) -> _Place:
    hypothesis = fit.hypothesis

    def gaps(here: float, there: float, moved: Array) -> Array:
        path = hypothesis.path_at(moved)
        runs = problem.residual(path) / here, unseen_residual(check, path) / there
        return np.concatenate([*runs, prior_gaps(hypothesis, moved)])

    return _led(problem, check, fit, begin, gaps, _EXACT_STEPS)


def _led(
    problem: Problem,
    check: Problem,
    fit: Fit,
    best: _Place,
    gaps: Callable[[float, float, Array], Array],
    steps: int,
    slopes: Callable[[float, float], Array] | None = None,
) -> _Place:
    """Where `gaps` lead, which come with their `slopes` or are simulated for them, both by the runs' spreads."""
    bounds = _bounds(fit)
    for _ in range(_ROUNDS):
        spreads = best.spreads(problem, check)
        seen = slopes(*spreads) if slopes else None
        led = partial(gaps, *spreads)
        at = least_squares(led, best.x, bounds[:, 0], bounds[:, 1], fit.hypothesis.steps, steps, slopes=seen).x
        found = _at(problem, check, fit, at)
        if found.cost(problem, check) >= best.cost(problem, check):
            break
        best = found
    return best


def _at(problem: Problem, check: Problem, fit: Fit, x: Array) -> _Place:
    path = fit.hypothesis.path_at(x)
    run = problem.residual(path)
    return _Place(x, float(run @ run), unseen_residual(check, path))
