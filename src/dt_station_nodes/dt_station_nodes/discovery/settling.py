"""How a gain settles: of many time constants, by least squares, the one that explains most."""

import numpy as np

from ..core.models import PathSpec
from ..core.models.effects import registry
from .problem import Problem
from .timing import DRIFT, with_numbers

SETTLING = "settling_s"
# Of a run's length.
_SHARES = (0.02, 0.03, 0.045, 0.07, 0.1, 0.15, 0.22, 0.33, 0.5, 0.75)
# A change of the gain so small is linear in its effect.
_SMALL = 1e-3


def settling_drift(problem: Problem, path: PathSpec) -> tuple[float, float]:
    """Time constant (s) and rate at the start (1/s) of a gain that settles, in place of the drift on a path.

    What it settles by is told from a gain that is off all the time.
    """
    spec, parameter = path.effect(DRIFT), registry()[DRIFT].parameter(SETTLING)
    steady = with_numbers(path, spec, {"rate_per_s": 0.0, SETTLING: parameter.neutral})
    spec = steady.effect(DRIFT)
    residual = problem.residual(steady)

    def slope(numbers: dict[str, float]) -> np.ndarray:
        return (residual - problem.residual(with_numbers(steady, spec, numbers))) / _SMALL

    always = slope({"jump": _SMALL, "jump_s": 0.0})
    best = np.inf, parameter.neutral, 0.0
    for share in _SHARES:
        settling_s = min(max(share * problem.length_s, parameter.lower), parameter.upper)
        change = slope({"rate_per_s": _SMALL / settling_s, SETTLING: settling_s})
        columns = np.column_stack([change, always])
        size = np.linalg.lstsq(columns, residual, rcond=None)[0]
        left = float(np.sum(np.square(residual - columns @ size)))
        best = min(best, (left, settling_s, float(size[0]) / settling_s))
    return best[1], best[2]
