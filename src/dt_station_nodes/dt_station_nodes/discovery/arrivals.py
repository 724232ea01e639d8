"""What comes once in the course of a run may be there already in another, not come at all, or come at another time."""

import numpy as np
from numpy.typing import NDArray

from ..core.models import EffectSpec, PathSpec
from .problem import Problem
from .timing import BIAS, DRIFT, with_numbers

Array = NDArray[np.float64]
_Left = tuple[PathSpec, Array]

_SIZES = {BIAS: "jump_v", DRIFT: "jump"}
_TIME, _LAG = "jump_s", "jump_lag_s"
_FORETOLD = 1.5  # mean square over the noise's, of what is left where the time is as foretold
_PLACES = 24
_HALVINGS = 6


def arrival_of(path: PathSpec) -> EffectSpec | None:
    """The effect of a path that comes at some time of the run, if it has one."""
    return next((e for e in path.effects if e.name in _SIZES and e.parameters[_SIZES[e.name]] != 0.0), None)


def arrived_anywhere(check: Problem, path: PathSpec, spec: EffectSpec) -> _Left:
    """The path with what comes there when another run shows it to, and what it leaves of that run (n,)."""

    def at(numbers: dict[str, float]) -> _Left:
        moved = with_numbers(path, spec, numbers)
        return moved, check.residual(moved)

    given = at({})
    if _power(given) < _FORETOLD * len(given[1]) * check.noise**2:
        return given
    tried = [given, at({_TIME: 0.0, _LAG: 0.0}), at({_SIZES[spec.name]: 0.0})]
    step_s = check.length_s / _PLACES
    later = [at({_TIME: step_s * (place + 0.5)}) for place in range(_PLACES)]
    best = min(later, key=_power)
    for _ in range(_HALVINGS):
        step_s *= 0.5
        time_s = best[0].effect(spec.name).parameters[_TIME]
        best = min((best, at({_TIME: time_s - step_s}), at({_TIME: time_s + step_s})), key=_power)
    return min((*tried, best), key=_power)


def _power(one: _Left) -> float:
    return float(np.sum(np.square(one[1])))
