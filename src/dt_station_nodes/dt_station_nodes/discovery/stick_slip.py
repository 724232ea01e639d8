"""Where fits of a spool that sticks and slips, or of a valve that jumps open, begin: on stairs none gets far."""

from dataclasses import replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from ..core.channels import Channel
from ..core.models import PathSpec
from ..workers import ALONE, Workers
from .hypothesis_fit import Fit, fit_hypothesis
from .problem import Problem
from .stairs import Stairs, followed

Array = NDArray[np.float64]

_NAME, _BAND = "friction", "dead_zone"
_FURTHEST = 0.97  # quantile of how far the spool stays behind
_LEVELS = np.geomspace(0.85, 1.6, 26)  # of that, as noise and lag blur it and bent parameters hide a part
_STEP_V = 1e-3
# About a fit: the level, each this part more, and what has slipped, this much more of it.
_FINER, _STEPS = (0.004, 0.006), np.arange(-4, 5)
_ROUNDS = 4
# Of a band's half width, by which the edges of one that jumps open are moved: no fit sees them between two voltages.
_EDGES, _MOVES = (0.03, 0.01, 0.002), np.arange(-6, 7)
_BETTER = 1e-3  # of the cost
_JUMPS = 0.5  # share of the band that comes back at once
_CLIMBED = 0.5  # times the cost of the base: what explains less of the run than that is on no stairs


def breakaways_v(problem: Problem, path: PathSpec, residual: Array) -> list[float]:
    """Voltages (V) at which a spool before `path` would slip, were a residual (n,) how far it stays behind."""
    simulator = problem.simulator
    moved = replace(simulator, voltage_v=simulator.voltage_v + _STEP_V)
    per_volt = float(np.median(np.abs(moved.simulate(path) - simulator.simulate(path)))) / _STEP_V
    behind = float(np.quantile(np.abs(residual[problem.weights > 0.0]), _FURTHEST)) / max(per_volt, 1e-300)
    return [float(volts) for volts in behind * _LEVELS]


def sticks(problem: Problem, added: tuple[str, ...]) -> bool:
    """Whether a spool that sticks is among the effects added."""
    return problem.channel is Channel.PRESSURE and _NAME in added


def far_from_top(problem: Problem, added: tuple[str, ...], fit: Fit, base: Fit) -> bool:
    """Whether a fit of a spool's stairs, added to a base, may be on wrong ones that explain much of the run."""
    known = sticks(problem, added) and {"coulomb_v", "slip"} <= set(_places(fit, _NAME))
    return known and _on_stairs(added, fit, base) and not fit.full


def _on_stairs(added: tuple[str, ...], fit: Fit, base: Fit) -> bool:
    return len(added) == 1 and fit.fitted.cost < _CLIMBED * base.fitted.cost


def climbed(
    problem: Problem, added: tuple[str, ...], fit: Fit, base: Fit, far: bool = False, workers: Workers = ALONE
) -> Fit:
    """The fit of one effect added to a base, on the best of the stairs about it where it is in stairs.

    `far`: of all stairs that may be, as nothing is known of them yet.
    """
    if not _on_stairs(added, fit, base):
        return fit
    return stepped(problem, fit, far, workers) if sticks(problem, added) else edged(problem, fit)


def stepped(problem: Problem, fit: Fit, far: bool = False, workers: Workers = ALONE) -> Fit:
    """A fit of a spool's stairs moved step by step to the best of all about it, until none is better.

    `far`: from the best of many, as the run's beginning tells them apart.
    """
    places = _places(fit, _NAME)
    level, slip = places.get("coulomb_v"), places.get("slip")
    if level is None or slip is None:
        return fit
    if far and not fit.full:
        fit = followed(problem, fit, Stairs(level, slip, places.get("slides_on")), workers)
    for _ in range(_ROUNDS):
        starts = []
        for more, further in product(_STEPS, _STEPS):
            x = fit.fitted.x.copy()
            x[level] *= 1.0 + _FINER[0] * more
            x[slip] = np.clip(x[slip] + _FINER[1] * further, *fit.hypothesis.bounds[slip])
            starts.append(x)
        found = fit_hypothesis(problem, fit.hypothesis, starts, keep=2)
        if found.fitted.cost >= fit.fitted.cost:
            break
        fit = found
    return fit


def _places(fit: Fit, name: str) -> dict[str, int]:
    """Where the numbers of an effect of that name stand in a fit's, by their own names."""
    terms = enumerate(fit.hypothesis.terms)
    return {t.name: i for i, t in terms if t.effect >= 0 and fit.path.effects[t.effect].name == name}


def edged(problem: Problem, fit: Fit) -> Fit:
    """A fit of a dead zone that jumps open with its edges moved to the best about them, until none is better."""
    places = _places(fit, _BAND)
    half, middle, jump = (places.get(name) for name in ("half_width_v", "centre_v", "restored"))
    if half is None or jump is None or fit.fitted.x[jump] < _JUMPS:
        return fit
    steps = [part for part in _EDGES for _ in range(_ROUNDS)]
    while steps:
        starts, finer = [], steps.pop(0)
        for lower, upper in product(_MOVES, _MOVES) if middle is not None else zip(-_MOVES, _MOVES, strict=True):
            x = fit.fitted.x.copy()
            step = 0.5 * finer * x[half]
            x[half] += step * (upper - lower)
            if middle is not None:
                x[middle] += step * (upper + lower)
            starts.append(x)
        found = fit_hypothesis(problem, fit.hypothesis, starts, keep=2)
        if found.fitted.cost >= fit.fitted.cost * (1.0 - _BETTER):
            steps = [part for part in steps if part < finer]
        else:
            fit = found
    return fit
