"""How a gain settles or heats: of many time constants, by least squares, the one that explains most."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ..core.models import PathSpec
from ..core.models.effects import Quantity, registry
from .problem import Problem
from .timing import DRIFT, with_numbers

Array = NDArray[np.float64]
_Ways = Sequence[tuple[float, dict[str, float]]]

SETTLING = "settling_s"
HEATING = "heat_s"
_LOSSES = "heat_per_v2"
# Of a run's length.
_SHARES = (0.02, 0.03, 0.045, 0.07, 0.1, 0.15, 0.22, 0.33, 0.5, 0.75)
# A change of the gain so small is linear in its effect.
_SMALL = 1e-3


def settling_drift(problem: Problem, path: PathSpec) -> tuple[float, float]:
    """Time constant (s) and rate at the start (1/s) of a gain that settles, in place of the drift on a path.

    What it settles by is told from a gain that is off all the time.
    """
    settling = [(s, {"rate_per_s": _SMALL / s, SETTLING: s}) for s in _times_s(problem, SETTLING)]
    settling_s, size = _best(problem, path, settling)
    return settling_s, _SMALL * size / settling_s


def heated_drift(problem: Problem, path: PathSpec) -> Mapping[str, float]:
    """Numbers of a gain that what is put in heats, by name, in place of the drift on a path; {} on its sensor.

    The losses go with the square of a voltage: what weakens with its size tires, as anything may.
    """
    if path.effect(DRIFT).place is not registry()[DRIFT].parameter(HEATING).at:
        return {}
    highest = float(np.max(np.abs(problem.simulator.voltage_v)))
    small = _SMALL / highest**2
    heating_s, size = _best(problem, path, [(s, {_LOSSES: small, HEATING: s}) for s in _times_s(problem, HEATING)])
    return {"rate_per_s": 0.0, _LOSSES: size * small, HEATING: heating_s, "heat_bend": 0.0}


def _times_s(problem: Problem, name: str) -> list[float]:
    """Time constants to try, within the parameter's bounds."""
    parameter, unit = registry()[DRIFT].parameter(name), problem.scales[Quantity.RUN_TIME]
    lower, upper = parameter.lower * unit, parameter.upper * unit
    return sorted({min(max(share * problem.length_s, lower), upper) for share in _SHARES})


def _best(problem: Problem, path: PathSpec, ways: _Ways) -> tuple[float, float]:
    """Of time constants with a small change of the gain each, the one by which it explains most; how much of it."""
    given = dict.fromkeys(("rate_per_s", "jump", "second_jump", _LOSSES), 0.0)
    spec = path.effect(DRIFT)
    neutral = registry()[DRIFT].parameter(SETTLING).neutral
    steady = with_numbers(path, spec, {**given, SETTLING: neutral, HEATING: 0.0})
    spec = steady.effect(DRIFT)
    residual = problem.residual(steady)

    def slope(numbers: dict[str, float]) -> Array:
        return residual - problem.residual(with_numbers(steady, spec, numbers))

    always = slope({"jump": _SMALL, "jump_s": 0.0})
    best = np.inf, neutral, 0.0
    for time_s, change in ways:
        columns = np.column_stack([slope(change), always])
        size = np.linalg.lstsq(columns, residual, rcond=None)[0]
        left = float(np.sum(np.square(residual - columns @ size)))
        best = min(best, (left, time_s, float(size[0])))
    return best[1], best[2]
