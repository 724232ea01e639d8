"""What of a prepared path its effects' parameters do not change, remembered: a fit asks for it thousands of times."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from . import kernel
from .linear import Coefficients, LinearPath, discretise
from .spec import Outlet

Array = NDArray[np.float64]

_EMPTY = np.zeros(0)
_NO_PATH = LinearPath(np.zeros((0, 0)), _EMPTY, _EMPTY, 0.0, _EMPTY, _EMPTY, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class LaidOut:
    """A discretised path and its disturbance path as the kernel reads them.

    `numbers` (shared: read only) holds everything but the rest value; `at` where each part begins, from
    `kernel.A` on, last where the first effect's parameters go.
    """

    linear: LinearPath
    away_states: int
    numbers: Array
    at: tuple[int, ...]


def _filled(linear: LinearPath, away: LinearPath) -> LaidOut:
    header = np.zeros(kernel.HEADER)
    header[kernel.DIRECT] = linear.d
    header[kernel.DIRECT_VELOCITY] = linear.velocity_direct
    header[kernel.AWAY_DIRECT] = away.d
    header[kernel.AWAY_DIRECT_VELOCITY] = away.velocity_direct
    header[kernel.GAIN_VELOCITY] = linear.velocity @ linear.b + linear.velocity_direct
    header[kernel.GAIN_OUTPUT] = linear.c @ linear.b + linear.d
    header[kernel.GAIN_INJECTION] = linear.c @ linear.e
    header[kernel.GAIN_INJECTED_VELOCITY] = linear.velocity @ linear.e
    header[kernel.DECAY] = linear.outlet_rate
    header[kernel.INLET_DECAY] = linear.inlet_rate
    header[kernel.STATIC] = linear.static_gain
    header[kernel.SETTLING] = linear.settling_rate
    header[kernel.SPEED] = linear.speed_gain
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
