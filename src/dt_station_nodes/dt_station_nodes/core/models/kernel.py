"""The compiled heart: runs both paths with all their effects over a block of samples.

One function serves stepping and whole simulations, so that both give the same bits. A path's numbers lie in one
flat array and its places in another: passing many small arrays costs more than the arithmetic they hold. For the
same reason nothing here allocates, what a sub-step calls is inlined, and inside it there are only plain pointers
(arguments ending in `_at` are addresses), which carry no bounds and no reference count. Linear states are read from
one copy of the state (`now_at`) and written to another (`then_at`), which then change places: copying them back
would make each sample wait for the last.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from . import path_map as at
from .compiled import (
    CONTEXT_SIZE,
    FREE_OUTPUT,
    FREE_VELOCITY,
    INJECTION,
    INJECTION_GAIN,
    INLET_RATE,
    LOAD,
    LOAD_OUTPUT,
    LOAD_VELOCITY,
    OTHER_INPUT,
    OUTLET_RATE,
    OUTPUT,
    OUTPUT_GAIN,
    OUTPUT_REST,
    OWN_LOAD,
    RAW_INPUT,
    REST,
    SETTLING_RATE,
    SPEED_GAIN,
    STAGE,
    STATIC_GAIN,
    SUBSTEP,
    TIME,
    VELOCITY,
    VELOCITY_GAIN,
    Doubles,
    call_step,
    doubles,
    halfway,
    integers,
)
from .small import advance, dot

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


class _Laid(NamedTuple):
    """Where a path's arrays begin, as addresses, and its counts: looked up once a run, not in each sub-step."""

    numbers: int
    effects: int
    memory: int
    states_at: int  # bytes into the state
    away_at: int
    n: int  # states of its own,
    m: int  # and of what the load moves
    input_end: int
    state_end: int
    output_end: int
    a: int
    b: int
    e: int
    c: int
    velocity: int
    away_a: int
    away_b: int
    away_c: int
    away_velocity: int


@njit(cache=True, _nrt=False, forceinline=True)
def _laid(numbers: int, places_at: int, memory: int) -> _Laid:
    places = integers(places_at)
    states_at = 8 * places[at.STATE_AT]
    return _Laid(
        numbers,
        places_at + 8 * at.PER_EFFECT,
        memory,
        states_at,
        states_at + 8 * places[at.STATES],
        places[at.STATES],
        places[at.AWAY_STATES],
        places[at.INPUT_END],
        places[at.STATE_END],
        places[at.EFFECTS],
        numbers + 8 * places[at.A],
        numbers + 8 * places[at.B],
        numbers + 8 * places[at.E],
        numbers + 8 * places[at.C],
        numbers + 8 * places[at.VELOCITY],
        numbers + 8 * places[at.AWAY_A],
        numbers + 8 * places[at.AWAY_B],
        numbers + 8 * places[at.AWAY_C],
        numbers + 8 * places[at.AWAY_VELOCITY],
    )


@njit(cache=True, _nrt=False, forceinline=True)
def _effect(path: _Laid, k: int, value: float, context: int) -> float:
    places = integers(path.effects + 24 * k)
    return call_step(places[0], path.numbers + 8 * places[1], path.memory + 8 * places[2], value, context)


@njit(cache=True, _nrt=False)
def _constants(numbers: Doubles, context: Doubles) -> None:
    """What a path's effects are told that never changes."""
    context[VELOCITY_GAIN], context[INJECTION_GAIN] = numbers[at.GAIN_VELOCITY], numbers[at.GAIN_INJECTION]
    context[OUTLET_RATE], context[INLET_RATE] = numbers[at.DECAY], numbers[at.INLET_DECAY]
    context[STATIC_GAIN], context[SETTLING_RATE] = numbers[at.STATIC], numbers[at.SETTLING]
    context[OUTPUT_REST], context[SPEED_GAIN] = numbers[at.REST_OUTPUT], numbers[at.SPEED]
    context[OUTPUT_GAIN] = numbers[at.GAIN_OUTPUT]


@njit(cache=True, _nrt=False, forceinline=True)
def _inside(path: _Laid, u: float, load: float, context_at: int, now_at: int, then_at: int) -> float:
    """Advance the linear states through the effects inside the path; the voltage they leave."""
    numbers, context = doubles(path.numbers), doubles(context_at)
    n, m = path.n, path.m
    x, x_next = doubles(now_at + path.states_at), doubles(then_at + path.states_at)
    xd, xd_next = doubles(now_at + path.away_at), doubles(then_at + path.away_at)
    c, velocity, b, e = doubles(path.c), doubles(path.velocity), doubles(path.b), doubles(path.e)
    away_c = doubles(path.away_c)
    context[STAGE] = 1.0
    context[OUTPUT] = dot(c, x, n) + dot(away_c, xd, m)
    context[VELOCITY] = dot(velocity, x, n)
    load_velocity = numbers[at.AWAY_DIRECT_VELOCITY] * load + dot(doubles(path.away_velocity), xd_next, m)
    context[LOAD_VELOCITY] = load_velocity
    advance(doubles(path.a), b, 0.0, x, n, x_next)
    load_output = numbers[at.AWAY_DIRECT] * load + dot(away_c, xd_next, m)
    context[LOAD_OUTPUT] = load_output
    drift = dot(c, x_next, n) + load_output
    drift_velocity = dot(velocity, x_next, n) + load_velocity
    for k in range(path.input_end, path.state_end):
        flow = context[INJECTION]
        context[FREE_OUTPUT] = drift + numbers[at.GAIN_OUTPUT] * u + numbers[at.GAIN_INJECTION] * flow
        context[FREE_VELOCITY] = (
            drift_velocity + numbers[at.GAIN_VELOCITY] * u + numbers[at.GAIN_INJECTED_VELOCITY] * flow
        )
        if context[OWN_LOAD] > 0.0:
            context[LOAD] = halfway(context)
        u = _effect(path, k, u, context_at)
    flow = context[INJECTION]
    for i in range(n):
        x_next[i] += b[i] * u + e[i] * flow
    return u


@njit(cache=True, _nrt=False, forceinline=True)
def _substep(path: _Laid, voltage: float, load: float, context_at: int, now_at: int, then_at: int) -> float:
    """Advance one path by one sub-step; the output above rest at its end, output effects applied."""
    numbers, context = doubles(path.numbers), doubles(context_at)
    n, m = path.n, path.m
    x, x_next = doubles(now_at + path.states_at), doubles(then_at + path.states_at)
    xd, xd_next = doubles(now_at + path.away_at), doubles(then_at + path.away_at)
    u = voltage
    if path.output_end > 0:
        context[RAW_INPUT] = voltage
        context[LOAD] = load
        if context[OWN_LOAD] > 0.0 and numbers[at.DIRECT_VELOCITY] == 0.0:
            context[LOAD] += 0.5 * context[SUBSTEP] * dot(doubles(path.velocity), x, n)
        context[INJECTION] = 0.0
        context[STAGE] = 0.0
        for k in range(path.input_end):
            u = _effect(path, k, u, context_at)
    if m > 0:
        advance(doubles(path.away_a), doubles(path.away_b), load, xd, m, xd_next)
    if path.state_end > path.input_end:
        u = _inside(path, u, load, context_at, now_at, then_at)
    else:
        advance(doubles(path.a), doubles(path.b), u, x, n, x_next)
    y = dot(doubles(path.c), x_next, n) + numbers[at.DIRECT] * u
    if m > 0:
        y += numbers[at.AWAY_DIRECT] * load + dot(doubles(path.away_c), xd_next, m)
    if path.output_end > path.state_end:
        context[STAGE] = 2.0
        for k in range(path.state_end, path.output_end):
            y = _effect(path, k, y, context_at)
    return y


@njit(cache=True, nogil=True)
def run(
    pressure: Array,
    pressure_places: Integers,
    position: Array,
    position_places: Integers,
    timing: Array,
    state: Array,
    voltages: Array,
    measured: Array,
    context: Array,
    scratch: Array,
    outputs: Array,
    part: tuple[int, int],
) -> None:
    """Simulate a `part` of n samples in place: from its first number up to its second.

    `timing`: sample time s, sub-steps a sample, 1 to interpolate the measured pressure within a sample (0: hold);
    `state`: sample count, output above rest of each path, then the paths' states; `voltages` (n, 2): load, servo;
    `measured` (n,) or one more: pressure in Pa, or empty to drive the disturbance path with the simulated one;
    `outputs` (n, 2): pressure, position in SI, each at its sample, before that sample's voltages act; `scratch` is as
    long as `state`, `context` holds CONTEXT_SIZE numbers for each path.
    """
    substeps = int(timing[1])
    h = timing[0] / substeps
    rest = pressure[at.REST_OUTPUT]
    memory, now, then = state.ctypes.data, state.ctypes.data, scratch.ctypes.data
    first = _laid(pressure.ctypes.data, pressure_places.ctypes.data, memory)
    second = _laid(position.ctypes.data, position_places.ctypes.data, memory)
    has_pressure, has_position = pressure_places[at.PRESENT] > 0, position_places[at.PRESENT] > 0
    first_context, second_context = context.ctypes.data, context.ctypes.data + 8 * CONTEXT_SIZE
    context[OWN_LOAD] = 1.0
    for half, path in ((0, pressure), (CONTEXT_SIZE, position)):
        context[half + SUBSTEP], context[half + REST] = h, rest
        _constants(doubles(path.ctypes.data), doubles(context.ctypes.data + 8 * half))
    for i in range(part[0], part[1]):
        outputs[i, 0], outputs[i, 1] = state[1] + rest, state[2] + position[at.REST_OUTPUT]
        context[OTHER_INPUT], context[CONTEXT_SIZE + OTHER_INPUT] = voltages[i, 1], voltages[i, 0]
        for j in range(substeps):
            context[TIME] = context[CONTEXT_SIZE + TIME] = state[0] * timing[0] + j * h
            before = state[1]
            if has_pressure:
                state[1] = _substep(first, voltages[i, 0], before, first_context, now, then)
            if has_position:
                if measured.size > 0:
                    load = measured[i] - rest
                    if timing[2] > 0.0 and i + 1 < measured.size:
                        load += (measured[i + 1] - measured[i]) * ((j + 0.5) / substeps)
                else:
                    # The mean over the sub-step: the simulated pressure moves while the position path integrates it.
                    load = 0.5 * (before + state[1])
                state[2] = _substep(second, voltages[i, 1], load, second_context, now, then)
            now, then = then, now
        state[0] += 1.0
    if now != memory:
        for places in (pressure_places, position_places):
            for i in range(places[at.STATES] + places[at.AWAY_STATES]):
                state[places[at.STATE_AT] + i] = scratch[places[at.STATE_AT] + i]
