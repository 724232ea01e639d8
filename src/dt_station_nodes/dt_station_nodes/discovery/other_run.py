"""The validation run: whether it can be judged by, and what it shows that the run does not."""

from dataclasses import replace

from ..core.channels import Channel
from ..core.models import ModelSpec, PathSpec
from ..core.run import Run
from .channel import Finding, examine
from .condense import condensed
from .data_checks import check_run
from .problem import Problem, make_problem
from .result import Verdict
from .selection import Explanation, Progress
from .settings import DiscoverySettings
from .unseen import shows_only
from .workers import Workers


def unseen_problem(
    validation: Run | None, spec: ModelSpec, channel: Channel, settings: DiscoverySettings
) -> tuple[Problem | None, str]:
    """The channel's problem on the validation run, or why that run tells nothing about it."""
    if validation is None:
        return None, ""
    check = next((c for c in check_run(validation) if c.channel is channel), None)
    if check is None:
        return None, f"{channel.value}: the validation run does not measure it"
    if not check.excited or check.frozen_share > 0.0:
        return None, f"the validation run is not judged by; {check.notes[-1]}"
    return make_problem(condensed(validation, channel, spec.paths[channel]).run, spec, channel, settings), ""


def found_there(
    finding: Finding,
    unseen: Problem | None,
    path: PathSpec,
    settings: DiscoverySettings,
    progress: Progress | None,
    workers: Workers,
) -> tuple[Finding, str]:
    """The finding and what to say of it: that of the other run, where that alone shows what is missing.

    The runs change places: effects are fitted to the one that shows them, the other must not contradict.
    """
    null = finding.null
    quiet = finding.verdict is Verdict.UNEXPLAINED and not finding.interrupted
    if unseen is None or not quiet or not shows_only(unseen, null.unseen, null.fit.residual, finding.sigma):
        return finding, ""
    channel = finding.problem.channel.value
    there = examine(unseen, path, settings, progress, finding.problem, workers)
    if there.verdict is not Verdict.NAMED:
        return finding, (
            f"{channel}: this run is as the model says, the validation run is not; "
            "discover that one and give this one with --validate"
        )
    here = replace(there, problem=finding.problem, given=finding.given, null=null, sigma=finding.sigma)
    note = f"{channel}: only the validation run shows what is missing; it was found there, this run bears it out"
    return replace(here, best=_seen_on(finding.problem, there.best)), note


def _seen_on(problem: Problem, explanation: Explanation) -> Explanation:
    """An explanation of another run with what it leaves of this one, numbers as they are."""
    residual = problem.residual(explanation.fit.path)
    rss = float(residual @ residual) / problem.sigma**2
    return replace(explanation, fit=replace(explanation.fit, residual=residual, rss=rss))
