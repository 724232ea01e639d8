"""The stairs of a spool that sticks and slips, found from a run's beginning on: few jumps tell more of them apart.

A level and a slip a little off make every jump early or late, and the later in a run the more: over a whole run the
misfit has a well at the true ones that is as narrow as its jumps are many, and lesser wells all about it.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import minimum_filter

from ..workers import ALONE, Workers
from .hypothesis_fit import Fit, fit_hypothesis
from .problem import Problem
from .terms import Hypothesis
from .windows import make_windows

Array = NDArray[np.float64]

# Levels, times that of a fit, which is never much above the true one, and slips.
_LEVELS, _SLIPS = np.arange(0.85, 1.6, 0.01), np.arange(0.1, 0.99, 0.02)
_FIRST, _KEPT = 1.0 / 16.0, 60  # of the run, and wells of it that are followed


@dataclass(frozen=True, slots=True)
class _Stage:
    """So much of the run, searched about each well to a step of the first and as finely, of which so many are kept."""

    share: float
    reach: float
    kept: int
    fitted: bool


_STAGES = (
    _Stage(1.0 / 8.0, 1.0, 40, False),
    _Stage(1.0 / 4.0, 0.5, 20, False),
    _Stage(1.0 / 2.0, 0.5, 12, True),
    _Stage(3.0 / 4.0, 0.35, 8, True),
    _Stage(1.0, 0.25, 4, True),
    _Stage(1.0, 0.06, 2, True),
)
_ABOUT = np.linspace(-1.0, 1.0, 9)  # of a stage's reach
_OF_ONE = 2  # wells, about one of the stage before
_APART = 0.75  # of a stage's reach: nearer ones are one well


@dataclass(frozen=True, slots=True)
class Stairs:
    """Where the level, the slip and, if it has one, whether it slides on stand among a fit's numbers."""

    level: int
    slip: int
    slides_on: int | None


@dataclass(frozen=True, slots=True)
class _Well:
    """A start at the bottom of a well of the misfit, which is a sum of squares."""

    misfit: float
    x: Array


def followed(problem: Problem, fit: Fit, at: Stairs, workers: Workers = ALONE) -> Fit:
    """The best fit on any stairs about it, of which the run's beginning tells most apart, then more and more of it."""
    level, like = float(fit.fitted.x[at.level]), fit.hypothesis
    grids = [(base, base[at.level] * _LEVELS, _SLIPS) for base in _bases(fit, at)]
    found = workers.results(partial(_wells, beginning(problem, _FIRST), like, at), grids)
    wells = sorted((well for of_base in found for well in of_base), key=lambda one: one.misfit)[:_KEPT]
    fits: list[Fit] = []
    for stage in _STAGES:
        part = beginning(problem, stage.share)
        reach = stage.reach * level * (_LEVELS[1] - _LEVELS[0]), stage.reach * (_SLIPS[1] - _SLIPS[0])
        grids = [(well.x, *_about(like, well.x, at, reach)) for well in wells]
        found = workers.results(partial(_wells, part, like, at), grids)
        about = [well for of_one in found for well in of_one[:_OF_ONE]]
        wells = _apart(about, stage.kept, at, (_APART * reach[0], _APART * reach[1]))
        if stage.fitted:
            fits = list(workers.results(partial(_fitted, part, like), [well.x for well in wells]))
            wells = [_Well(one.fitted.cost, one.fitted.x) for one in fits]
    return min([fit, *fits], key=lambda one: one.fitted.cost)


def _about(like: Hypothesis, x: Array, at: Stairs, reach: tuple[float, float]) -> tuple[Array, Array]:
    """Levels and slips within a reach of a start's."""
    slips = np.clip(x[at.slip] + reach[1] * _ABOUT, *like.bounds[at.slip])
    return x[at.level] + reach[0] * _ABOUT, slips


def _fitted(part: Problem, like: Hypothesis, x: Array) -> Fit:
    return fit_hypothesis(part, like, [x])


def _bases(fit: Fit, at: Stairs) -> Iterator[Array]:
    """A fit's numbers, with its nominal parameters and with those given, sliding on and not.

    On wrong stairs a lag that is none blurs what does not fit.
    """
    x = fit.fitted.x
    given = np.array([v if t.effect >= 0 else t.centre for v, t in zip(x, fit.hypothesis.terms, strict=True)])
    for base, slides in product((x, given), (None,) if at.slides_on is None else (0.0, 1.0)):
        start = base.copy()
        if at.slides_on is not None and slides is not None:
            start[at.slides_on] = slides
        yield start


def beginning(problem: Problem, share: float) -> Problem:
    """The problem of the first share of a run."""
    if share >= 1.0:
        return problem
    samples = int(share * len(problem.measured))
    made = problem.simulator

    def cut(values: Array) -> Array:
        return np.ascontiguousarray(values[:samples])

    other = None if made.other_v is None else cut(made.other_v)
    return replace(
        problem,
        simulator=replace(made, voltage_v=cut(made.voltage_v), load_pa=cut(made.load_pa), other_v=other),
        measured=cut(problem.measured),
        weights=cut(problem.weights),
        windows=make_windows(samples, made.sample_time_s, np.inf, problem.windows.anchored),
    )


def _wells(problem: Problem, like: Hypothesis, at: Stairs, grid: tuple[Array, Array, Array]) -> list[_Well]:
    """The wells of the misfit over a base's levels and slips, all else as in the base, deepest first."""
    base, levels, slips = grid
    starts = []
    for level, slip in product(levels, slips):
        x = base.copy()
        x[at.level], x[at.slip] = level, slip
        starts.append(x)
    residuals = (problem.residual(like.path_at(x)) for x in starts)
    misfits = np.array([float(residual @ residual) for residual in residuals])
    around = minimum_filter(misfits.reshape(len(levels), len(slips)), size=3, mode="nearest").ravel()
    bottoms = np.flatnonzero(misfits <= around)
    return sorted((_Well(float(misfits[i]), starts[i]) for i in bottoms), key=lambda one: one.misfit)


def _apart(wells: list[_Well], count: int, at: Stairs, reach: tuple[float, float]) -> list[_Well]:
    """The deepest wells, of those within a reach of each other in level and slip the deepest."""
    kept: list[_Well] = []
    for well in sorted(wells, key=lambda one: one.misfit):
        if len(kept) < count and not any(_same(well.x, other.x, at, reach) for other in kept):
            kept.append(well)
    return kept


def _same(x: Array, other: Array, at: Stairs, reach: tuple[float, float]) -> bool:
    slides = at.slides_on is None or x[at.slides_on] == other[at.slides_on]
    near = abs(x[at.level] - other[at.level]) <= reach[0] and abs(x[at.slip] - other[at.slip]) <= reach[1]
    return bool(slides and near)
