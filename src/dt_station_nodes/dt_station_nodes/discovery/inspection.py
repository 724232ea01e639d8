"""One channel of a run, from its samples to a finding of all of them."""

from dataclasses import replace

import numpy as np

from ..core.models import ModelSpec
from ..core.run import Run
from .channel import Finding, examine
from .condense import condensed
from .data_checks import ChannelCheck
from .drift import found_adrift
from .other_run import found_there, unseen_problem
from .polish import carried_over, polished
from .problem import make_problem
from .result import Verdict
from .selection import Progress
from .settings import DiscoverySettings
from .terms import refits_all
from .workers import Workers

CLOSE = 0.02  # of the signal, or
NEAR = 1.5  # times the noise, RMS, left by an answer: a model whose poles are known needs no other


def examine_channel(
    run: Run,
    validation: Run | None,
    spec: ModelSpec,
    check: ChannelCheck,
    settings: DiscoverySettings,
    progress: Progress | None,
    workers: Workers,
) -> tuple[Finding, list[str]]:
    """What a channel says, and notes: with the model as it is known, else as a rough fit of foreign data."""
    finding, notes = _looked_at(run, validation, spec, check, settings, progress, workers)
    if finding.interrupted or not refits_all(spec.paths[check.channel]) or _explained(finding):
        return finding, notes
    rough, other = _looked_at(run, validation, spec, check, replace(settings, rough=True), progress, workers)
    return rough, other


def _explained(finding: Finding) -> bool:
    return finding.verdict is not Verdict.UNEXPLAINED and (finding.over_noise[0] < NEAR or _missed(finding) < CLOSE)


def _missed(finding: Finding) -> float:
    """What an answer misses of the signal beyond noise, RMS."""
    left = float(np.mean(np.square(finding.best.fit.residual))) - finding.sigma**2
    return max(left, 0.0) ** 0.5 / finding.problem.signal


def _looked_at(
    run: Run,
    validation: Run | None,
    spec: ModelSpec,
    check: ChannelCheck,
    settings: DiscoverySettings,
    progress: Progress | None,
    workers: Workers,
) -> tuple[Finding, list[str]]:
    channel, path = check.channel, spec.paths[check.channel]
    short = condensed(run, channel, path)
    problem = make_problem(short.run, spec, channel, settings, check.frozen[short.rows])
    unseen, unheard = unseen_problem(validation, spec, channel, settings)
    finding = examine(problem, path, settings, progress, unseen, workers)
    # What is carried over to all samples is refitted to this run, which would not show it.
    finding, note = found_there(finding, None if short.note else unseen, path, settings, progress, workers)
    finding, drift = found_adrift(finding, short.run, validation, spec, settings, progress, workers)
    if short.note:
        finding = carried_over(finding, make_problem(run, spec, channel, settings, check.frozen), path)
    whole = unseen
    if validation and unseen and len(unseen.measured) < len(validation):
        whole = make_problem(validation, spec, channel, settings)
    return polished(finding, whole), [text for text in (unheard, note, drift, short.note) if text]
