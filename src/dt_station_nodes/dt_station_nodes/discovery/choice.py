"""Stage 6: which set of effects earns its names, and which names could stand in their place."""

from collections.abc import Iterable
from dataclasses import replace

from ..core.models.effects import registry
from .measure import Measure
from .namesakes import namesakes
from .problem import Problem
from .selection import Explanation
from .sense import sensible
from .timing import PERIODIC
from .unseen import unseen_residual

ENOUGH_TO_TELL = 40.0  # the same over the smaller set, on one run
ENOUGH_TO_NAME = 18.0  # twice the log-likelihood ratio over the null, complexity already paid
LEAST_TOLD = 8.0  # the same on the run that is fitted, bent parameters included
FORETOLD = 0.3  # of what the smaller set leaves of the other run
ROUGH_GAIN = 0.05  # there a further effect must be worth this share of the gap
ROUGH_ENOUGH = 10.0
UNSEEN = 1.4  # times as much where nominal parameters far off leave no gap that shows,
UNHEARD_OF = 5.0  # widths of its prior by which one is off: more than models are
ABSURD, LIKELIER = 12.0, 6.0  # the same, a gain off by a third: any effect that spares it by so much is likelier
TOGETHER = 3.0  # times as much for a pair of which neither earns its name alone
NEXT_LEAVES = 0.4  # a further effect must leave at most this much of what the last one left
WORTH_NOISE = 0.3  # of the noise power: a further effect that explains less of it is the form of the former ones
BENT = 10.0  # priors of the nominal parameters, twice the log
WORTH_SAYING = 0.004  # one that is worth less than this is the form of the former ones,
FAINT_LEAVES = 0.12  # unless it leaves at most this much of what they left
SMALL_SHARE = 0.02  # one that is worth less of the gap
SMALL_LEAVES = 0.12  # must leave little of it
LOOPS = {"hysteresis", "backlash"}
LIMITS = {"saturation", "overflow"}
EVIDENT = (0.003, 0.02)  # of the signal: RMS that it explains on the run, or else on the validation run


def alternatives(best: Explanation, peers: list[tuple[float, Explanation]]) -> tuple[tuple[str, ...], ...]:
    """For each name of the best set, names that put in its place do as well: those of its `peers`."""
    found: list[list[str]] = [[] for _ in best.added]
    for _, other in peers:
        missing = [name for name in best.added if name not in other.added]
        instead = [name for name in other.added if name not in best.added]
        if len(missing) == 1:
            place = best.added.index(missing[0])
            if instead[0] not in found[place]:
                found[place].append(instead[0])
    return tuple(tuple(names) for names in found)


def with_namesakes(
    best: Explanation, instead: tuple[tuple[str, ...], ...], peers: Iterable[Explanation], problem: Problem
) -> tuple[tuple[str, ...], ...]:
    """The alternatives of each name of the best set with what no run tells from it, or from one that `peers` have."""
    found = [list(own) for own in instead]
    for explanation in (best, *peers):
        missing = [name for name in best.added if name not in explanation.added]
        names = namesakes(explanation.fit.path, explanation.added, problem.channel, problem.scales)
        for name, same in zip(explanation.added, names, strict=True):
            if explanation is best or (name not in best.added and len(missing) == 1):
                place = best.added.index(name if explanation is best else missing[0])
                found[place] += [n for n in same if n not in found[place] and n not in best.added]
    return tuple(tuple(own) for own in found)


def best_set(null: Explanation, known: list[Explanation], measure: Measure) -> Explanation:
    """The smallest set of nameable effects that no larger one beats clearly."""
    best = null
    for size in range(1, 1 + max((len(e.added) for e in known), default=0)):
        tier = [e for e in known if e.inside and len(e.added) == size]
        if not tier:
            break
        leader = next((e for e in sorted(tier, key=measure.score) if _stands(best, e, measure)), None)
        gain = enough(null, measure)
        if size > 1:
            # A set none of whose parts is worth a word alone has chosen among very many.
            gain = ROUGH_ENOUGH if measure.rough else gain * (1.0 if best.added else TOGETHER)
        earned = leader is not None and measure.score(best) - measure.score(leader) >= gain
        if leader is not None and earned and (not best.added or _adds(best, leader, null, measure)):
            best = leader
        elif best.added:
            break
    return best


def enough(null: Explanation, measure: Measure) -> float:
    """What a name has to gain over the null: more where refitted parameters leave no gap, unless they are absurd."""
    seen, furthest = measure.seen(null), null.fit.furthest
    if furthest > ABSURD and not (seen or measure.rough):
        return LIKELIER
    return ENOUGH_TO_NAME * (1.0 if seen or furthest > UNHEARD_OF else UNSEEN)


def _stands(best: Explanation, leader: Explanation, measure: Measure) -> bool:
    if not sensible(leader, measure.bench.problem):
        return False
    # What the run itself does not show, no fit to it can measure; unless what it measured foretells the other run.
    shown = measure.told(best, leader)[0] + best.fit.penalty - leader.fit.penalty >= LEAST_TOLD
    if not measure.rough and not shown and not _foretells(best, leader, measure):
        return False
    return sure(leader, measure) or _told(best, leader, measure)


def _foretells(best: Explanation, leader: Explanation, measure: Measure) -> bool:
    """Whether the larger set, with its numbers as the run gave them, explains what the smaller one cannot of the other.

    On two levels alone a gain stands for what another waveform tells from it at once.
    """
    check = measure.bench.check
    if check is None or measure.told(best, leader)[1] < ENOUGH_TO_TELL:
        return False
    own = unseen_residual(check, leader.fit.path)
    noise = measure.floors[1] * len(own)
    return float(own @ own) - noise < FORETOLD * (best.powers[1] - noise)


def certain(explanation: Explanation, measure: Measure) -> bool:
    """Whether an explanation is sure of its effects, and each of these what its name says."""
    return sensible(explanation, measure.bench.problem) and sure(explanation, measure)


def rivals_with(best: Explanation, other: Explanation, measure: Measure) -> bool:
    """Whether another explanation that does as well stands for its names: a loop does for a gap however it is bent."""
    return set(best.added) ^ set(other.added) == LOOPS or certain(other, measure)


def both_limit(one: Explanation, other: Explanation) -> bool:
    """Whether two single effects are limits, of what goes in or of what comes out."""
    return len(one.added) == len(other.added) == 1 and {*one.added, *other.added} == LIMITS


def sure(explanation: Explanation, measure: Measure) -> bool:
    """Whether each effect added has a parameter whose 95 % interval excludes the value that changes nothing.

    The shape parameters are held: they trade against the effect's size without making its presence doubtful.
    """
    fit = explanation.fit
    samples = measure.samples * len(fit.residual) / measure.bench.count
    parameters = {
        index: registry()[fit.path.effects[term.effect].name].parameter(term.name)
        for index, term in enumerate(fit.hypothesis.terms)
        if term.effect >= 0
    }
    held = [index for index, parameter in parameters.items() if not parameter.shows_presence]
    covariance = fit.fitted.covariance(samples, len(fit.residual), held)
    found = set()
    for index, parameter in parameters.items():
        if index in held:
            continue
        term = fit.hypothesis.terms[index]
        name = fit.path.effects[term.effect].name
        reach = 1.96 * float(covariance[index, index]) ** 0.5
        neutral = term.to_x(parameter.neutral)
        if abs(float(fit.fitted.x[index]) - neutral) > reach:
            found.add(name)
    return all(name in found for name in explanation.added)


def _told(best: Explanation, leader: Explanation, measure: Measure) -> bool:
    """Whether either run tells that the larger set is there, however little it tells of its size."""
    nested = set(best.added) <= set(leader.added)
    return nested and any(told > ENOUGH_TO_TELL for told in measure.told(best, leader))


def _evident(best: Explanation, leader: Explanation, measure: Measure) -> bool:
    """Whether the runs themselves show a further effect: what only makes a fit foretell better is its form."""
    gains = zip(measure.bench.problems, best.powers, leader.powers, strict=True)
    shown = [(before - after) / len(p.measured) / p.signal**2 for p, before, after in gains]
    return any(share > least**2 for share, least in zip(shown, EVIDENT, strict=False))


def could_add(explanation: Explanation, measure: Measure) -> bool:
    """Whether what an explanation leaves of the runs is enough for a further effect to be evident."""
    gaps = zip(measure.bench.problems, measure.gaps(explanation), EVIDENT, strict=False)
    return any(gap > (least * p.signal) ** 2 for p, gap, least in gaps)


def hides(fewer: Explanation, more: Explanation) -> bool:
    """Whether a smaller set explains the run only with nominal parameters far off, which a larger one puts back."""
    return fewer.fit.penalty - more.fit.penalty > BENT


def _adds(best: Explanation, leader: Explanation, null: Explanation, measure: Measure) -> bool:
    """Whether a further effect is more than the mending of the former ones' form."""
    before, after = measure.left(best), measure.left(leader)
    if measure.rough:
        # Blocks held out can make a null look as bad as one likes: the yardstick is what its own fit leaves.
        own = replace(null, powers=(float(null.fit.residual @ null.fit.residual), *null.powers[1:]))
        return before - after > ROUGH_GAIN * measure.left(own)
    if hides(best, leader):
        return True
    if not _evident(best, leader, measure):
        return False
    if before - after <= WORTH_NOISE * measure.noise:
        # Unless it is the plainer of the two, or a tone that nothing else there makes, and takes nearly all of it away.
        plainer = leader.fit.freedoms < best.fit.freedoms or set(leader.added) - set(best.added) == {PERIODIC}
        return after <= FAINT_LEAVES * before and plainer
    if before < measure.noise and before - after < WORTH_SAYING * measure.left(null):
        # A mended form leaves much of it, what was missing takes most of it away.
        return after <= FAINT_LEAVES * before
    small = before - after < SMALL_SHARE * measure.left(null)
    return after <= (SMALL_LEAVES if small else NEXT_LEAVES) * before + 0.03 * measure.noise
