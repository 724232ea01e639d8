"""The compiled heart: runs both paths with all their effects over a block of samples.

One function serves stepping and whole simulations, so that both give the same bits. A path's numbers lie in one
flat array and its places in another: passing many small arrays costs more than the arithmetic they hold. For the
same reason nothing here allocates, and arrays are not reference-counted (`_nrt=False`).
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from .compiled import (
    FREE_OUTPUT,
    FREE_VELOCITY,
    INJECTION,
    INJECTION_GAIN,
    INLET_RATE,
    LOAD,
    LOAD_VELOCITY,
    OUTLET_RATE,
    OUTPUT,
    OUTPUT_REST,
    RAW_INPUT,
    REST,
    STAGE,
    STATIC_GAIN,
    SUBSTEP,
    TIME,
    VELOCITY_GAIN,
    call_step,
)
from .compiled import VELOCITY as VELOCITY_NOW

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

# Places in a path's `places`; the A_T.. ones are offsets into its `numbers`.
STATES = 0  # number n of linear states
AWAY_STATES = 1  # number m of disturbance states
INPUT_END = 2  # effects before it act on the input,
STATE_END = 3  # those before it inside the path,
EFFECTS = 4  # the rest, up to this number, on the output
A_T = 5  # (n, n) transposed, so that the inner loop runs over independent sums
B = 6  # (n,)
E = 7  # (n,)
C = 8  # (n,)
VELOCITY = 9  # (n,)
AWAY_A_T = 10  # (m, m) transposed; the disturbance path's input is in Pa
AWAY_B = 11  # (m,)
AWAY_C = 12  # (m,)
AWAY_VELOCITY = 13  # (m,)
PARAMETERS = 14
STATE_AT = 15  # offset of the path's linear states in the state; then disturbance states, then effects' memory
PER_EFFECT = 16  # then three places an effect: address, parameters' offset, memory's offset

# The first numbers of a path.
DIRECT = 0  # output per volt, at once
DIRECT_VELOCITY = 1
AWAY_DIRECT = 2  # output per Pa, at once
AWAY_DIRECT_VELOCITY = 3
GAIN_VELOCITY = 4  # free velocity at the sub-step's end per volt
GAIN_OUTPUT = 5  # free output at the sub-step's end per volt
GAIN_INJECTION = 6  # free output at the sub-step's end per injection
GAIN_INJECTED_VELOCITY = 7
REST_OUTPUT = 8  # SI
DECAY = 9  # of what is injected, 1/s
INLET_DECAY = 10  # of the store before, 1/s
STATIC = 11  # output per volt at rest
HEADER = 12


@njit(cache=True, _nrt=False)
def _dot(numbers: Array, at: int, x: Array, x_at: int, n: int) -> float:
    total = 0.0
    for i in range(n):
        total += numbers[at + i] * x[x_at + i]
    return total


@njit(cache=True, _nrt=False)
def _advance(numbers: Array, a_t: int, b: int, u: float, x: Array, x_at: int, n: int, scratch: Array) -> None:
    """Put a x + b u into scratch."""
    for i in range(n):
        scratch[i] = numbers[b + i] * u
    for j in range(n):
        for i in range(n):
            scratch[i] += numbers[a_t + j * n + i] * x[x_at + j]


@njit(cache=True, _nrt=False)
def _effect(numbers: Array, places: Integers, k: int, state: Array, value: float, context: Array) -> float:
    at = PER_EFFECT + 3 * k
    return call_step(
        places[at],
        numbers.ctypes.data + 8 * places[at + 1],
        state.ctypes.data + 8 * places[at + 2],
        value,
        context.ctypes.data,
    )


@njit(cache=True, _nrt=False)
def _substep(
    numbers: Array, places: Integers, state: Array, voltage: float, load: float, context: Array, scratch: Array
) -> float:
    """Advance one path by one sub-step; the output above rest at its end, output effects applied."""
    n = places[STATES]
    m = places[AWAY_STATES]
    x = places[STATE_AT]
    xd = x + n
    context[RAW_INPUT] = voltage
    context[LOAD] = load
    context[INJECTION] = 0.0
    context[STAGE] = 0.0
    u = voltage
    for k in range(places[INPUT_END]):
        u = _effect(numbers, places, k, state, u, context)
    away = numbers[AWAY_DIRECT] * load
    away_velocity = numbers[AWAY_DIRECT_VELOCITY] * load
    before = 0.0
    inside = places[STATE_END] > places[INPUT_END]
    if inside:
        before = _dot(numbers, places[C], state, x, n) + _dot(numbers, places[AWAY_C], state, xd, m)
    if m > 0:
        _advance(numbers, places[AWAY_A_T], places[AWAY_B], load, state, xd, m, scratch)
        for i in range(m):
            state[xd + i] = scratch[i]
        away += _dot(numbers, places[AWAY_C], state, xd, m)
        away_velocity += _dot(numbers, places[AWAY_VELOCITY], state, xd, m)
    if inside:
        _advance(numbers, places[A_T], places[B], 0.0, state, x, n, scratch)
        drift = _dot(numbers, places[C], scratch, 0, n) + away
        drift_velocity = _dot(numbers, places[VELOCITY], scratch, 0, n) + away_velocity
        context[STAGE] = 1.0
        context[OUTPUT] = before
        context[LOAD_VELOCITY] = away_velocity
        context[VELOCITY_GAIN] = numbers[GAIN_VELOCITY]
        context[INJECTION_GAIN] = numbers[GAIN_INJECTION]
        context[OUTLET_RATE] = numbers[DECAY]
        context[INLET_RATE] = numbers[INLET_DECAY]
        context[STATIC_GAIN] = numbers[STATIC]
        context[VELOCITY_NOW] = _dot(numbers, places[VELOCITY], state, x, n)
        context[OUTPUT_REST] = numbers[REST_OUTPUT]
        for k in range(places[INPUT_END], places[STATE_END]):
            flow = context[INJECTION]
            context[FREE_OUTPUT] = drift + numbers[GAIN_OUTPUT] * u + numbers[GAIN_INJECTION] * flow
            context[FREE_VELOCITY] = (
                drift_velocity + numbers[GAIN_VELOCITY] * u + numbers[GAIN_INJECTED_VELOCITY] * flow
            )
            u = _effect(numbers, places, k, state, u, context)
        flow = context[INJECTION]
        for i in range(n):
            state[x + i] = scratch[i] + numbers[places[B] + i] * u + numbers[places[E] + i] * flow
    else:
        _advance(numbers, places[A_T], places[B], u, state, x, n, scratch)
        for i in range(n):
            state[x + i] = scratch[i]
    y = _dot(numbers, places[C], state, x, n) + numbers[DIRECT] * u + away
    context[STAGE] = 2.0
    for k in range(places[STATE_END], places[EFFECTS]):
        y = _effect(numbers, places, k, state, y, context)
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
) -> None:
    """Simulate n samples in place.

    `timing`: sample time s, sub-steps a sample, 1 to interpolate the measured pressure within a sample (0: hold);
    `state`: sample count, output above rest of each path, then the paths' states; `voltages` (n, 2): load, servo;
    `measured` (n,): pressure in Pa, or empty to drive the disturbance path with the simulated one; `outputs`
    (n, 2): pressure, position in SI, each at its sample, before that sample's voltages act; `scratch` holds at least
    as many numbers as a path has states.
    """
    substeps = int(timing[1])
    h = timing[0] / substeps
    rest = pressure[REST_OUTPUT]
    n = voltages.shape[0]
    context[SUBSTEP] = h
    context[REST] = rest
    for i in range(n):
        outputs[i, 0] = state[1] + rest
        outputs[i, 1] = state[2] + position[REST_OUTPUT]
        for j in range(substeps):
            context[TIME] = state[0] * timing[0] + j * h
            before = state[1]
            state[1] = _substep(pressure, pressure_places, state, voltages[i, 0], before, context, scratch)
            if measured.size > 0:
                load = measured[i] - rest
                if timing[2] > 0.0 and i + 1 < n:
                    load += (measured[i + 1] - measured[i]) * ((j + 0.5) / substeps)
            else:
                # The mean over the sub-step: the simulated pressure moves while the position path integrates it.
                load = 0.5 * (before + state[1])
            state[2] = _substep(position, position_places, state, voltages[i, 1], load, context, scratch)
        state[0] += 1.0
