"""Starting values without a guess from the user: refined instrumental variables in continuous time (SRIVC).

Young and Jakeman 1980; Garnier and Wang (eds.), Identification of Continuous-time Models from Sampled Data,
Springer 2008, chapter 4.
"""

from collections.abc import Sequence

import numpy as np

from ..core.run import Array
from .propagation import filter_held, filter_smooth
from .sensitivity import linear_columns, simulated
from .structure import Data, Hold, PathStructure, Structure, slices

ROUNDS = 8


def linear_start(
    structure: Structure, denominators: Sequence[Array], data: Data, rate_rad_s: float
) -> tuple[Array, float]:
    """Best parameters for given free denominators (normalised time), and their squared simulation error."""
    theta = np.zeros(structure.size)
    free = np.ones(structure.size, dtype=bool)
    for path, where, denominator in zip(structure.paths, slices(structure), denominators, strict=True):
        theta[where[1]] = denominator[1:]
        free[where[1]] = False
        if path.estimate_delay:
            theta[where[2]] = path.delay_s
            free[where[2]] = False
    columns = linear_columns(structure, theta, data, rate_rad_s)[:, free]
    scale = np.linalg.norm(columns, axis=0)
    scale[scale == 0.0] = 1.0
    columns = columns / scale
    solution = np.linalg.lstsq(columns.T @ columns, columns.T @ data.output, rcond=1e-14)[0]
    theta[free] = solution / scale
    return theta, float(np.sum((data.output - columns @ solution) ** 2))


def pole_starts(path: PathStructure, data: Data, index: int = 0) -> list[Array]:
    """Free denominators (physical time, monic) worth refining, best first, one of each filter cut-off tried.

    Stops trying cut-offs where two of them lead to the same, best simulation error.
    """
    if path.free_poles == 0:
        return [np.ones(1)]
    nyquist = np.pi / data.sample_time_s
    slowest = 4.0 * np.pi / (data.sample_time_s * len(data))
    found: list[tuple[float, int, Array]] = []
    for cutoff in np.geomspace(max(nyquist / 300.0, slowest), nyquist / 2.0, 6)[[3, 2, 4, 1, 5, 0]]:
        outcome = _instrumental(path, data, index, float(cutoff))
        if outcome is None:
            continue
        again = any(abs(cost - outcome[1]) < 1e-3 * cost for cost, _, _ in found)
        found.append((outcome[1], len(found), outcome[0]))
        if again and outcome[1] < 1.001 * min(cost for cost, _, _ in found):
            break
    return [denominator for _, _, denominator in sorted(found, key=lambda item: item[:2])]


def _instrumental(path: PathStructure, data: Data, index: int, rate_rad_s: float) -> tuple[Array, float] | None:
    """SRIVC from one cut-off: the free denominator with the least simulation error of all rounds, and that error."""
    single = Structure((path,), initial_states=True)
    alone = Data(data.sample_time_s, (data.inputs[index],), data.output)
    normal = Data(data.sample_time_s * rate_rad_s, alone.inputs, alone.output)
    denominator = np.asarray(np.poly(-np.ones(path.free_poles)), dtype=np.float64)
    instrument = data.output
    best: Array | None = None
    best_cost = np.inf
    for round_number in range(ROUNDS):
        estimated = _regression(path, normal, denominator, instrument)
        if estimated is None:
            break
        denominator = stabilised(estimated)
        theta, cost = linear_start(single, (denominator,), alone, rate_rad_s)
        instrument = simulated(single, theta, alone, rate_rad_s)
        if cost < best_cost * (1.0 - 1e-6):
            best, best_cost = denominator, cost
        elif round_number > 3 and cost < best_cost * (1.0 + 1e-4):
            break
    if best is None:
        return None
    return best * rate_rad_s ** np.arange(best.size), best_cost


def _regression(path: PathStructure, data: Data, denominator: Array, instrument: Array) -> Array | None:
    """One instrumental-variable step: the next free denominator (data in normalised time)."""
    prefilter = np.convolve(denominator, np.poly(-np.ones(path.integrators)))
    step = data.sample_time_s
    measured = filter_smooth(prefilter, data.output, step)
    simulated = filter_smooth(prefilter, instrument, step)
    filter_input = filter_held if path.hold is Hold.HELD else filter_smooth
    driven = filter_input(prefilter, data.inputs[0], step)[path.zeros :: -1]
    impulse = np.zeros(len(data))
    impulse[0] = 1.0
    transient = filter_held(prefilter, impulse, step)
    common = [driven, transient]
    if path.integrators == 0:
        common.append(filter_held(prefilter, np.ones(len(data)), step)[:1])
    target = data.output - prefilter[:0:-1] @ measured
    regressors = np.vstack([-measured[path.integrators :][::-1], *common])
    instruments = np.vstack([-simulated[path.integrators :][::-1], *common])
    scale = np.linalg.norm(regressors, axis=1, keepdims=True)
    other = np.linalg.norm(instruments, axis=1, keepdims=True)
    if not (np.all(np.isfinite(scale)) and np.all(np.isfinite(other))):
        return None
    scale[scale == 0.0] = 1.0
    other[other == 0.0] = 1.0
    instruments = instruments / other
    solution = np.linalg.lstsq(instruments @ (regressors / scale).T, instruments @ target, rcond=1e-12)[0]
    free = (solution / scale[:, 0])[: path.free_poles]
    if not np.all(np.isfinite(free)):
        return None
    return np.concatenate(([1.0], free))


def stabilised(denominator: Array) -> Array:
    """Poles mirrored into the left half-plane and kept away from its edge."""
    roots = np.roots(denominator)
    size = np.maximum(np.abs(roots), 1e-6)
    real = -np.maximum(np.abs(roots.real), 1e-3 * size)
    return np.asarray(np.real(np.poly(real + 1j * roots.imag)))
