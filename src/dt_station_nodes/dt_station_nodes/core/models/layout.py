"""What of a prepared path its effects' parameters do not change, remembered: a fit asks for it thousands of times."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from . import path_map
from .linear import Coefficients, LinearPath, discretise
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
    header = np.zeros(path_map.HEADER)
    header[path_map.DIRECT] = linear.d
    header[path_map.DIRECT_VELOCITY] = linear.velocity_direct
    header[path_map.AWAY_DIRECT] = away.d
    header[path_map.AWAY_DIRECT_VELOCITY] = away.velocity_direct
    header[path_map.GAIN_VELOCITY] = linear.velocity @ linear.b + linear.velocity_direct
    header[path_map.GAIN_OUTPUT] = linear.c @ linear.b + linear.d
    header[path_map.GAIN_INJECTION] = linear.c @ linear.e
    header[path_map.GAIN_INJECTED_VELOCITY] = linear.velocity @ linear.e
    header[path_map.DECAY] = linear.outlet_rate
    header[path_map.INLET_DECAY] = linear.inlet_rate
    header[path_map.STATIC] = linear.static_gain
    header[path_map.SETTLING] = linear.settling_rate
    header[path_map.SPEED] = linear.speed_gain
    blocks = [header, linear.a.ravel(), linear.b, linear.e, linear.c, linear.velocity]
    blocks += [away.a.ravel(), away.b, away.c, away.velocity]
    at = np.cumsum([block.size for block in blocks])
    return LaidOut(linear, away.b.size, np.concatenate(blocks), tuple(at.tolist()))


NOTHING = _filled(_NO_PATH, _NO_PATH)


@lru_cache(maxsize=512)
def lay_out(
    own: Coefficients, scale: float, away: Coefficients | None, away_scale: float, step_s: float, outlet: Outlet | None
) -> LaidOut:
    """A path's numbers in units of `scale`, its disturbance path's (of `away_scale`) beside them."""
    disturbance = _NO_PATH if away is None else discretise(away, away_scale, step_s, None)
    return _filled(discretise(own, scale, step_s, outlet), disturbance)
