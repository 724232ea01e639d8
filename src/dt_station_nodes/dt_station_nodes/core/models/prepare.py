"""From a validated path to the flat arrays that the kernel runs."""

import math
from collections.abc import Collection
from dataclasses import dataclass

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

_ORDER = (Attachment.INPUT, Attachment.STATE, Attachment.OUTPUT)


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
    if not (coupled or inside or any(registry()[effect.name].sub_stepped for effect in effects)):
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
    listed = [(e.place, registry()[e.name], e.parameters) for e in chosen]
    stages = sorted(listed, key=lambda one: (_ORDER.index(one[0]), channel in one[1].feels_all_on))
    attached = [attachment for attachment, _, _ in stages]
    fixed = NOTHING if path is None else _laid_out(path, step_s, Attachment.STATE in attached)
    n, m = fixed.linear.b.size, fixed.away_states

    parameters = [_numbers(effect, given) for _, effect, given in stages]
    places = np.zeros(path_map.PER_EFFECT + 3 * len(stages), dtype=np.int64)
    places[path_map.STATES], places[path_map.AWAY_STATES] = n, m
    places[path_map.INPUT_END] = attached.count(Attachment.INPUT)
    places[path_map.STATE_END] = places[path_map.INPUT_END] + attached.count(Attachment.STATE)
    places[path_map.EFFECTS] = len(stages)
    places[path_map.A : path_map.PARAMETERS + 1] = fixed.at
    places[path_map.STATE_AT] = state_at
    places[path_map.PRESENT] = path is not None
    numbers_at, memory_at = fixed.numbers.size, state_at + n + m
    for k, ((_, effect, _), block) in enumerate(zip(stages, parameters, strict=True)):
        place = path_map.PER_EFFECT + 3 * k
        places[place : place + 3] = effect.step.address, numbers_at, memory_at
        numbers_at += block.size
        memory_at += effect.state_size
    numbers = np.concatenate([fixed.numbers, *parameters])
    rest = 0.0 if path is None else path.rest
    numbers[path_map.REST_OUTPUT] = rest
    return PreparedPath(fixed.linear, numbers, places, state_at, memory_at - state_at, rest)


def _numbers(effect: Effect, given: dict[str, float]) -> Array:
    """An effect's parameters in order; fits give them so already, thousands of times."""
    complete = given if tuple(given) == effect.names else effect.complete(given)
    return np.array(list(complete.values()), dtype=np.float64)


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
