"""`discover`: all stages over all channels of a run."""

from collections.abc import Callable, Mapping
from contextlib import nullcontext
from dataclasses import replace

from ..core.channels import Channel
from ..core.errors import StationError
from ..core.models import ModelSpec, PathSpec
from ..core.models.effects import registry
from ..core.run import Run
from ..workers import Workers
from .channel import Finding
from .contenders import contenders
from .data_checks import check_run
from .echo import without_echo
from .inspection import examine_channel
from .next_experiment import propose
from .noise import difference_noise, effective_samples
from .problem import Problem, integrates, make_problem, telling_window
from .proof import estimates, floor_figures, gap_figures, patched, trace
from .ranking import ranking_of
from .result import (
    DiscoveryResult,
    Gap,
    NamedEffect,
    NextExperiment,
    RunFacts,
    Trace,
    Verdict,
)
from .settings import DiscoverySettings
from .spikes import without_spikes
from .standing import stands
from .verdict import confidence, overall, sentence, why
from .where import locate

Progress = Callable[[str], None]


_UNCHANGED = (Verdict.NOTHING_MISSING, Verdict.UNEXPLAINED)


class ModelDoesNotFitError(StationError):
    """The model has no path for any channel that the run measured."""


def discover(
    run: Run,
    spec: ModelSpec,
    validation: Run | None = None,
    settings: DiscoverySettings | None = None,
    progress: Progress | None = None,
    jobs: int | None = None,
    workers: Workers | None = None,
) -> DiscoveryResult:
    """Find what the model lacks on this run; no fit sees `validation`, another run, unless it alone shows a gap.

    The same inputs give the same answer, whatever `jobs`; `workers` of the caller's are used where given. Ctrl-C during
    the search ends it with what is known.
    Raises StationError where run or model cannot be examined.
    """
    chosen = settings or DiscoverySettings()
    chosen = chosen if jobs is None else replace(chosen, jobs=jobs)
    run, notes = without_spikes(run)
    if validation is not None:
        validation, elsewhere = without_spikes(validation)
        notes += [f"validation run, {note}" for note in elsewhere]
    checks = [check for check in check_run(run) if check.channel in spec.paths]
    if not checks:
        raise ModelDoesNotFitError(
            f"model {spec.name} describes {', '.join(c.value for c in spec.paths)}, "
            f"the run measured {', '.join(c.value for c in run.channels())}; choose another model"
        )
    notes += [note for check in checks for note in check.notes]
    findings: list[Finding] = []
    frozen: set[Channel] = set()
    model = spec
    with Workers(chosen.jobs) if workers is None else nullcontext(workers) as shared:
        for check in checks:
            if not check.excited:
                continue
            if check.frozen_share > 0.0:
                frozen.add(check.channel)
            path = spec.paths[check.channel]
            same = _windowed(run, check.channel, path, chosen)
            finding, said = examine_channel(run, validation, spec, check, same, progress, shared)
            notes += said
            finding = without_echo(finding, findings)
            known = finding.verdict is not Verdict.UNEXPLAINED
            if check.channel in frozen and known and not stands(finding.problem, finding.best.fit.path):
                finding = replace(finding, verdict=Verdict.UNEXPLAINED, rival="frozen sensor")
            findings.append(finding)
            found = finding.best.fit.path
            if finding.verdict is Verdict.NOTHING_MISSING:
                # Only effects of the given model that the data contradict are dropped.
                found = spec.paths[check.channel].model_copy(update={"effects": found.effects})
            # Where nothing is known, the model stays as it was given.
            changed = finding.verdict is not Verdict.NOTHING_MISSING or found.effects != path.effects
            if changed and finding.verdict is not Verdict.UNEXPLAINED:
                model = patched(model, check.channel, found)
            if finding.interrupted:
                break
    return _result(run, spec, model, validation, chosen, notes, findings)


def _windowed(run: Run, channel: Channel, path: PathSpec, settings: DiscoverySettings) -> DiscoverySettings:
    """Settings by which every look at a channel of a run compares over windows of one length."""
    if settings.window_s or not integrates(path):
        return settings
    measured = run.signals[channel.signal]
    return replace(settings, window_s=telling_window(measured, run.sample_time_s, difference_noise(measured)))


def _result(
    run: Run,
    spec: ModelSpec,
    model: ModelSpec,
    validation: Run | None,
    settings: DiscoverySettings,
    notes: list[str],
    findings: list[Finding],
) -> DiscoveryResult:
    effects: list[NamedEffect] = []
    nominal = {}
    units = {finding.problem.channel: run.unit(finding.problem.channel.signal) for finding in findings}
    proposal: NextExperiment | None = None
    verdict = overall([finding.verdict for finding in findings])
    for finding in findings:
        worth = effective_samples(finding.best.fit.residual)
        channel = finding.problem.channel
        numbers, by_effect = estimates(finding, worth, units[channel])
        nominal.update({f"{channel.value} {name}": value for name, value in numbers.items()})
        if finding.verdict is Verdict.NAMED:
            for place, name in enumerate(finding.best.added):
                others = finding.alternatives[place] if place < len(finding.alternatives) else ()
                entry = registry()[name]
                effects.append(
                    NamedEffect(
                        name,
                        channel,
                        confidence(finding, others),
                        by_effect[name],
                        others,
                        why(finding, name),
                        entry.check,
                    )
                )
        elif finding.verdict is Verdict.PARAMETERS_ONLY:
            effects.append(
                NamedEffect(
                    "parameter_mismatch",
                    channel,
                    confidence(finding, finding.alternatives[0]),
                    numbers,
                    finding.alternatives[0],
                    "refitting the nominal parameters alone brings the gap to the noise floor",
                )
            )
        if proposal is None:
            proposal = propose(finding, contenders(finding, verdict))
    if verdict is not Verdict.NAMED:
        effects = [e for e in effects if e.name == "parameter_mismatch"] if verdict is Verdict.PARAMETERS_ONLY else []
    else:
        effects = [e for e in effects if e.name != "parameter_mismatch"]
    checked = _validation(run, validation, spec, settings, findings)
    figures = [(f.problem, f.given, f.best.fit.residual, f.verdict) for f in findings]
    gap = Gap(
        before={p.channel: gap_figures(p, given) for p, given, _, _ in figures},
        after={p.channel: gap_figures(p, given if v in _UNCHANGED else best) for p, given, best, v in figures},
        noise_floor={f.problem.channel: floor_figures(f.problem, f.sigma) for f in findings},
        validation_before={p.channel: gap_figures(p, p.residual(spec.paths[p.channel])) for p in checked},
        validation_after={p.channel: gap_figures(p, p.residual(model.paths[p.channel])) for p in checked},
    )
    where = tuple(row for f in findings for row in locate(f.problem, f.null.fit.residual, f.sigma)[:6])
    return DiscoveryResult(
        verdict,
        tuple(effects),
        where,
        gap,
        proposal,
        RunFacts(run.source, spec.name, "", len(run) * run.sample_time_s),
        model.renamed(f"{spec.name}+{'+'.join(e.name for e in effects)}") if effects else model,
        sentence(verdict, effects, findings, gap, units),
        tuple(notes),
        nominal,
        ranking_of(findings),
        tuple(_trace(f.problem, spec, model, units) for f in findings),
        tuple(_trace(p, spec, model, units) for p in checked),
        any(f.interrupted for f in findings),
        units,
    )


def _validation(
    run: Run, validation: Run | None, spec: ModelSpec, settings: DiscoverySettings, findings: list[Finding]
) -> list[Problem]:
    if validation is None:
        return []
    wanted = {f.problem.channel for f in findings}
    usable = [check.channel for check in check_run(validation) if check.channel in wanted and check.excited]
    return [
        make_problem(validation, spec, channel, _windowed(run, channel, spec.paths[channel], settings))
        for channel in usable
    ]


def _trace(problem: Problem, spec: ModelSpec, model: ModelSpec, units: Mapping[Channel, str]) -> Trace:
    channel = problem.channel
    return trace(problem, spec.paths[channel], model.paths[channel], units[channel])
