"""Stages 3, 5 and 6 for one channel: null first, candidates, decision."""

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from ..core.models import PathSpec
from .noise import effective_samples
from .problem import Problem, nominal_terms
from .result import Verdict
from .selection import Bench, Explanation, Progress, fit_null, floor_of, in_vocabulary, penalised, scan
from .settings import DiscoverySettings

Array = NDArray[np.float64]

# Set on synthetic null, single, pair and out-of-library runs; see docs/confusion.md.
ENOUGH_TO_NAME = 18.0  # twice the log-likelihood ratio over the null, complexity already paid
ENOUGH_TO_REFIT = 12.0
SAME = 6.0  # closer candidates are reported as one set
LEFT_SHARE = 0.06  # of the gap may stay unexplained
LEFT_NOISE = 0.2  # and of the noise power
NEXT_LEAVES = 0.4  # a further effect must leave at most this much of what the last one left
BEAM = 3


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
    found = []
    for kept in range(len(own), -1, -1):
        for subset in combinations(own, kept):
            found.append(path.model_copy(update={"effects": subset}))
    return found


def _freedom(problem: Problem) -> float:
    return float(problem.weights.sum()) - problem.windows.freedoms


def _noise_rss(problem: Problem, sigma: float) -> float:
    """Sum of squares over the working sigma that noise alone, and form error not worth a word, would leave."""
    from .selection import NEGLIGIBLE

    return _freedom(problem) * (sigma**2 + (NEGLIGIBLE * problem.signal) ** 2) / problem.sigma**2


def _alternatives(
    best: Explanation, scored: list[tuple[float, Explanation]], limit: float
) -> tuple[tuple[str, ...], ...]:
    """For each name of the best set, names that put in its place do as well."""
    found: list[list[str]] = [[] for _ in best.added]
    low = scored[0][0]
    for score, other in scored[1:]:
        if score - low > limit or len(other.added) != len(best.added):
            continue
        missing = [name for name in best.added if name not in other.added]
        instead = [name for name in other.added if name not in best.added]
        if len(missing) == 1 and in_vocabulary(instead[0]):
            place = best.added.index(missing[0])
            if instead[0] not in found[place]:
                found[place].append(instead[0])
    return tuple(tuple(names) for names in found)


def examine(problem: Problem, path: PathSpec, settings: DiscoverySettings, progress: Progress | None = None) -> Finding:
    """The answer for one channel; keeps what is known when interrupted."""
    bench = Bench(problem, nominal_terms(path), settings.jobs, progress)
    bases = base_paths(path)
    given = min((problem.residual(base) for base in bases), key=lambda r: float(r @ r))
    nulls = [fit_null(bench, base) for base in bases]
    full = effective_samples(nulls[0].fit.residual)
    null = min(nulls, key=lambda e: (penalised(problem, e, full), -len(e.fit.path.effects)))
    stripped = nulls[-1]
    known = [null]
    interrupted = False
    try:
        starts = [null] if null is stripped or not path.effects else [null, stripped]
        known += scan(bench, starts)
        for _round in range(settings.max_effects - 1):
            sigma = floor_of(problem, sorted(known, key=lambda e: e.fit.rss)[:1])
            noise = _noise_rss(problem, sigma)
            samples = effective_samples(min(known, key=lambda e: e.fit.rss).fit.residual)
            ordered = sorted(known, key=lambda e: penalised(problem, e, samples))
            inside = [e for e in ordered if e.inside and e.added]
            if not inside or not _worth_more(null, ordered[0], inside[0], noise):
                break
            known += scan(bench, inside[:BEAM], None)
    except KeyboardInterrupt:
        interrupted = True
    return _decide(problem, given, null, known, interrupted)


def _worth_more(null: Explanation, best: Explanation, inside: Explanation, noise: float) -> bool:
    """Whether what the best explanation leaves is worth another effect."""
    left = inside.fit.rss - noise
    return left > 0.08 * noise and left > 0.004 * (null.fit.rss - noise)


def _decide(problem: Problem, given: Array, null: Explanation, known: list[Explanation], interrupted: bool) -> Finding:
    sigma = floor_of(problem, sorted(known, key=lambda e: e.fit.rss)[:1])
    noise = _noise_rss(problem, sigma)
    samples = effective_samples(min(known, key=lambda e: e.fit.rss).fit.residual)
    scored = sorted(((penalised(problem, e, samples), e) for e in known), key=lambda pair: pair[0])
    base = penalised(problem, null, samples)
    best = _best_set(null, known, problem, samples, noise)
    mine = penalised(problem, best, samples)
    gain = base - mine
    gap = max(null.fit.rss - noise, 1e-9)
    left = max(best.fit.rss - noise, 0.0)
    rivals = [(score, e) for score, e in scored if not e.inside]
    rival = ""
    if rivals and best.added and rivals[0][0] < mine - SAME and len(rivals[0][1].added) <= len(best.added):
        rival = next(name for name in rivals[0][1].added if not in_vocabulary(name))
    peers = [(mine, best)] + [(s, e) for s, e in scored if e.inside and e.added and e is not best]
    same_size = sorted((p for p in peers if len(p[1].added) == len(best.added)), key=lambda p: p[0])
    if same_size and same_size[0][1] is not best:
        same_size = [p for p in same_size if p[1] is best] + [p for p in same_size if p[1] is not best]
    margin = same_size[1][0] - mine if len(same_size) > 1 else gain
    verdict = Verdict.NAMED
    if not best.added or gain < ENOUGH_TO_NAME:
        best = null
        start = float(given @ given) / problem.sigma**2
        worth = effective_samples(null.fit.residual)
        negligible = noise * 0.0 + _freedom(problem) * (1e-3 * problem.signal / problem.sigma) ** 2
        refit = worth * np.log((start + negligible) / (null.fit.rss + negligible)) - null.fit.freedoms * np.log(worth)
        verdict = Verdict.PARAMETERS_ONLY if refit > ENOUGH_TO_REFIT else Verdict.NOTHING_MISSING
        if gap > 1.0 * noise and null.fit.rss > 2.0 * noise:
            verdict = Verdict.UNEXPLAINED
    elif rival or (left > LEFT_SHARE * gap and left > LEFT_NOISE * noise):
        verdict = Verdict.UNEXPLAINED
    ranking = tuple(e for _, e in scored)
    return Finding(
        problem,
        verdict,
        given,
        null,
        best,
        ranking,
        tuple(score - mine for score, _ in scored),
        _alternatives(best, same_size, SAME) if best.added else (),
        float(margin),
        float(gain),
        float(left / gap),
        sigma,
        rival,
        interrupted,
    )


def _best_set(
    null: Explanation, known: list[Explanation], problem: Problem, samples: float, noise: float
) -> Explanation:
    """The smallest set of nameable effects that no larger one beats clearly."""
    best = null
    for size in range(1, 1 + max((len(e.added) for e in known), default=0)):
        tier = [e for e in known if e.inside and len(e.added) == size]
        if not tier:
            break
        leader = min(tier, key=lambda e: penalised(problem, e, samples))
        won = penalised(problem, best, samples) - penalised(problem, leader, samples)
        before = max(best.fit.rss - noise, 0.0)
        after = max(leader.fit.rss - noise, 0.0)
        if won < ENOUGH_TO_NAME or (size > 1 and after > NEXT_LEAVES * before):
            break
        best = leader
    return best
