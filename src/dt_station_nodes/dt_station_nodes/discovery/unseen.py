"""What an explanation leaves of a run that no fit has seen."""

import numpy as np
from numpy.typing import NDArray

from ..core.models import EffectSpec, PathSpec
from .arrivals import arrival_of, arrived_anywhere
from .beginnings import begun_anywhere, loop_of
from .mounted import mounted_anywhere, spring_of
from .noise import noise_floor
from .problem import Problem
from .timing import PERIODIC, PHASES, begun, swung, with_numbers

Array = NDArray[np.float64]

# Steps of Gauss's and Newton's for the phases of a disturbance whose frequency swings, a difference's turn (rad).
_STEPS = 3
_TURN = 1e-3
# Mean square of a residual over the noise's: of one that says nothing, and of one that says much.
_QUIET = 1.3
_LOUD = 2.5


def unseen_residual(check: Problem, path: PathSpec) -> Array:
    """The residual (n,) of a path on a run it was not fitted to.

    A disturbance from outside goes on between runs: its frequency and shape are foretold, its phase is not. Nor is when
    its bursts begin, the phase of a second tone, of its frequency's swing or of a delay that wanders, or where in its
    gap a linkage begins, or when something came once. A piston's spring may have been mounted about another place.
    """
    residual = None
    spring = spring_of(path)
    if spring is not None:
        path, residual = mounted_anywhere(check, path, spring, check.residual(path))
    loop = loop_of(path)
    if loop is not None:
        path, residual = begun_anywhere(check, path, loop)
    arrival = arrival_of(path)
    if arrival is not None:
        path, residual = arrived_anywhere(check, path, arrival)
    swinging = _with_chance(path, PERIODIC, "modulation_rad")
    if swinging is not None:
        return _in_phases(check, path, swinging)
    for name, phase, _, size in PHASES:
        spec = _with_chance(path, name, size)
        if spec is not None:
            path, residual = _in_phase(check, path, spec, phase)
    return check.residual(path) if residual is None else residual


def has_chance(path: PathSpec) -> bool:
    """Whether a path has an effect of which a phase is chance, another in each run."""
    return any(_with_chance(path, name, size) is not None for name, _, _, size in PHASES)


def _with_chance(path: PathSpec, name: str, size: str) -> EffectSpec | None:
    return next((e for e in path.effects if e.name == name and e.parameters.get(size, 0.0) != 0.0), None)


def _in_phase(check: Problem, path: PathSpec, spec: EffectSpec, phase: str) -> tuple[PathSpec, Array]:
    """The path with one effect's phase as it is in another run, and what it leaves of that run (n,)."""
    # Small as it is, the residual is nearly linear in it: three phases tell all of a sinusoid's.
    begin = {"burst_start_s": begun(check, path, spec)} if spec.parameters.get("burst_period_s", 0.0) > 0.0 else {}
    given = spec.parameters[phase]

    def at(turn: float) -> tuple[PathSpec, Array]:
        moved = with_numbers(path, spec, {**begin, phase: given + turn})
        return moved, check.residual(moved)

    turns = np.array([0.0, 2.0, 4.0]) * np.pi / 3.0
    tried = [at(float(turn)) for turn in turns]
    powers = np.array([float(np.sum(np.square(residual))) for _, residual in tried])
    cosine, sine = (float(powers @ f(turns)) for f in (np.cos, np.sin))
    best = at(float(np.arctan2(-sine, -cosine)))
    return best if float(np.sum(np.square(best[1]))) < powers[0] else tried[0]


def _in_phases(check: Problem, path: PathSpec, spec: EffectSpec) -> Array:
    """What a disturbance whose frequency swings leaves of another run (n,), all its phases as they are there."""
    path = with_numbers(path, spec, swung(check, path, spec))
    path, best = _in_phase(check, path, path.effect(spec.name), "phase_rad")
    phases = [phase for name, phase, _, size in PHASES if name == spec.name and spec.parameters.get(size, 0.0) != 0.0]
    for _ in range(_STEPS):
        now = path.effect(spec.name)
        moved = [check.residual(with_numbers(path, now, {name: now.parameters[name] + _TURN})) for name in phases]
        slopes = np.column_stack([residual - best for residual in moved]) / _TURN
        turns = np.linalg.lstsq(slopes, -best, rcond=None)[0]
        numbers = {name: now.parameters[name] + float(turn) for name, turn in zip(phases, turns, strict=True)}
        there = with_numbers(path, now, numbers)
        residual = check.residual(there)
        if float(residual @ residual) >= float(best @ best):
            break
        path, best = there, residual
    return best


def shows_only(problem: Problem, check: Problem, unseen: Array | None, residual: Array, sigma: float) -> bool:
    """Whether a run that no fit has seen shows a gap `unseen` (n,), and the fitted one, of noise `sigma`, none."""
    if unseen is None:
        return False
    here = float(np.mean(np.square(residual))) / (sigma**2 + problem.negligible**2)
    noise = noise_floor(check.measured, unseen, check.noise)
    there = float(np.mean(np.square(unseen))) / (noise**2 + check.negligible**2)
    return here < _QUIET < _LOUD < there
