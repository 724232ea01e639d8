"""Grid over numbers of poles and zeros; the order is chosen by what was held out."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..core.run import Array
from .errors import IdentificationError
from .estimate import Estimate, fit_percent
from .fitting import estimate
from .refinement import refine, rescaled
from .structure import Data, Structure, slices

FOLDS = 4
HOPELESS = 4.0
"""Squared simulation error, as a multiple of the best one's, above which a candidate is not cross-validated."""
CLOSE = 0.05
PARAMETERS_WORTH = 10.0
"""Held-out error above the best one's that a smaller model may have: a share, and what so many parameters would
explain of noise."""
LOOSEST_GAIN = 0.25
"""Half width of a gain's interval, as a share of the gain, from which on it counts as not determined."""


@dataclass(frozen=True)
class Candidate:
    """One structure of the grid with its scores; `held_out` (FOLDS,) are mean squared errors on blocks not fitted.

    They are infinite where it was not worth asking: a hopeless fit, or one in `doubt`.
    """

    estimate: Estimate
    path: int
    held_out: Array
    validation_fit_percent: float
    doubt: str = ""

    @property
    def poles(self) -> int:
        """Poles of the path the grid runs over."""
        return self.estimate.structure.paths[self.path].poles

    @property
    def zeros(self) -> int:
        """Zeros of that path."""
        return self.estimate.structure.paths[self.path].zeros


@dataclass(frozen=True)
class Selection:
    """All candidates in grid order and the chosen one, with the reason in words."""

    candidates: tuple[Candidate, ...]
    chosen: Candidate
    why: str


def orders(poles: Iterable[int], zeros: Iterable[int] | None = None) -> tuple[tuple[int, int], ...]:
    """Proper combinations (poles, zeros) of the numbers asked for; all zeros below the poles where None."""
    wanted = None if zeros is None else sorted(set(zeros))
    found = tuple((n, m) for n in sorted(set(poles)) for m in (range(n) if wanted is None else wanted) if m < n)
    if not found:
        raise IdentificationError("Every model asked for is improper; ask for fewer zeros than poles.")
    return found


def select(
    structure: Structure,
    data: Data,
    grid: Sequence[tuple[int, int]],
    path: int = 0,
    advance: Callable[[str], None] = lambda text: None,
) -> Selection:
    """Estimate every (poles, zeros) of the grid for one path and choose.

    Candidates are compared by the simulation error on blocks left out of the fit; the smallest model whose error there
    does not exceed the best one's by more than its standard error wins. Raises IdentificationError where none fits.
    """
    done: dict[tuple[int, int], Estimate] = {}
    complaint: IdentificationError | None = None
    for poles, zeros in grid:
        advance(f"{poles} poles, {zeros} zeros")
        orders_of_path = replace(structure.paths[path], poles=poles, zeros=zeros)
        trial = structure.with_path(path, orders_of_path)
        near = ((poles, zeros - 1), (poles - 1, zeros), (poles - 1, zeros - 1))
        starts = [_widened(done[each], path, orders_of_path.free_poles) for each in near if each in done]
        try:
            done[poles, zeros] = estimate(trial, data, starts=starts)
        except IdentificationError as error:
            complaint = error
    if not done:
        raise complaint or IdentificationError("No model of the grid could be estimated; excite the input more.")
    advance("blocks left out")
    hopeless = HOPELESS * min(fitted.cost for fitted in done.values())
    return choose([scored(fitted, data, path, hopeless) for fitted in done.values()])


def scored(fitted: Estimate, data: Data, path: int, hopeless: float = np.inf) -> Candidate:
    """A fit as a candidate, with its errors on blocks held out unless its cost is hopeless or the fit is in doubt."""
    doubt = _doubt(fitted, path)
    if doubt or fitted.cost > hopeless:
        return Candidate(fitted, path, np.full(FOLDS, np.inf), -np.inf, doubt)
    held_out, validation = cross_validate(fitted, data)
    return Candidate(fitted, path, held_out, validation, doubt)


def cross_validate(fitted: Estimate, data: Data, folds: int = FOLDS) -> tuple[Array, float]:
    """Mean squared simulation errors on blocks left out of the fit in turn, and the fit % over all of them."""
    edges = np.linspace(0, len(data), folds + 1).astype(int)
    theta = rescaled(fitted.structure, fitted.theta, 1.0, fitted.rate_rad_s)
    # what only the first block shows stays as the whole run has it
    starting = np.zeros(theta.size, dtype=bool)
    for where in slices(fitted.structure):
        starting[where[3]] = True
    errors = np.empty(folds)
    joined = np.empty(len(data))
    for i in range(folds):
        mask = np.ones(len(data))
        mask[edges[i] : edges[i + 1]] = 0.0
        frozen = starting if i == 0 else None
        output = refine(fitted.structure, theta, data, fitted.rate_rad_s, mask, 10, frozen).output
        block = slice(edges[i], edges[i + 1])
        errors[i] = float(np.mean((data.output[block] - output[block]) ** 2))
        joined[block] = output[block]
    return errors, fit_percent(data.output, joined)


def choose(candidates: Sequence[Candidate]) -> Selection:
    """The smallest model whose error on the blocks left out is not clearly above the least."""
    trusted = [c for c in candidates if not c.doubt] or list(candidates)
    best = min(trusted, key=lambda c: (float(np.mean(c.held_out)), c.estimate.cost))
    level = float(np.mean(best.held_out))
    close = min(CLOSE, PARAMETERS_WORTH / best.estimate.noise.effective_samples)
    for candidate in sorted(trusted, key=lambda c: (c.estimate.structure.size, float(np.mean(c.held_out)))):
        if not np.all(np.isfinite(candidate.held_out)):
            continue
        excess = candidate.held_out - best.held_out
        spread = float(np.std(excess, ddof=1)) / np.sqrt(excess.size)
        if float(np.mean(excess)) <= max(min(spread, close * level), 0.002 * level):
            break
    if candidate is best:
        why = "it has the least error on the blocks left out, and no smaller model comes near it"
        return Selection(tuple(candidates), best, why)
    why = (
        f"it is the smallest whose error on the blocks left out is not clearly above the least "
        f"({best.poles} poles, {best.zeros} zeros)"
    )
    return Selection(tuple(candidates), candidate, why)


def undetermined_pole(fitted: Estimate, path: int) -> bool:
    """Whether the interval of some pole's size holds zero: the data do not need that pole."""
    return any(not (np.isfinite(size.low) and size.low > 0.0) for size in fitted.pole_sizes(path))


def _doubt(fitted: Estimate, path: int) -> str:
    """Why a candidate is not to be chosen: a pole or gain the data do not determine, or no convergence."""
    if undetermined_pole(fitted, path):
        return "undetermined pole"
    gain = fitted.gain(path)
    # a slow pole beside an integrator (or a zero beside the origin) trades the gain for the run's drift
    if not gain.high - gain.low < 2.0 * LOOSEST_GAIN * abs(gain.value):
        return "undetermined gain"
    return "" if fitted.converged else "no convergence"


def _widened(smaller: Estimate, path: int, free_poles: int) -> tuple[Array, ...]:
    """Starting denominators from a smaller model: one more fast pole where one is missing."""
    denominators = []
    for index, transfer in enumerate(smaller.paths):
        integrators = smaller.structure.paths[index].integrators
        denominator = np.asarray(transfer.denominator[: len(transfer.denominator) - integrators])
        if index == path:
            while denominator.size - 1 < free_poles:
                fastest = max([abs(r) for r in np.roots(denominator)], default=smaller.rate_rad_s)
                denominator = np.convolve(denominator, [1.0, 6.0 * fastest])
        denominators.append(denominator)
    return tuple(denominators)
