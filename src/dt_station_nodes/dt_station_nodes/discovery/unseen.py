"""What an explanation leaves of a run that no fit has seen."""

import numpy as np
from numpy.typing import NDArray

from ..core.models import EffectSpec, PathSpec
from .noise import noise_floor
from .problem import Problem

Array = NDArray[np.float64]

PERIODIC = "periodic_disturbance"
_PHASE = "phase_rad"
# Mean square of a residual over the noise's: of one that says nothing, and of one that says much.
_QUIET = 1.3
_LOUD = 2.5


def unseen_residual(check: Problem, path: PathSpec) -> Array:
    """The residual (n,) of a path on a run it was not fitted to.

    A disturbance from outside goes on between runs: its frequency and shape are foretold, its phase is not.
    """
    effects = path.effects
    place = next((i for i, effect in enumerate(effects) if effect.name == PERIODIC), None)
    if place is None:
        return check.residual(path)
    spec = effects[place]

    def shifted(phase: float) -> Array:
        moved = EffectSpec.model_construct(name=spec.name, at=spec.at, parameters={**spec.parameters, _PHASE: phase})
        return check.residual(path.model_copy(update={"effects": (*effects[:place], moved, *effects[place + 1 :])}))

    given = spec.parameters[_PHASE]
    # Small as the disturbance is, the residual is nearly linear in it: three phases tell all of a sinusoid's.
    turns = given + np.array([0.0, 2.0, 4.0]) * np.pi / 3.0
    seen = np.array([shifted(float(turn)) for turn in turns])
    powers = np.einsum("ij,ij->i", seen, seen)
    cosine, sine = (float(powers @ f(turns - given)) for f in (np.cos, np.sin))
    best = shifted(float(given + np.arctan2(-sine, -cosine)))
    return min((seen[0], best), key=lambda residual: float(residual @ residual))


def shows_only(check: Problem | None, unseen: Array | None, residual: Array, sigma: float) -> bool:
    """Whether a run that no fit has seen shows a gap `unseen` (n,), and the fitted one, of noise `sigma`, none."""
    if check is None or unseen is None:
        return False
    here = float(np.mean(np.square(residual))) / sigma**2
    there = float(np.mean(np.square(unseen))) / noise_floor(check.measured, unseen) ** 2
    return here < _QUIET < _LOUD < there
