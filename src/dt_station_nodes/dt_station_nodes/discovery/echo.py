"""A ripple of the pressure, heard again in the position.

The position's model is driven by the pressure as measured: what its sensor adds, or its samples leave out of a quick
ripple, is left in the position's residual at the same frequency.
"""

from collections.abc import Sequence
from dataclasses import replace

from ..core.channels import Channel
from ..core.models import PathSpec
from .channel import Finding
from .result import Verdict
from .timing import PERIODIC


def _frequency_hz(path: PathSpec) -> float | None:
    """Frequency of a path's periodic disturbance, if it has one."""
    return next((e.parameters["frequency_hz"] for e in path.effects if e.name == PERIODIC), None)


def without_echo(finding: Finding, earlier: Sequence[Finding]) -> Finding:
    """The finding, or nothing missing where all it names is a disturbance that the pressure was found to have."""
    problem = finding.problem
    if problem.channel is not Channel.POSITION or finding.best.added != (PERIODIC,):
        return finding
    own = _frequency_hz(finding.best.fit.path)
    resolution = 1.0 / (len(problem.measured) * problem.simulator.sample_time_s)
    for other in earlier:
        heard = _frequency_hz(other.best.fit.path) if other.verdict is Verdict.NAMED else None
        if own is not None and heard is not None and abs(own - heard) < resolution:
            return replace(finding, verdict=Verdict.NOTHING_MISSING, best=finding.null, alternatives=(), excess=0.0)
    return finding
