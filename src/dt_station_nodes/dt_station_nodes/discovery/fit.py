"""Bounded Gauss-Newton with Levenberg damping for simulation errors: small, deterministic, interruptible."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Residual = Callable[[Array], Array]

# Of the largest part that a parameter has in the residual.
_NOTHING = 1e-12
# Iterations that a descent has before its pace is judged.
_WARM_UP = 3
# A cost below this part of what it was where slopes were taken is of another place.
_MOVED = 0.5


@dataclass(frozen=True, slots=True)
class Fitted:
    """A minimum: parameters (p,), residual (m,), Jacobian (m, p), sum of squares, evaluations spent."""

    x: Array
    residual: Array
    jacobian: Array
    cost: float
    evaluations: int

    @property
    def idle(self) -> NDArray[np.bool_]:
        """Which parameters (p,) are out of the data's reach: their part in the residual is next to nothing."""
        columns = np.abs(self.jacobian).max(axis=0, initial=0.0)
        return np.asarray(columns <= _NOTHING * columns.max(initial=0.0))

    def covariance(self, samples: float, of: int, held: Sequence[int] = ()) -> Array:
        """Covariance (p, p) of x with the residual's own variance, for `samples` effective ones `of` the data.

        Directions the data do not hold get a very large variance; numbers `held` fixed vary with nothing.
        """
        p = len(self.x)
        jacobian = self.jacobian.copy()
        jacobian[:, list(held)] = 0.0
        scale = np.maximum(np.linalg.norm(jacobian, axis=0), 1e-100)
        normal = gram(jacobian / scale)
        variance = self.cost / max(of - p, 1) * (of / max(samples, 1.0))
        inverse = np.linalg.pinv(normal + 1e-12 * np.eye(p), hermitian=True)
        return inverse * variance / np.outer(scale, scale)


def gram(jacobian: Array) -> Array:
    """J^T J without BLAS: its threads, waiting for each other, cost more than the sum on a busy machine."""
    return np.einsum("ij,ik->jk", jacobian, jacobian)


def _finite(values: Array) -> Array:
    if np.isfinite(values).all():
        return values
    return np.nan_to_num(values, nan=1e8, posinf=1e8, neginf=-1e8)


def finite_differences(
    fun: Residual, x: Array, r: Array, steps: Array, lower: Array, upper: Array, first: Array | None = None
) -> Array:
    """Jacobian (m, p) of `fun` at x, where it is `r` (m,); steps turn back at the upper bound.

    `first` (m, k), where given, are its first columns.
    """
    columns = np.empty((len(r), len(x)))
    known = 0 if first is None else first.shape[1]
    if first is not None:
        columns[:, :known] = first
    for j in range(known, len(x)):
        moved = x.copy()
        step = steps[j] if x[j] + steps[j] <= upper[j] else -steps[j]
        moved[j] = min(max(x[j] + step, lower[j]), upper[j])
        change = moved[j] - x[j]
        columns[:, j] = (_finite(fun(moved)) - r) / change if change != 0.0 else 0.0
    return columns


def least_squares(
    fun: Residual,
    start: Array,
    lower: Array,
    upper: Array,
    steps: Array,
    iterations: int = 12,
    tolerance: float = 1e-4,
    slopes: Array | None = None,
    rival: float = np.inf,
    lasting: int = 0,
    coarse: Residual | None = None,
) -> Fitted:
    """Minimise |fun(x)|^2 within bounds from `start`; `steps` (p,) are the finite differences' lengths.

    Ends when an iteration lowers the cost by less than `tolerance` of it, or where going on at the better pace of the
    last two would not get below the cost of a `rival`. Parameters at a bound that the gradient pushes outwards are
    held for the iteration. `slopes` (m, p), where given, is the Jacobian for all of them; else the slopes of the first
    `lasting` parameters are taken anew only where the cost has halved since. Slopes are those of `coarse`, where given,
    which changes much as `fun` does and takes less time. Without iterations the start stays, with the Jacobian there.
    """
    x = np.clip(start, lower, upper)
    r = _finite(fun(x))
    cost = float(r @ r)
    spent = 1
    damping = 1e-3
    jacobian = np.zeros((len(r), len(x))) if slopes is None else slopes
    if iterations == 0 and slopes is None:
        jacobian = finite_differences(fun, x, r, steps, lower, upper)
        spent += len(x)
    pace, since, told = 1.0, cost, coarse or fun
    for iteration in range(1, iterations + 1):
        if slopes is None:
            kept = lasting if iteration > 1 and cost > _MOVED * since else 0
            since = since if kept else cost
            here = r if told is fun else _finite(told(x))
            jacobian = finite_differences(told, x, here, steps, lower, upper, jacobian[:, :kept])
            spent += len(x) - kept + (told is not fun)
        gradient = np.einsum("ij,i->j", jacobian, r)
        free = ~(((x <= lower) & (gradient > 0.0)) | ((x >= upper) & (gradient < 0.0)))
        if not free.any():
            break
        normal = gram(jacobian[:, free])
        diagonal = np.maximum(np.diag(normal), 1e-12 * max(float(np.diag(normal).max()), 1e-300))
        before = cost
        for _attempt in range(6):
            step = np.zeros(len(x))
            step[free] = np.linalg.lstsq(normal + damping * np.diag(diagonal), -gradient[free], rcond=None)[0]
            trial = np.clip(x + step, lower, upper)
            trial_r = _finite(fun(trial))
            spent += 1
            trial_cost = float(trial_r @ trial_r)
            if trial_cost < cost:
                x, r, cost = trial, trial_r, trial_cost
                damping = max(damping * 0.2, 1e-7)
                break
            damping *= 8.0
        if before - cost <= tolerance * before:
            break
        former, pace = pace, cost / before
        if iteration >= _WARM_UP and cost * min(former, pace) ** (iterations - iteration) > rival:
            break
    return Fitted(x, r, jacobian, cost, spent)
