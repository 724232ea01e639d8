"""Stages 3, 5 and 6 for one channel: null first, candidates, decision."""

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from ..core.models import PathSpec
from ..core.models.effects import registry
from .candidates import in_vocabulary
from .noise import effective_samples, whiteness
from .problem import Problem
from .result import Verdict
from .selection import NEGLIGIBLE, Bench, Explanation, Progress, fit_null, penalised, scan
from .settings import DiscoverySettings
from .terms import nominal_terms, refits_all

Array = NDArray[np.float64]

# Set on synthetic null, single, pair and out-of-library runs; see docs/confusion.md.
ENOUGH_TO_NAME = 18.0  # twice the log-likelihood ratio over the null, complexity already paid
ENOUGH_TO_REFIT = 12.0
SAME = 6.0  # closer candidates are reported as one set
LEFT_SHARE = 0.06  # of the gap may stay unexplained
ROUGH_SHARE = 0.4  # the same for a linear path fitted as a whole to foreign data, where no model reaches the noise
ROUGH_GAIN = 0.025  # there a further effect must be worth this share of the gap
ROUGH_ENOUGH = 10.0
LEFT_NOISE = 0.2  # and of the noise power
NEXT_LEAVES = 0.4  # a further effect must leave at most this much of what the last one left
SMALL_SHARE = 0.02  # one that is worth less of the gap
SMALL_LEAVES = 0.12  # must leave next to nothing of it
WORTH_NOISE = 0.08  # a further effect is looked for while more than this of the noise power is left
WORTH_SHARE = 0.0008  # and more than this of the gap
NOT_WHITE = 4.0  # times the squared autocorrelation of white noise
MORE_LEAVES = 0.6  # a third effect is tried only where the second left at most this
BEAM = 3
MOST = 14


@dataclass(frozen=True, slots=True)
class Finding:
    """What one channel says. `given`: residual (n,) of the given model; `sigma`: noise, unit of the channel.

    `alternatives[i]` are names that could stand for the i-th added effect; `rival` a form outside the
    vocabulary that explains the gap better than all names; `excess` what is left of the gap, of its start.
    """

    problem: Problem
    verdict: Verdict
    given: Array
    null: Explanation
    best: Explanation
    ranking: tuple[Explanation, ...]
    scores: tuple[float, ...]
    alternatives: tuple[tuple[str, ...], ...]
    margin: float
    gain: float
    excess: float
    sigma: float
    rival: str = ""
    interrupted: bool = False


def base_paths(path: PathSpec) -> list[PathSpec]:
    """The nominal path, and it without each subset of its own effects, which the data may contradict."""
    own = path.effects
    subsets = [subset for kept in range(len(own), -1, -1) for subset in combinations(own, kept)]
    return [path.model_copy(update={"effects": subset}) for subset in subsets]


@dataclass(frozen=True, slots=True)
class _Measure:
    """What gaps are measured with: noise power and effective samples, seen in the best explanation so far."""

    bench: Bench
    floors: tuple[float, ...]
    samples: float
    rough: bool

    @property
    def noise(self) -> float:
        """What noise, and form error not worth a word, would leave."""
        return self.bench.noise(self.floors)

    def score(self, explanation: Explanation) -> float:
        """Penalised misfit."""
        return penalised(self.bench, explanation, self.samples, self.floors)

    def left(self, explanation: Explanation) -> float:
        """What an explanation leaves beyond noise."""
        return max(self.bench.misfit(explanation, self.floors) - self.noise, 0.0)


def _measure(bench: Bench, known: list[Explanation]) -> _Measure:
    nearest = min(known, key=lambda e: e.fit.rss)
    return _Measure(bench, bench.floors(nearest), bench.worth(nearest), refits_all(nearest.fit.path))


def examine(
    problem: Problem,
    path: PathSpec,
    settings: DiscoverySettings,
    progress: Progress | None = None,
    check: Problem | None = None,
) -> Finding:
    """The answer for one channel, `check` being the validation run's problem; keeps what is known when interrupted."""
    bench = Bench(problem, nominal_terms(path, problem.signal), check, settings.jobs, progress)
    bases = base_paths(path)
    given = min((problem.residual(base) for base in bases), key=lambda r: float(r @ r))
    nulls = [fit_null(bench, base) for base in bases]
    first = _measure(bench, nulls)
    null = min(nulls, key=lambda e: (first.score(e), -len(e.fit.path.effects)))
    known = [null]
    interrupted = False
    try:
        known += scan(bench, [null] if null is nulls[-1] else [null, nulls[-1]])
        for _ in range(settings.max_effects - 1):
            measure = _measure(bench, known)
            inside = sorted((e for e in known if e.inside and e.added), key=measure.score)
            # A form outside the vocabulary that leaves nothing ends the search too: more names would only mimic it.
            left = min(measure.left(e) for e in known)
            if left <= max(WORTH_NOISE * measure.noise, WORTH_SHARE * measure.left(null)):
                break
            size = len(inside[0].added)
            if (
                not measure.rough
                and size > 1
                and measure.left(inside[0]) > MORE_LEAVES * min(measure.left(e) for e in inside if len(e.added) < size)
            ):
                break
            known += scan(bench, inside[:BEAM], MOST)
    except KeyboardInterrupt:
        interrupted = True
    return _decide(bench, given, null, known, interrupted)


def _alternatives(
    best: Explanation, scored: list[tuple[float, Explanation]], limit: float
) -> tuple[tuple[str, ...], ...]:
    """For each name of the best set, names that put in its place do as well."""
    found: list[list[str]] = [[] for _ in best.added]
    for behind, other in scored:
        if behind > limit or other is best or len(other.added) != len(best.added):
            continue
        missing = [name for name in best.added if name not in other.added]
        instead = [name for name in other.added if name not in best.added]
        if len(missing) == 1:
            place = best.added.index(missing[0])
            if instead[0] not in found[place]:
                found[place].append(instead[0])
    return tuple(tuple(names) for names in found)


def _best_set(null: Explanation, known: list[Explanation], measure: _Measure) -> Explanation:
    """The smallest set of nameable effects that no larger one beats clearly."""
    best = null
    for size in range(1, 1 + max((len(e.added) for e in known), default=0)):
        tier = [e for e in known if e.inside and len(e.added) == size]
        if not tier:
            break
        leader = next((e for e in sorted(tier, key=measure.score) if _certain(e, measure)), None)
        if leader is None:
            break
        won = measure.score(best) - measure.score(leader)
        enough = ROUGH_ENOUGH if measure.rough and size > 1 else ENOUGH_TO_NAME
        if won < enough or (size > 1 and not _adds(best, leader, null, measure)):
            break
        best = leader
    return best


def _certain(explanation: Explanation, measure: _Measure) -> bool:
    """Whether each effect added has a parameter whose 95 % interval excludes the value that changes nothing."""
    fit = explanation.fit
    samples = measure.samples * len(fit.residual) / measure.bench.count
    covariance = fit.fitted.covariance(samples, len(fit.residual))
    sure = set()
    for index, term in enumerate(fit.hypothesis.terms):
        if term.effect < 0:
            continue
        name = fit.path.effects[term.effect].name
        parameter = registry()[name].parameter(term.name)
        if parameter.optional:
            continue
        reach = 1.96 * float(covariance[index, index]) ** 0.5
        neutral = term.to_x(parameter.neutral)
        if abs(float(fit.fitted.x[index]) - neutral) > reach:
            sure.add(name)
    return all(name in sure for name in explanation.added)


def _adds(best: Explanation, leader: Explanation, null: Explanation, measure: _Measure) -> bool:
    """Whether a further effect is more than the mending of the former ones' form."""
    before, after = measure.left(best), measure.left(leader)
    if measure.rough:
        return before - after > ROUGH_GAIN * measure.left(null)
    small = before - after < SMALL_SHARE * measure.left(null)
    return after <= (SMALL_LEAVES if small else NEXT_LEAVES) * before + 0.03 * measure.noise


def _silent(bench: Bench, given: Array, null: Explanation, measure: _Measure) -> Verdict:
    """The verdict where no effect earns a name."""
    problem = bench.problem
    over = measure.left(null)
    unlike_noise = whiteness(null.fit.residual) > NOT_WHITE
    if over > 1.0 * measure.noise or (over > 0.25 * measure.noise and unlike_noise):
        return Verdict.UNEXPLAINED
    count = len(problem.measured)
    negligible = (NEGLIGIBLE * problem.signal) ** 2
    ratio = (float(given @ given) / count + negligible) / (null.powers[0] / count + negligible)
    worth = effective_samples(null.fit.residual)
    refit = worth * np.log(ratio) - null.fit.freedoms * np.log(worth)
    return Verdict.PARAMETERS_ONLY if refit > ENOUGH_TO_REFIT else Verdict.NOTHING_MISSING


def _decide(bench: Bench, given: Array, null: Explanation, known: list[Explanation], interrupted: bool) -> Finding:
    measure = _measure(bench, known)
    best = _best_set(null, known, measure)
    mine = measure.score(best)
    gap = max(measure.left(null), 1e-9)
    left = measure.left(best)
    scored = sorted(((measure.score(e) - mine, e) for e in known), key=lambda pair: pair[0])
    rival = ""
    peers: list[tuple[float, Explanation]] = []
    if best.added:
        ahead = [e for behind, e in scored if not e.inside and behind < -SAME and len(e.added) <= len(best.added)]
        if ahead:
            rival = next(name for name in ahead[0].added if not in_vocabulary(name))
        peers = [p for p in scored if p[1].inside and len(p[1].added) == len(best.added) and p[1] is not best]
        share = ROUGH_SHARE if measure.rough else LEFT_SHARE
        unexplained = left > share * gap and left > LEFT_NOISE * measure.noise
        verdict = Verdict.UNEXPLAINED if rival or unexplained else Verdict.NAMED
    else:
        verdict = _silent(bench, given, null, measure)
    return Finding(
        bench.problem,
        verdict,
        given,
        null,
        best,
        tuple(e for _, e in scored),
        tuple(behind for behind, _ in scored),
        _alternatives(best, peers, SAME),
        float(peers[0][0]) if peers else 0.0,
        float(measure.score(null) - mine),
        float(left / gap) if best.added else 0.0,
        float(measure.floors[0] ** 0.5),
        rival,
        interrupted,
    )
