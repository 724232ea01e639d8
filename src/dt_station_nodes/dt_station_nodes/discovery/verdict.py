"""The answer in words: one verdict over the channels, its sentence, and how sure it is."""

from collections.abc import Mapping, Sequence

import numpy as np

from ..core.channels import Channel
from .channel import Finding
from .result import Gap, NamedEffect, Verdict
from .selection import Explanation
from .sense import sensible
from .strangers import SAME

# What is left of the confidence in a name that better sets do without, that what has no name explains as well, or that
# an unfinished search gives.
DOUBTED = 0.5
TOLD = 0.02  # of the gap: what is left is told as a share of it from here on,
MORE_THERE = 5.0  # times the noise of the validation run, RMS
LIKE_NOISE = 1.5  # times the noise, RMS: or else as noise up to here

_WEIGHT = (Verdict.NOTHING_MISSING, Verdict.PARAMETERS_ONLY, Verdict.UNEXPLAINED, Verdict.NAMED)


def overall(verdicts: Sequence[Verdict]) -> Verdict:
    """Named where any channel is, else unexplained where any is, else parameters, else nothing.

    Where no channel could be examined nothing is known.
    """
    return max(verdicts, key=_WEIGHT.index, default=Verdict.UNEXPLAINED)


def confidence(finding: Finding, alternatives: Sequence[str]) -> float:
    """0..1 from the margin over the runner-up, the gain over the null and what is left unexplained."""
    # A name that others may stand for is no surer than where they are not told apart, whatever its lead.
    lead = min(finding.margin, SAME) if alternatives else finding.margin
    margin = 1.0 - float(np.exp(-max(lead, 0.0) / 8.0))
    gain = 1.0 - float(np.exp(-max(finding.gain, 0.0) / 20.0))
    left = float(np.exp(-4.0 * max(finding.excess, 0.0)))
    shared = 1.0 / (1 + len(alternatives))
    doubt = DOUBTED if better_without(finding) or finding.mimic or finding.interrupted else 1.0
    return float(np.clip(max(margin, shared) * gain * left * doubt, 0.0, 0.999))


def better_without(finding: Finding) -> list[Explanation]:
    """Larger nameable sets that do without a name found and yet score clearly better, best first.

    A set whose numbers are not what its names say is no explanation, however it bends to the runs.
    """
    ranked = zip(finding.ranking, finding.scores, strict=True)
    ahead = (e for e, behind in ranked if behind < -SAME and e.inside and e.added)
    return [e for e in ahead if not set(finding.best.added) <= set(e.added) and sensible(e, finding.problem)]


def why(finding: Finding, name: str) -> str:
    """One sentence of evidence for a named effect."""
    explained = 100.0 * (1.0 - finding.excess)
    runner = next((e for e in finding.ranking if e.inside and e.added and name not in e.added), None)
    against = ""
    if runner is not None:
        # Of a long run the others are known on part of the samples only.
        powers = [float(np.mean(np.square(e.fit.residual))) for e in (runner, finding.best)]
        left = float(np.sqrt(powers[0] / max(powers[1], 1e-300)))
        against = f"; the best explanation without it ({' + '.join(runner.added)}) leaves {left:.2f} times the RMS"
    if finding.mimic:
        against += f"; {finding.mimic.replace('_', ' ')}, for which there is no such name, explains it as well"
    return (
        f"it explains {explained:.1f} % of the gap that refitted nominal parameters leave, {_remains(finding)}{against}"
    )


def _remains(finding: Finding) -> str:
    """What the best set leaves, in words."""
    over = finding.over_noise
    if finding.excess >= TOLD:
        return f"{100.0 * finding.excess:.0f} % of the gap remains"
    if max(over, default=1.0) < LIKE_NOISE:
        return "what remains is noise"
    place = " of the validation run" if over[0] < LIKE_NOISE else ""
    return f"what remains is {max(over):.1f} times the noise{place}"


def _spoken(effect: NamedEffect) -> str:
    name = effect.name.replace("_", " ")
    others = f" (or {' or '.join(a.replace('_', ' ') for a in effect.alternatives)})" if effect.alternatives else ""
    return f"{name}{others} in the {effect.channel.value} path"


def sentence(
    verdict: Verdict,
    effects: Sequence[NamedEffect],
    findings: Sequence[Finding],
    gap: Gap,
    units: Mapping[Channel, str],
) -> str:
    """The verdict as a person would say it."""
    if not findings:
        return "Nothing can be concluded from this run: no channel moves enough; the notes on the data say why."
    left = [f for f in findings if f.verdict is Verdict.UNEXPLAINED]
    if verdict is Verdict.NAMED:
        falls = []
        for channel in dict.fromkeys(effect.channel for effect in effects):
            before, after, floor = gap.before[channel].rms, gap.after[channel].rms, gap.noise_floor[channel].rms
            falls.append(f"{before:.3g} to {after:.3g} {units[channel]} (noise floor {floor:.3g})")
        lacks = " and ".join(_spoken(e) for e in effects)
        text = f"The model lacks {lacks}; with it the RMS gap falls from {'; '.join(falls)}."
        text += _elsewhere(effects, findings, gap, units)
        if left:
            text += f" The gap of the {left[0].problem.channel.value} path stays unexplained."
        return text
    if verdict is Verdict.PARAMETERS_ONLY:
        channels = " and ".join(effect.channel.value for effect in effects)
        text = f"No effect is missing: refitted nominal parameters of the {channels} path close the gap."
        others = [f"{a.replace('_', ' ')} in the {e.channel.value} path" for e in effects for a in e.alternatives]
        return f"{text} So would {' or '.join(others)}." if others else text
    if verdict is Verdict.NOTHING_MISSING:
        return "Nothing is missing: the model agrees with the measurement down to the noise."
    finding = left[0]
    start = f"The gap of the {finding.problem.channel.value} path has structure that no named effect explains; "
    if finding.rival:
        return f"{start}it behaves like {finding.rival.replace('_', ' ')}."
    if finding.best.added and finding.excess < TOLD:
        nearest = " and ".join(name.replace("_", " ") for name in finding.best.added)
        return f"{start}{nearest} comes near, but other sets do without it and fit better."
    return f"{start}the nearest leaves {100 * finding.nearest:.0f} % of it."


def _elsewhere(
    effects: Sequence[NamedEffect], findings: Sequence[Finding], gap: Gap, units: Mapping[Channel, str]
) -> str:
    """How far it bears out on the validation run, where something more shows there."""
    named = {effect.channel for effect in effects}
    for finding in findings:
        channel = finding.problem.channel
        over = finding.over_noise[1:]
        if channel in named and over and over[0] >= MORE_THERE:
            before, after = gap.validation_before[channel].rms, gap.validation_after[channel].rms
            return (
                f" On the validation run it falls from {before:.3g} to {after:.3g} {units[channel]}, "
                f"still {over[0]:.1f} times the noise: something shows there that this run does not tell."
            )
    return ""
