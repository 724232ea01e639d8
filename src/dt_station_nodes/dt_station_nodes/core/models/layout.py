"""What of a prepared path its effects' parameters do not change, remembered: a fit asks for it thousands of times."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numba import njit
from numpy.typing import NDArray

from . import path_map
from .linear import Coefficients, LinearPath, discretise
from .small import dot
from .spec import Outlet

Array = NDArray[np.float64]

_EMPTY = np.zeros(0)
_NO_PATH = LinearPath(np.zeros((0, 0)), _EMPTY, _EMPTY, 0.0, _EMPTY, _EMPTY, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class LaidOut:
    """A discretised path and its disturbance path as the kernel reads them.

    `numbers` (shared: read only) holds everything but the rest value; `at` where each part begins, from
    `path_map.A` on, last where the first effect's parameters go.
    """

    linear: LinearPath
    away_states: int
    numbers: Array
    at: tuple[int, ...]


def _filled(linear: LinearPath, away: LinearPath) -> LaidOut:
    n, m = linear.b.size, away.b.size
    vectors = (linear.b, linear.e, linear.c, linear.velocity)
    beside = (away.a.ravel(), away.b, away.c, away.velocity)
    numbers = np.concatenate([np.zeros(path_map.HEADER), linear.a.ravel(), *vectors, *beside])
    _gains(numbers, *vectors)
    numbers[path_map.DIRECT], numbers[path_map.DIRECT_VELOCITY] = linear.d, linear.velocity_direct
    numbers[path_map.AWAY_DIRECT], numbers[path_map.AWAY_DIRECT_VELOCITY] = away.d, away.velocity_direct
    numbers[path_map.GAIN_VELOCITY] += linear.velocity_direct
    numbers[path_map.GAIN_OUTPUT] += linear.d
    numbers[path_map.DECAY] = linear.outlet_rate
    numbers[path_map.INLET_DECAY] = linear.inlet_rate
    numbers[path_map.STATIC] = linear.static_gain
    numbers[path_map.SETTLING] = linear.settling_rate
    numbers[path_map.SPEED] = linear.speed_gain
    return LaidOut(linear, m, numbers, _places(n, m))


@lru_cache(maxsize=64)
def _places(n: int, m: int) -> tuple[int, ...]:
    """Where each part of a path of n states begins, with a disturbance path of m; last where they end."""
    return tuple(np.cumsum([path_map.HEADER, n * n, n, n, n, n, m * m, m, m, m]).tolist())


@njit(cache=True)
def _gains(numbers: Array, b: Array, e: Array, c: Array, velocity: Array) -> None:
    """What a volt or an injection does within a sub-step, by way of the states."""
    n = b.size
    numbers[path_map.GAIN_VELOCITY] = dot(velocity, b, n)
    numbers[path_map.GAIN_OUTPUT] = dot(c, b, n)
    numbers[path_map.GAIN_INJECTION] = dot(c, e, n)
    numbers[path_map.GAIN_INJECTED_VELOCITY] = dot(velocity, e, n)


NOTHING = _filled(_NO_PATH, _NO_PATH)


@lru_cache(maxsize=512)
def lay_out(
    own: Coefficients, scale: float, away: Coefficients | None, away_scale: float, step_s: float, outlet: Outlet | None
) -> LaidOut:
    """A path's numbers in units of `scale`, its disturbance path's (of `away_scale`) beside them."""
    disturbance = _NO_PATH if away is None else discretise(away, away_scale, step_s, None)
    return _filled(discretise(own, scale, step_s, outlet), disturbance)
