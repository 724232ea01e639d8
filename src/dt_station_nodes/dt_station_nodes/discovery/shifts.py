"""When an offset comes in the course of a run: read off a residual, block by block."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from .gain_steps import left_by

Array = NDArray[np.float64]

_BLOCKS = 48
_FINER = 8  # parts of a block, to which the time is then found,
_AROUND = 1.5  # blocks to either side
_TELLING = 0.5  # of what is left beyond noise and a steady offset: what a shift must explain


def shift_time(residual: Array, steady: Array, part: Callable[[float], Array], noise: float) -> float | None:
    """Where in a run (share of it, 0..1) an offset comes that explains what is left (n,); None where none does.

    `part` gives what an offset that comes at a share of the run does to the output (n,), per its size, `steady` what
    one does that is there from the start.
    """
    without = left_by([steady], residual)
    beyond = without - len(residual) * noise**2
    shares = np.arange(1, _BLOCKS) / _BLOCKS
    left = [left_by([steady, part(float(share))], residual) for share in shares]
    near = float(shares[int(np.argmin(left))])
    around = near + np.arange(-_AROUND, _AROUND + 0.5 / _FINER, 1.0 / _FINER) / _BLOCKS
    around = around[(around > 0.0) & (around < 1.0)]
    finer = [left_by([steady, part(float(share))], residual) for share in around]
    best = int(np.argmin(finer))
    return float(around[best]) if without - finer[best] > _TELLING * beyond > 0.0 else None
