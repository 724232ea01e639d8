"""When a path's gain changes at once: read off a residual, block by block of the run."""

from dataclasses import replace
from itertools import combinations, pairwise

import numpy as np
from numpy.typing import NDArray

from ..core.models import PathSpec
from .problem import Problem

Array = NDArray[np.float64]

_BLOCKS = 48
_FINER = 8  # parts of a block, to which a time is then found,
_AROUND = 2  # blocks to either side: where the voltage is small, steps look alike
_SMALL = 1e-3  # change of the gain by which its part in the output is simulated
_TELLING = 0.5  # of what is left beyond noise and a steady gain: what steps must explain,
_FURTHER = 0.5  # and of what one leaves, a second


def gain_steps(problem: Problem, path: PathSpec) -> dict[str, float]:
    """Sizes and times (s) of one or two steps of the gain that explain what `path` leaves; none where they do not.

    So small, a change of the gain in one block of the run adds to that in another: all times follow by least squares.
    """
    residual = problem.residual(path)
    edges = np.linspace(0, len(residual), _BLOCKS + 1).round().astype(np.int64)
    parts = np.column_stack([_part(problem, path, residual, *block) for block in pairwise(edges.tolist())])
    gram, drive = parts.T @ parts, parts.T @ residual
    blocks = np.arange(_BLOCKS)

    def explained(at: tuple[int, ...]) -> float:
        """Of the residual's power by a steady gain and steps at some blocks."""
        chosen = np.column_stack([blocks >= one for one in (0, *at)]).astype(np.float64)
        sizes = np.linalg.lstsq(chosen.T @ gram @ chosen, chosen.T @ drive, rcond=None)[0]
        return float(drive @ chosen @ sizes)

    steady = explained(())
    beyond = float(residual @ residual) - steady - len(residual) * problem.noise**2
    one, two = (max(combinations(range(1, _BLOCKS), count), key=explained) for count in (1, 2))
    by_one, by_two = explained(one) - steady, explained(two) - steady
    chosen, by = (two, by_two) if by_two - by_one > _FURTHER * max(beyond - by_one, 0.0) else (one, by_one)
    if by < _TELLING * beyond or beyond <= 0.0:
        return {}
    begins = [int(edges[at]) for at in chosen]
    columns = [parts.sum(axis=1), *(parts[:, at:].sum(axis=1) for at in chosen)]
    shifts = np.arange(-_AROUND, _AROUND + 1.0 / _FINER, 1.0 / _FINER) * len(residual) / _BLOCKS
    for place in (1, 2, 1)[: 2 * len(begins) - 1]:
        near = np.clip(begins[place - 1] + shifts, 1, len(residual) - 1).astype(np.int64).tolist()
        tried = {at: _part(problem, path, residual, at, None) for at in near}
        left = {at: left_by([*columns[:place], one, *columns[place + 1 :]], residual) for at, one in tried.items()}
        begins[place - 1] = min(left, key=lambda at: left[at])
        columns[place] = tried[begins[place - 1]]
    first, *sizes = np.linalg.lstsq(np.column_stack(columns), residual, rcond=None)[0].tolist()
    numbers: dict[str, float] = {}
    for name, size, begin in zip(("jump", "second_jump"), sizes, begins, strict=False):
        numbers |= {name: size / (1.0 + first), f"{name}_s": begin * problem.simulator.sample_time_s}
    return numbers


def left_by(columns: list[Array], residual: Array) -> float:
    """Sum of squares that columns leave of a residual (n,)."""
    table = np.column_stack(columns)
    return float(np.sum(np.square(residual - table @ np.linalg.lstsq(table, residual, rcond=None)[0])))


def _part(problem: Problem, path: PathSpec, residual: Array, begin: int, end: int | None) -> Array:
    """What a gain larger by 1 between two samples does to the output as it is compared (n,), as if it were linear."""
    changed = problem.simulator.voltage_v.copy()
    changed[begin:end] *= 1.0 + _SMALL
    moved = replace(problem.simulator, voltage_v=changed)
    return (residual - problem.compare(moved.simulate(path))) / _SMALL
