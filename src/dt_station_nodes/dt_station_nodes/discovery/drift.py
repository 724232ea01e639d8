"""What only the whole of a run shows: where an integrating path ends up, which windows leave free."""

from dataclasses import replace

import numpy as np

from ..core.models import ModelSpec
from ..core.run import Run
from ..workers import Workers
from .channel import Finding, examine
from .other_run import unseen_problem
from .problem import Problem, make_problem
from .result import Verdict
from .selection import Progress
from .settings import DiscoverySettings
from .verdict import LIKE_NOISE

ADRIFT = 1.2  # times what counts as nothing, RMS: a free run that stays nearer does not drift
TOLD = 20.0  # twice the log-likelihood ratio: a drift says little of the form of what makes it
_MOST = 2  # names are enough to tell that one is not
_QUIET = (Verdict.NOTHING_MISSING, Verdict.PARAMETERS_ONLY)


def found_adrift(
    finding: Finding,
    run: Run,
    validation: Run | None,
    spec: ModelSpec,
    settings: DiscoverySettings,
    progress: Progress | None,
    workers: Workers,
) -> tuple[Finding, str]:
    """The finding and what to say of it: where windows show no effect, that over the whole of the run it was made on.

    Only where one name explains the drift down to noise is it believed.
    """
    channel = finding.problem.channel
    if finding.verdict not in _QUIET or finding.interrupted or not finding.problem.windows.anchored:
        return finding, ""
    settings = replace(settings, window_s=np.inf, max_effects=min(settings.max_effects, _MOST))
    whole = replace(make_problem(run, spec, channel, settings), weights=finding.problem.weights)
    if whole.rough or not _drifts(whole, finding):
        return finding, ""
    check, _ = unseen_problem(validation, spec, channel, settings)
    there = examine(whole, spec.paths[channel], settings, progress, check, workers)
    if there.verdict in _QUIET:
        return finding, ""
    if there.verdict is Verdict.NAMED and len(there.best.added) == 1 and max(there.over_noise) < LIKE_NOISE:
        return _doubting(there), f"{channel.value}: short windows show no effect; drift over the whole run does"
    return finding, f"{channel.value}: over the whole run the simulation drifts away, and no one effect explains it"


def _drifts(whole: Problem, finding: Finding) -> bool:
    residual = whole.residual(finding.best.fit.path)
    return float(np.mean(np.square(residual))) > (ADRIFT * whole.sigma) ** 2


def _doubting(finding: Finding) -> Finding:
    """A finding that names whatever else explains the drift about as well."""
    ranked = zip(finding.ranking, finding.scores, strict=True)
    near = [e.added[0] for e, behind in ranked if behind < TOLD and e.inside and len(e.added) == 1]
    others = tuple(name for name in dict.fromkeys(near) if name not in finding.best.added)
    return replace(finding, alternatives=(others,), margin=0.0) if others else finding
