"""An open-loop simulation in which an integrating path stays about where it was measured."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from .compiled import CONTEXT_SIZE
from .kernel import Integers, run

Array = NDArray[np.float64]

# Samples between two steps back, and the least share of what a sample says of the place that is believed:
# noise leaves a fourteenth of itself, drift is followed within two seconds of 50 Hz.
_BLOCK, _SHARE = 5, 0.01
# Samples that say as much of the place as a stop does.
_STOP = 50


@njit(cache=True, nogil=True)
def run_brought_back(
    pressure: Array,
    pressure_places: Integers,
    position: Array,
    position_places: Integers,
    timing: Array,
    state: Array,
    voltages: Array,
    load: Array,
    outputs: Array,
    measured: Array,
    shift: Array,
    free: Array,
) -> None:
    """As the kernel's `run`, in blocks, each begun where the path was `measured` (n,), SI, as far as noise lets tell.

    `shift` is what the state changes by where the path stands 1 further. Where it is not between the places `free` (2,)
    (SI), what holds it there says where it is: it is left alone, and what was known of its place before is forgotten.
    The steps back are left out of `outputs`, so that only effects that act at places of the output can tell.
    """
    context, scratch = np.zeros(2 * CONTEXT_SIZE), np.empty_like(state)
    column, away, told = 0 if shift[1] != 0.0 else 1, 0.0, 0
    for begin in range(0, len(measured), _BLOCK):
        end = min(begin + _BLOCK, len(measured))
        run(
            pressure,
            pressure_places,
            position,
            position_places,
            timing,
            state,
            voltages,
            load,
            context,
            scratch,
            outputs,
            (begin, end),
        )
        held, off, last = False, 0.0, outputs[end - 1, column]
        for i in range(begin, end):
            held = held or not free[0] < outputs[i, column] < free[1]
            off += measured[i] - outputs[i, column]
            outputs[i, column] -= away
        if held:
            told = _STOP
            continue
        told += end - begin
        there = last + max((end - begin) / told, _SHARE * (end - begin)) * (off / (end - begin))
        step = min(max(there, free[0]), free[1]) - last
        away += step
        for j in range(len(state)):
            state[j] += step * shift[j]
