"""From a validated path to the flat arrays that the kernel runs."""

import math
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ..channels import Channel
from . import path_map
from .effects import Attachment, Effect, registry
from .layout import NOTHING, LaidOut, lay_out
from .linear import Coefficients, LinearPath
from .spec import PathSpec

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

# Long enough for speed at 20 ms, short enough that stick, lag and delay are resolved.
LONGEST_SUBSTEP_S = 0.005
# What is fed back is held over a sub-step, as it is half-way: at most so much of a swing may pass meanwhile.
FINE_RAD = 0.3
# A slow plant is sampled slowly: beyond this its sub-steps would only cost time.
MOST_SUBSTEPS = 8

_ORDER = {Attachment.INPUT: 0, Attachment.STATE: 1, Attachment.OUTPUT: 2}


@dataclass(frozen=True, slots=True)
class PreparedPath:
    """One path as the kernel takes it; its states occupy `size` places of the model's state from `state_at` on."""

    linear: LinearPath
    numbers: Array
    places: Integers
    state_at: int
    size: int
    rest: float


def substeps(paths: Collection[PathSpec], sample_time_s: float) -> int:
    """Sub-steps a sample needs: one, unless an effect or the disturbance path moves within a sample."""
    effects = [effect for path in paths for effect in path.effects]
    coupled = any(path.disturbance is not None for path in paths)
    inside = any(effect.place is Attachment.STATE for effect in effects)
    if not (coupled or inside or any(registry()[e.name].moves(e.parameters) for e in effects)):
        return 1
    resolved = max((_feedback_rate(path) for path in paths), default=0.0) * sample_time_s / FINE_RAD
    return min(max(1, math.ceil(max(sample_time_s / LONGEST_SUBSTEP_S, resolved) - 1e-9)), MOST_SUBSTEPS)


def _feedback_rate(path: PathSpec) -> float:
    """Rate (rad/s) at which a static path answers an effect inside it that feeds its output back; 0 without one."""
    attached = (registry()[effect.name] for effect in path.effects if effect.place is Attachment.STATE)
    inside = [effect for effect in attached if effect.sub_stepped]
    order = len(path.denominator) - 1
    if all(e.only_paces for e in inside) or not order or path.denominator[-1] == 0.0:
        return 0.0
    return float(abs(path.denominator[-1] / path.denominator[0]) ** (1.0 / order)) / path.time_scale


def prepare(path: PathSpec | None, channel: Channel, step_s: float, state_at: int) -> PreparedPath:
    """Discretise a path and lay out its numbers; an absent path gives a constant zero."""
    chosen = () if path is None else path.effects
    stages = [(_ORDER[e.place], registry()[e.name], e.parameters) for e in chosen]
    if len(stages) > 1:
        stages.sort(key=lambda one: (one[0], channel in one[1].feels_all_on))
    inside = any(rank == _ORDER[Attachment.STATE] for rank, _, _ in stages)
    fixed = NOTHING if path is None else _laid_out(path, step_s, inside)
    n, m = fixed.linear.b.size, fixed.away_states

    listed = tuple((rank, effect.step.address, len(effect.names), effect.state_size) for rank, effect, _ in stages)
    places, size = _places(listed, fixed.at, n, m, state_at, path is not None)
    given: list[float] = []
    for _, effect, parameters in stages:
        given += _numbers(effect, parameters)
    numbers = np.empty(fixed.numbers.size + len(given))
    numbers[: fixed.numbers.size] = fixed.numbers
    numbers[fixed.numbers.size :] = given
    rest = 0.0 if path is None else path.rest
    numbers[path_map.REST_OUTPUT] = rest
    return PreparedPath(fixed.linear, numbers, places, state_at, size, rest)


@lru_cache(maxsize=512)
def _places(
    stages: tuple[tuple[int, int, int, int], ...], at: tuple[int, ...], n: int, m: int, state_at: int, present: bool
) -> tuple[Integers, int]:
    """Where a path's numbers and states lie (shared: read only), and how many states it has in all.

    `stages`: of each effect its place's rank, its step's address, how many parameters and states it has; `at`: where
    each part of the linear path begins.
    """
    places = np.zeros(path_map.PER_EFFECT + 3 * len(stages), dtype=np.int64)
    ranks = [rank for rank, _, _, _ in stages]
    places[path_map.STATES], places[path_map.AWAY_STATES] = n, m
    places[path_map.INPUT_END] = ranks.count(_ORDER[Attachment.INPUT])
    places[path_map.STATE_END] = places[path_map.INPUT_END] + ranks.count(_ORDER[Attachment.STATE])
    places[path_map.EFFECTS] = len(stages)
    places[path_map.A : path_map.PARAMETERS + 1] = at
    places[path_map.STATE_AT] = state_at
    places[path_map.PRESENT] = present
    numbers_at, memory_at = at[-1], state_at + n + m
    for k, (_, address, parameters, states) in enumerate(stages):
        place = path_map.PER_EFFECT + 3 * k
        places[place : place + 3] = address, numbers_at, memory_at
        numbers_at += parameters
        memory_at += states
    return places, memory_at - state_at


def _numbers(effect: Effect, given: dict[str, float]) -> Iterable[float]:
    """An effect's parameters in order; fits give them so already, thousands of times."""
    return (given if tuple(given) == effect.names else effect.complete(given)).values()


def _laid_out(path: PathSpec, step_s: float, inside: bool) -> LaidOut:
    away = path.disturbance
    return lay_out(
        Coefficients(path.numerator, path.denominator, path.gain, path.time_scale),
        path.scale,
        None if away is None else Coefficients(away.numerator, away.denominator, away.gain, away.time_scale),
        1.0 if away is None else path.scale * away.input_scale,
        step_s,
        path.outlet if inside else None,
    )


def standing(path: PreparedPath, above: float) -> Array:
    """Linear states, shape (n,), at which the output stands at `above` rest with the voltage that holds it there.

    In the companion form each state is the derivative of the next, so only the last one is not 0.
    """
    states = np.zeros(path.linear.b.size)
    if states.size and path.linear.standing_gain != 0.0:
        states[-1] = above / path.linear.standing_gain
    return states
