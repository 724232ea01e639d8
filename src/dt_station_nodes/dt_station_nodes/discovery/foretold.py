"""What an explanation leaves of two runs where the second may settle what the first leaves open."""

import numpy as np
from numpy.typing import NDArray

from .fit import finite_differences, least_squares
from .hypothesis_fit import Fit
from .problem import Problem
from .unseen import unseen_residual

Array = NDArray[np.float64]

# Rounds, between which each run's own variance is seen anew, and steps in each.
_ROUNDS = 2
_STEPS = 2


def foretold(problem: Problem, check: Problem, fit: Fit) -> tuple[float, Array]:
    """Sum of squares (unit^2) left of the run, and the residual (n,) left of `check`, which no fit has seen.

    A number that the run hardly holds says little of another run, and its error there is not the effect's. So numbers
    move where the run's own curvature lets them (recursive least squares); the fit itself stays as it is.
    """
    given = unseen_residual(check, fit.path)
    left = float(fit.residual @ fit.residual)
    x = fit.fitted.x
    if not len(x):
        return left, given
    hypothesis = fit.hypothesis
    bounds, idle = hypothesis.bounds, fit.fitted.idle
    # What is out of the run's reach stays: the run cannot vouch for it.
    bounds[idle] = x[idle, None]
    curvature = np.asarray(np.linalg.qr(fit.fitted.jacobian, mode="r"))

    def spread(power: float, of: Problem) -> float:
        """Standard deviation of a residual, and what counts as nothing."""
        return float(np.sqrt(power / len(of.measured) + of.negligible**2))

    def cost(run: float, other: float) -> float:
        """Twice the negative log-likelihood, each run with a variance of its own."""
        parts = ((run, problem), (other, check))
        return 2.0 * sum(len(of.measured) * float(np.log(spread(power, of))) for power, of in parts)

    # Numbers move little: the slopes at the fit serve for every step.
    slopes = finite_differences(
        lambda moved: unseen_residual(check, hypothesis.path_at(moved)), x, given, hypothesis.steps, *bounds.T
    )
    best = (left, given)
    at = x
    for _ in range(_ROUNDS):
        here = spread(best[0], problem) / problem.sigma
        there = spread(float(best[1] @ best[1]), check)

        def residuals(moved: Array, here: float = here, there: float = there) -> Array:
            gap = unseen_residual(check, hypothesis.path_at(moved)) / there
            return np.concatenate([gap, curvature @ (moved - x) / here])

        both = np.concatenate([slopes / there, curvature / here])
        at = least_squares(residuals, at, bounds[:, 0], bounds[:, 1], hypothesis.steps, _STEPS, slopes=both).x
        path = hypothesis.path_at(at)
        run, other = problem.residual(path), unseen_residual(check, path)
        found = (float(run @ run), other)
        if cost(found[0], float(other @ other)) >= cost(best[0], float(best[1] @ best[1])):
            break
        best = found
    return best
