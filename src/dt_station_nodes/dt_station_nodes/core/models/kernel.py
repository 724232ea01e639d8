"""The compiled heart: runs both paths with all their effects over a block of samples.

One function serves stepping and whole simulations, so that both give the same bits.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from .compiled import (
    FREE_OUTPUT,
    FREE_VELOCITY,
    INJECTION,
    INJECTION_GAIN,
    LOAD,
    OUTPUT,
    RAW_INPUT,
    REST,
    SUBSTEP,
    TIME,
    VELOCITY_GAIN,
    call_step,
)

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

INPUT, STATE, OUT = 0, 1, 2


class PathArrays(NamedTuple):
    """One path ready for the kernel; shapes in n states, m disturbance states, k effects."""

    a: Array  # (n, n)
    b: Array  # (n,)
    e: Array  # (n,)
    c: Array  # (n,)
    velocity: Array  # (n,)
    direct: Array  # (3,): feed-through, velocity feed-through, rest (SI)
    gains: Array  # (2,): change of free velocity per volt, of free output per injection, over a sub-step
    da: Array  # (m, m), disturbance path, input Pa
    db: Array  # (m,)
    dc: Array  # (m,)
    dvelocity: Array  # (m,)
    ddirect: Array  # (2,)
    kind: Integers  # (k,): INPUT, STATE or OUT, sorted in this order
    address: Integers  # (k,): of the effects' steps
    parameter_at: Integers  # (k,): where each effect's parameters start
    state_at: Integers  # (k,): where each effect's state starts
    parameters: Array


@njit(cache=True)  # type: ignore[untyped-decorator]
def _dot(x: Array, y: Array) -> float:
    total = 0.0
    for i in range(x.size):
        total += x[i] * y[i]
    return total


@njit(cache=True)  # type: ignore[untyped-decorator]
def _advance(a: Array, b: Array, u: float, x: Array, scratch: Array) -> None:
    for i in range(x.size):
        total = b[i] * u
        for j in range(x.size):
            total += a[i, j] * x[j]
        scratch[i] = total
    for i in range(x.size):
        x[i] = scratch[i]


@njit(cache=True)  # type: ignore[untyped-decorator]
def _substep(path: PathArrays, x: Array, xd: Array, memory: Array, voltage: float, load: float, c: Array, scratch: Array) -> float:
    """Advance one path by one sub-step; the output above rest at its end, output effects applied."""
    pp = path.parameters.ctypes.data
    mp = memory.ctypes.data
    cp = c.ctypes.data
    n_effects = path.kind.size
    c[RAW_INPUT] = voltage
    c[LOAD] = load
    c[INJECTION] = 0.0
    u = voltage
    k = 0
    while k < n_effects and path.kind[k] == INPUT:
        u = call_step(path.address[k], pp + 8 * path.parameter_at[k], mp + 8 * path.state_at[k], u, cp)
        k += 1
    n = x.size
    if k < n_effects and path.kind[k] == STATE:
        c[OUTPUT] = _dot(path.c, x) + _dot(path.dc, xd)
        c[VELOCITY_GAIN] = path.gains[0]
        c[INJECTION_GAIN] = path.gains[1]
        away = 0.0
        away_velocity = path.ddirect[1] * load
        for i in range(xd.size):
            total = path.db[i] * load
            for j in range(xd.size):
                total += path.da[i, j] * xd[j]
            away += path.dc[i] * total
            away_velocity += path.dvelocity[i] * total
        for i in range(n):
            total = 0.0
            for j in range(n):
                total += path.a[i, j] * x[j]
            scratch[i] = total
        drift = _dot(path.c, scratch) + away
        drift_velocity = _dot(path.velocity, scratch) + away_velocity
        output_gain = _dot(path.c, path.b) + path.direct[0]
        injected_velocity = _dot(path.velocity, path.e)
        while k < n_effects and path.kind[k] == STATE:
            c[FREE_OUTPUT] = drift + output_gain * u + path.gains[1] * c[INJECTION]
            c[FREE_VELOCITY] = drift_velocity + path.gains[0] * u + injected_velocity * c[INJECTION]
            u = call_step(path.address[k], pp + 8 * path.parameter_at[k], mp + 8 * path.state_at[k], u, cp)
            k += 1
        for i in range(n):
            x[i] = scratch[i] + path.b[i] * u + path.e[i] * c[INJECTION]
    else:
        _advance(path.a, path.b, u, x, scratch)
    if xd.size > 0:
        _advance(path.da, path.db, load, xd, scratch)
    y = _dot(path.c, x) + path.direct[0] * u + _dot(path.dc, xd) + path.ddirect[0] * load
    while k < n_effects:
        y = call_step(path.address[k], pp + 8 * path.parameter_at[k], mp + 8 * path.state_at[k], y, cp)
        k += 1
    return y


@njit(cache=True)  # type: ignore[untyped-decorator]
def run(
    pressure: PathArrays,
    position: PathArrays,
    timing: Array,
    state: Array,
    layout: Integers,
    voltages: Array,
    measured: Array,
    context: Array,
    outputs: Array,
) -> None:
    """Simulate n samples in place.

    `timing`: sample time s, sub-steps a sample, 1 to interpolate the measured pressure within a sample (0: hold);
    `state`: sample count, output above rest of each path, then per path linear states, disturbance states and
    effects' memory, bounded by `layout` (7,); `voltages` (n, 2): load, servo; `measured` (n,) pressure in Pa, or
    empty to drive the disturbance path with the simulated one; `outputs` (n, 2): pressure, position in SI, each
    at its sample, before that sample's voltages act.
    """
    x0 = state[layout[0] : layout[1]]
    d0 = state[layout[1] : layout[2]]
    m0 = state[layout[2] : layout[3]]
    x1 = state[layout[3] : layout[4]]
    d1 = state[layout[4] : layout[5]]
    m1 = state[layout[5] : layout[6]]
    scratch = np.empty(max(x0.size, x1.size, d0.size, d1.size, 1))
    substeps = int(timing[1])
    h = timing[0] / substeps
    rest = pressure.direct[2]
    n = voltages.shape[0]
    context[SUBSTEP] = h
    context[REST] = rest
    for i in range(n):
        outputs[i, 0] = state[1] + rest
        outputs[i, 1] = state[2] + position.direct[2]
        for j in range(substeps):
            context[TIME] = state[0] * timing[0] + j * h
            if measured.size > 0:
                load = measured[i] - rest
                if timing[2] > 0.0 and i + 1 < n:
                    load += (measured[i + 1] - measured[i]) * ((j + 0.5) / substeps)
            else:
                load = state[1]
            before = state[1]
            state[1] = _substep(pressure, x0, d0, m0, voltages[i, 0], 0.0, context, scratch)
            if measured.size == 0:
                # The mean over the sub-step: the simulated pressure moves while the position path integrates it.
                load = 0.5 * (before + state[1])
            state[2] = _substep(position, x1, d1, m1, voltages[i, 1], load, context, scratch)
        state[0] += 1.0
