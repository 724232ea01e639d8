"""Where a spring is mounted when a run begins: about where the piston then works, if the rig was set up anew."""

import numpy as np
from numpy.typing import NDArray

from ..core.models import EffectSpec, PathSpec
from ..core.models.effects import Attachment
from .problem import Problem
from .timing import with_numbers

Array = NDArray[np.float64]

_NAME, _PLACE = "cubic_stiffness", "centre"
_LOUD = 4.0  # times the noise's power: less is explained where the spring was
_LEAVES = 0.2  # of what the spring leaves where it was: a place that leaves more is chance
_PLACES = np.linspace(0.0, 1.0, 7)  # of the way that the run goes
_STEPS = 4
_MOVE = 1e-4  # of that way, a difference's


def spring_of(path: PathSpec) -> EffectSpec | None:
    """The spring of a piston, if the path has one."""
    springs = (e for e in path.effects if e.name == _NAME and e.place is Attachment.STATE)
    return next((e for e in springs if e.parameters["coefficient"] != 0.0), None)


def mounted_anywhere(check: Problem, path: PathSpec, spec: EffectSpec, residual: Array) -> tuple[PathSpec, Array]:
    """The path with a piston's spring where another run shows it to be, and what it then leaves of that run (n,).

    `residual` (n,) is what it leaves where it is: the place is another only where that is far more than noise, and
    hardly anything is left of it elsewhere.
    """
    given = _power(residual)
    if not check.windows.anchored or given < _LOUD * check.sigma**2 * len(residual):
        return path, residual
    low, high = (float(end(check.measured)) - path.rest for end in (np.min, np.max))
    way = high - low

    def at(place: float) -> Array:
        return check.residual(with_numbers(path, spec, {_PLACE: place}))

    place, best = min(((x, at(x)) for x in (low + share * way for share in _PLACES)), key=lambda one: _power(one[1]))
    for _ in range(_STEPS):
        slope = (at(place + _MOVE * way) - best) / (_MOVE * way)
        nearer = place - float(slope @ best) / max(float(slope @ slope), 1e-300)
        there = at(nearer)
        if not _power(there) < _power(best):
            break
        place, best = nearer, there
    if _power(best) > _LEAVES * given:
        return path, residual
    return with_numbers(path, spec, {_PLACE: place}), best


def _power(residual: Array) -> float:
    return float(np.sum(np.square(residual)))
