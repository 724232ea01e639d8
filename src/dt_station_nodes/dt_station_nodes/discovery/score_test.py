"""Rao's score test of a refinement: what its numbers could take off a form's cost, told before they are fitted."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..core.models import PathSpec
from .candidates import hypothesis
from .fit import finite_differences, gram
from .hypothesis_fit import Fit
from .selection import Bench, Explanation

Array = NDArray[np.float64]

_TIMES = 6.0  # what numbers bring beyond what the test says, as they act otherwise than their slopes
_ROOM = 60.0  # and beyond that, twice a log-likelihood ratio
_ALIKE = 1.15  # times the cost of what leaves noise: what leaves no more may be a peer of it
_SAME = 1e-10  # of the largest eigenvalue: what numbers change so much alike is one change
_NOTHING = 1e-9  # of what is left: what moves the output by less changes nothing


def effects_of(bench: Bench, fit: Fit, effect: str, names: tuple[str, ...], starts: Sequence[PathSpec]) -> Array:
    """What an effect's numbers change of what a fit leaves: their slopes there and at `starts`, (n, k), over sigma."""
    problem = bench.problem.coarse(fit.path)
    freed = hypothesis(problem, fit.path, (), {effect: names})

    def left(path: PathSpec) -> Array:
        return problem.residual(path) / problem.sigma

    here = fit.residual / problem.sigma if problem is bench.problem else left(fit.path)
    lower, upper = freed.bounds.T
    slopes = finite_differences(lambda x: left(freed.path_at(x)), freed.start(), here, freed.steps, lower, upper)
    changes = np.column_stack([slopes, *(left(start) - here for start in starts)])
    sizes = np.abs(changes).max(axis=0)
    return np.asarray(changes[:, sizes > _NOTHING * np.abs(here).max(initial=0.0)])


def least_cost(fit: Fit, changes: Array) -> float:
    """What would be left of a fit's cost if what its numbers and those of `changes` (n, k) bring were linear."""
    slopes, left = fit.fitted.jacobian, fit.fitted.residual
    more = np.vstack([changes, np.zeros((len(left) - len(changes), changes.shape[1]))])
    basis = np.column_stack([slopes, more])
    basis = basis / np.maximum(np.sqrt(np.einsum("ij,ij->j", basis, basis)), 1e-300)
    along = np.einsum("ij,i->j", basis, left)
    return fit.fitted.cost - float(along @ np.linalg.lstsq(gram(basis), along, rcond=_SAME)[0])


def gain(bench: Bench, form: Explanation, cost: float) -> float:
    """What a form would gain that came to a `cost`, twice the log-likelihood ratio."""
    return bench.worth(form) * float(np.log(form.fit.fitted.cost / max(cost, 1e-300)))


def far_behind(bench: Bench, form: Explanation, ahead: float) -> float:
    """How far a form is behind one of cost `ahead` beyond what chance brings, twice the log-likelihood ratio; or 0."""
    if bench.rough or not np.isfinite(ahead):
        return 0.0
    return max(gain(bench, form, _ALIKE * ahead) - _ROOM, 0.0)


def hopeless(gains: float, behind: float) -> bool:
    """Whether what promises such `gains`, added up, brings no form that is so far `behind` near what is ahead of it."""
    return _TIMES * gains < behind
