"""Levenberg-Marquardt on the simulation error, inside the stable region."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..core.run import Array
from .sensitivity import respond, simulated
from .structure import Data, Structure, slices, time_weights, unpack


@dataclass(frozen=True, slots=True)
class Refined:
    """A minimum of the simulation error; `theta` is in time normalised by `rate_rad_s`."""

    theta: Array
    rate_rad_s: float
    cost: float
    output: Array
    jacobian: Array
    converged: bool


def refine(
    structure: Structure,
    theta: Array,
    data: Data,
    rate_rad_s: float,
    mask: Array | None = None,
    iterations: int = 60,
    frozen: NDArray[np.bool_] | None = None,
) -> Refined:
    """Least squares of output minus simulation from a stable start.

    `mask` (n,) weighs the squared errors, for blocks held out; `frozen` (size,) parameters stay as they are. Steps
    that leave the stable region are refused, which shortens them.
    """
    weight = np.ones(len(data)) if mask is None else np.sqrt(mask)
    output, jacobian = respond(structure, theta, data, rate_rad_s)
    cost = _cost(data.output - output, weight)
    damping = 1e-3
    converged = False
    for _ in range(iterations):
        weighted = jacobian * weight[:, None]
        if frozen is not None:
            weighted[:, frozen] = 0.0
        scale = np.linalg.norm(weighted, axis=0)
        scale[scale == 0.0] = 1.0
        normal = weighted / scale
        hessian = normal.T @ normal
        gradient = normal.T @ ((data.output - output) * weight)
        improved = False
        while damping < 1e10:
            step = np.linalg.solve(hessian + damping * np.eye(theta.size), gradient) / scale
            candidate = theta + step
            for where in slices(structure):
                # a delay that wants to be negative stays at zero
                candidate[where[2]] = np.maximum(candidate[where[2]], 0.0)
            if admissible(structure, candidate):
                try_cost = _cost(data.output - simulated(structure, candidate, data, rate_rad_s), weight)
                if try_cost < cost:
                    improved = True
                    break
            damping = max(damping, 1e-9) * 4.0
        if not improved:
            converged = True
            break
        # a step of three hundredths of a standard deviation changes the cost by about this much
        converged = cost - try_cost < 1e-3 * cost / len(data)
        theta, cost = candidate, try_cost
        output, jacobian = respond(structure, theta, data, rate_rad_s)
        damping = max(damping / 10.0, 1e-12)
        if converged:
            break
    return Refined(theta, rate_rad_s, cost, output, jacobian, converged)


def admissible(structure: Structure, theta: Array) -> bool:
    """Whether all free poles are stable and all delays are not negative."""
    if not np.all(np.isfinite(theta)):
        return False
    for path in unpack(structure, theta)[0]:
        if path.delay_s < 0.0 or np.any(np.roots(path.denominator).real >= 0.0):
            return False
    return True


def rescaled(structure: Structure, theta: Array, old_rad_s: float, new_rad_s: float) -> Array:
    """The same parameters in time normalised by another rate."""
    return theta * time_weights(structure, old_rad_s) / time_weights(structure, new_rad_s)


def _cost(error: Array, weight: Array) -> float:
    with np.errstate(over="ignore", invalid="ignore"):
        value = float(np.sum((error * weight) ** 2))
    return value if np.isfinite(value) else np.inf
