"""The validation run: whether it can be judged by, and what it shows that the run does not."""

from dataclasses import replace

from ..core.channels import Channel
from ..core.models import ModelSpec, PathSpec
from ..core.run import Run
from ..workers import Workers
from .channel import Finding, examine, null_and_noise
from .condense import condensed
from .data_checks import check_run
from .measure import FAR_OFF
from .problem import Problem, make_problem
from .result import Verdict
from .selection import Explanation, Progress
from .settings import DiscoverySettings
from .unseen import shows_only
from .verdict import LIKE_NOISE

BETTER = 0.6  # times the noise, RMS, that the run's own answer leaves of the other: at most so much is another answer
_BORNE_OUT = "; it was found there, this run bears it out"


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


def found_only_there(
    problem: Problem,
    unseen: Problem | None,
    path: PathSpec,
    settings: DiscoverySettings,
    progress: Progress | None,
    workers: Workers,
    bent: bool = False,
) -> tuple[Finding | None, str]:
    """What the other run names where it alone shows a gap, and what to say of it.

    This run, as the model says, tells no effect from another: the runs change places, this one must not contradict.
    `bent`: it is as the model says only with parameters far off, which tells something, if not enough.
    """
    if unseen is None:
        return None, ""
    null, sigma = null_and_noise(problem, path, unseen)
    if (null.fit.penalty > FAR_OFF) is not bent:
        return None, ""
    if not shows_only(problem, unseen, null.unseen, null.fit.residual, sigma):
        return None, ""
    channel = problem.channel.value
    there = examine(unseen, path, settings, progress, problem, workers)
    if there.verdict is not Verdict.NAMED and not there.interrupted:
        return None, (
            f"{channel}: this run is as the model says, the validation run is not; "
            "discover that one and give this one with --validate"
        )
    here = replace(there, given=problem.residual(path), null=null, sigma=sigma)
    return _brought_here(here, problem), f"{channel}: only the validation run shows what is missing{_BORNE_OUT}"


def found_there(
    finding: Finding,
    unseen: Problem | None,
    path: PathSpec,
    settings: DiscoverySettings,
    progress: Progress | None,
    workers: Workers,
) -> tuple[Finding, str]:
    """The finding and what to say of it: that of the other run, where that one shows more of what is missing."""
    if unseen is None or finding.interrupted or not _shows_more(finding):
        return finding, ""
    # What is named must explain this run too, which shows no more than was found there, or little more.
    most = min(settings.max_effects, len(finding.best.added) + 1)
    there = examine(unseen, path, replace(settings, max_effects=most), progress, finding.problem, workers)
    # Where this run by itself is not believed, the other has to explain them both.
    least = BETTER * max(finding.over_noise) if finding.verdict is Verdict.NAMED else LIKE_NOISE
    if there.verdict is not Verdict.NAMED or max(there.over_noise) > least:
        return finding, ""
    here = replace(there, given=finding.given, null=finding.null, sigma=finding.sigma)
    note = f"{finding.problem.channel.value}: the validation run shows more of what is missing{_BORNE_OUT}"
    return _brought_here(here, finding.problem), note


def _brought_here(there: Finding, problem: Problem) -> Finding:
    """A finding of the other run as one of this."""
    return replace(there, problem=problem, over_noise=there.over_noise[::-1], best=_seen_on(problem, there.best))


def _shows_more(finding: Finding) -> bool:
    """Whether what was named, or else leaves noise alone of this run, explains it far better than the other."""
    over = finding.over_noise
    explained = finding.verdict is Verdict.NAMED or (finding.best.added and over[0] < LIKE_NOISE)
    return bool(explained) and len(over) > 1 and over[1] > LIKE_NOISE * over[0]


def _seen_on(problem: Problem, explanation: Explanation) -> Explanation:
    """An explanation of another run with what it leaves of this one, numbers as they are."""
    residual = problem.residual(explanation.fit.path)
    rss = float(residual @ residual) / problem.sigma**2
    return replace(explanation, fit=replace(explanation.fit, residual=residual, rss=rss))
