"""One channel of a run, from its samples to a finding of all of them."""

from dataclasses import replace

import numpy as np

from ..core.models import ModelSpec, PathSpec
from ..core.run import Run
from ..workers import Workers
from .channel import Finding, examine, null_and_noise
from .condense import condensed
from .data_checks import ChannelCheck
from .drift import found_adrift
from .dropouts import commands_lost
from .other_run import found_only_there, found_there, unseen_problem
from .polish import carried_over, polished
from .problem import Problem, make_problem
from .result import Verdict
from .selection import Explanation, Progress
from .settings import DiscoverySettings
from .silence import ROUGH_FORM
from .terms import refits_all

CLOSE = 0.02  # of the signal, or
NEAR = 1.5  # times the noise, RMS, left by any explanation: a model whose poles are known needs no other look
FEW = 2  # effects looked for in the first one


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
    may_be_rough = refits_all(spec.paths[check.channel])
    known = replace(settings, max_effects=min(settings.max_effects, FEW)) if may_be_rough else settings
    if not may_be_rough or not _only_bent(run, spec, check, known):
        finding, notes = _looked_at(run, validation, spec, check, known, progress, workers)
        if finding.interrupted or not may_be_rough or _reached(finding):
            return finding, notes
    return _looked_at(run, validation, spec, check, replace(settings, rough=True), progress, workers)


def _only_bent(run: Run, spec: ModelSpec, check: ChannelCheck, settings: DiscoverySettings) -> bool:
    """Whether the form of a channel's path alone may be what is off: then no effect is looked for on it first."""
    path = spec.paths[check.channel]
    short = condensed(run, check.channel, path)
    problem = make_problem(short.run, spec, check.channel, settings, check.frozen[short.rows])
    return _form_alone(problem, *null_and_noise(problem, path))


def _reached(finding: Finding) -> bool:
    """Whether anything, nameable or not, brings the model as it is known near enough to the run."""
    if _form_alone(finding.problem, finding.null, finding.sigma):
        return False
    residuals = [finding.best.fit.residual, *(explanation.fit.residual for explanation in finding.ranking)]
    left = min(float(np.mean(np.square(residual))) for residual in residuals)
    return left < (NEAR * finding.sigma) ** 2 or left - finding.sigma**2 < (CLOSE * finding.problem.signal) ** 2


def _form_alone(problem: Problem, null: Explanation, sigma: float) -> bool:
    """Whether refitted parameters miss clearly, yet so little that a linear path, refitted whole, may mend it."""
    left = float(np.mean(np.square(null.fit.residual)))
    return (NEAR * sigma) ** 2 < left < sigma**2 + (ROUGH_FORM * problem.signal) ** 2


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
    # What is carried over to all samples is refitted to this run, which would not show it.
    other = None if short.note else unseen
    finding, note = found_only_there(problem, other, path, settings, progress, workers)
    if finding is None:
        finding = examine(problem, path, settings, progress, unseen, workers)
        note = note if finding.verdict is Verdict.UNEXPLAINED else ""
        if finding.verdict is Verdict.UNEXPLAINED and not finding.interrupted:
            there, more = found_only_there(problem, other, path, settings, progress, workers, bent=True)
            finding, note = there or finding, more or note
        finding, more = found_there(finding, other, path, settings, progress, workers)
        note = more or note
    finding, drift = found_adrift(finding, short.run, validation, spec, settings, progress, workers)
    if short.note:
        whole_run = make_problem(run, spec, channel, settings, check.frozen)
        finding = carried_over(finding, whole_run, path, float(short.rows[0]) * run.sample_time_s)
    whole = unseen
    if validation and unseen and len(unseen.measured) < len(validation):
        whole = make_problem(validation, spec, channel, settings)
    finding = _with_commands_lost(polished(finding, whole, workers), path)
    return finding, [text for text in (unheard, note, drift, short.note) if text]


def _with_commands_lost(finding: Finding, path: PathSpec) -> Finding:
    """The finding, or that there is none: what explains a gap but half may stand for commands that never arrived."""
    if finding.interrupted or finding.verdict not in {Verdict.NAMED, Verdict.UNEXPLAINED}:
        return finding
    problem = finding.problem
    left = float(np.mean(np.square(finding.best.fit.residual)))
    spells = commands_lost(problem, path, left, finding.sigma**2)
    if not spells:
        return finding
    first_s = min(spell.first for spell in spells) * problem.simulator.sample_time_s
    rival = f"commands that were lost in {len(spells)} spells, the first at {first_s:.2f} s"
    return replace(finding, verdict=Verdict.UNEXPLAINED, rival=rival)
