"""What the pressure was found to have, heard again in the position.

The position's model is driven by the pressure as measured: what its sensor adds or takes, or its samples leave out of a
quick ripple, is left in the position's residual: at the same frequency, or as a drift. A pressure that nothing
explains may be one that its sensor makes up.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import reduce

import numpy as np
from numpy.typing import NDArray

from ..core.channels import Channel
from ..core.models import PathSpec
from .channel import Finding
from .result import Verdict
from .selection import Bench, fit_null
from .terms import nominal_terms
from .timing import PERIODIC, without

Array = NDArray[np.float64]

# Times what the effects found leave: a load read right that leaves no more does without them,
_AS_WELL = 1.1
# where it explains so much of what they do.
_MOST = 0.5


def _frequency_hz(path: PathSpec) -> float | None:
    """Frequency of a path's periodic disturbance, if it has one."""
    return next((e.parameters["frequency_hz"] for e in path.effects if e.name == PERIODIC), None)


def without_echo(finding: Finding, earlier: Sequence[Finding]) -> Finding:
    """The finding, or nothing missing where all it names is what the pressure has, which its sensor may have added."""
    if finding.problem.channel is not Channel.POSITION or finding.verdict is not Verdict.NAMED:
        return finding
    named = [other for other in earlier if other.verdict is Verdict.NAMED]
    unclear = [other for other in earlier if other.verdict is Verdict.UNEXPLAINED]
    if any(_rippled(finding, other) for other in named) or any(_misread(finding, o) for o in (*named, *unclear)):
        return replace(finding, verdict=Verdict.NOTHING_MISSING, best=finding.null, alternatives=(), excess=0.0)
    return finding


def _rippled(finding: Finding, other: Finding) -> bool:
    """Whether all that is named is a disturbance at the frequency of the pressure's."""
    own, heard = _frequency_hz(finding.best.fit.path), _frequency_hz(other.best.fit.path)
    resolution = 1.0 / finding.problem.length_s
    return finding.best.added == (PERIODIC,) and own is not None and heard is not None and abs(own - heard) < resolution


def _misread(finding: Finding, other: Finding) -> bool:
    """Whether the position needs no effect where the pressure is less what its sensor may have made of it."""
    simulator = finding.problem.simulator
    added = _added(other)
    if added.shape != simulator.load_pa.shape:
        return False
    right = replace(finding.problem, simulator=replace(simulator, load_pa=simulator.load_pa - added))
    nominal = finding.null.fit.path
    fit = fit_null(Bench(right, nominal_terms(nominal, right.signal, right.rough)), nominal).fit
    null, best, read_right = (one.rss + one.penalty for one in (finding.null.fit, finding.best.fit, fit))
    return read_right <= _AS_WELL * best and null - read_right >= _MOST * (null - best)


def _added(other: Finding) -> Array:
    """What the pressure's sensor may have added (n,), Pa: what its effects make of it, or all that nothing explains."""
    if other.verdict is Verdict.UNEXPLAINED:
        return other.given
    found = other.best.fit.path
    return other.problem.simulate(found) - other.problem.simulate(reduce(without, other.best.added, found))
