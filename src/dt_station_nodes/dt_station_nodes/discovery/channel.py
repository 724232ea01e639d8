"""Stages 3, 5 and 6 for one channel: null first, candidates, decision."""

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from ..core.models import PathSpec
from ..workers import ALONE, Workers
from .choice import alternatives, best_set, both_limit, certain, hides, rivals_with, with_namesakes
from .distinct import distinct
from .doubts import DOUBT_SHARE, LEFT_NOISE, doubted
from .growth import MOST, Growth
from .measure import LEAD, take_measure
from .neighbours import lessened
from .noise import whiteness
from .parsimony import simplified, told_exactly
from .problem import Problem
from .recurring import recurring
from .regrown import regrown
from .result import Verdict
from .retold import retold
from .search import scan, scan_whole
from .selection import Bench, Explanation, Progress, as_given, fit_null
from .sense import sensible
from .settings import DiscoverySettings
from .silence import as_parameters, fits_roughly, silent_verdict
from .strangers import SAME, beside, in_place_of_one, mimic, other_dynamics, stranger
from .tasks import StoppedError
from .terms import nominal_terms

Array = NDArray[np.float64]

# Set on synthetic null, single, pair and out-of-library runs; see docs/confusion.md.
WORTH_NULL = 0.02  # of the noise power: a white gap smaller than this is not looked into
NULL_WHITE = 1.8
MOSTLY = 0.5  # of the gap, or of how far parameters are off: what leaves more of it is not what is missing
LEFT_SHARE = 0.06  # of the gap may stay unexplained
ROUGH_SHARE = 0.4  # the same for a linear path fitted as a whole to foreign data, where no model reaches the noise
BENT_SHARE = 0.015  # the same for several effects that need nominal parameters far off as well
REAL_SHARE = 0.15  # the same where nothing of any kind leaves much less,
NOBODY_LEAVES = 0.33  # that is this part of it
ALIKE = 1.25  # times what the best leaves beyond noise is as good where that is much,
TOLD = 12.0  # twice a log-likelihood ratio: forms are never quite the rig's, so a smaller one tells no two apart,
BENDS_TOLD = 40.0  # nor does this two limits, between which only how they bend decides
FAINT = 0.03  # of the noise power, left by a name: its form is not quite the rig's,
FAINT_ALIKE = 4.0  # and one that leaves so many times as much may be nearer to it in kind
NEEDED = 4.0  # times as much is left by all that does without the set: it is there, if not alone
VAGUE = 3  # names that could stand in the place of one of several,
NAMELESS = 6  # and of any: it is no name
MOST_SINGLE = 18
FINEST_SINGLE = 18
MOST_WHOLE = 6


@dataclass(frozen=True, slots=True)
class Finding:
    """What one channel says. `given`: residual (n,) of the given model; `sigma`: noise, unit of the channel.

    `alternatives[i]` are names that could stand for the i-th added effect; `rival` a form outside the vocabulary that
    makes them doubtful, `mimic` one that explains as much; `excess` what is left of the gap, of its start, `nearest`
    what the set of nameable effects leaves of it that leaves least; `over_noise` what is left of each run over its
    noise, RMS.
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
    nearest: float = 1.0
    over_noise: tuple[float, ...] = ()
    mimic: str = ""


def base_paths(path: PathSpec) -> list[PathSpec]:
    """The nominal path, and it without each subset of its own effects, which the data may contradict."""
    own = path.effects
    subsets = [subset for kept in range(len(own), -1, -1) for subset in combinations(own, kept)]
    return [path.model_copy(update={"effects": subset}) for subset in subsets]


def _starting_points(null: Explanation, bare: Explanation) -> list[Explanation]:
    """What effects are added to: the null, and the path without its own effects where these make a difference."""
    if not null.fit.path.effects or abs(null.fit.rss - bare.fit.rss) < 1e-3 * bare.fit.rss:
        return [null]
    return [null, bare]


def foremost_null(bench: Bench, bases: list[PathSpec]) -> tuple[list[Explanation], Explanation]:
    """Each of `bases` with its nominal parameters refitted, and the best of these and of the same left as they are."""
    nulls = [fit_null(bench, base) for base in bases]
    first = take_measure(bench, nulls)
    untouched = [] if first.rough else [as_given(bench, base) for base in bases]
    return nulls, min([*nulls, *untouched], key=lambda e: (first.score(e), -len(e.fit.path.effects)))


def null_and_noise(problem: Problem, path: PathSpec, check: Problem | None = None) -> tuple[Explanation, float]:
    """The best null of a channel's run, and the noise that it shows (RMS, unit of the channel), without a search."""
    bench = Bench(problem, nominal_terms(path, problem.signal, problem.rough), check)
    nulls, null = foremost_null(bench, base_paths(path))
    return null, take_measure(bench, nulls).floors[0] ** 0.5


def examine(
    problem: Problem,
    path: PathSpec,
    settings: DiscoverySettings,
    progress: Progress | None = None,
    check: Problem | None = None,
    workers: Workers = ALONE,
) -> Finding:
    """The answer for one channel, `check` being the validation run's problem; keeps what is known when interrupted."""
    bench = Bench(problem, nominal_terms(path, problem.signal, problem.rough), check, workers, progress)
    bases = base_paths(path)
    given = min((problem.residual(base) for base in bases), key=lambda r: float(r @ r))
    nulls, null = foremost_null(bench, bases)
    known, interrupted = [null], False
    begun: list[Explanation] = []
    try:
        measure = take_measure(bench, known)
        quiet = measure.left(null) < WORTH_NULL * measure.noise and whiteness(null.fit.residual) < NULL_WHITE
        silent = (quiet or not measure.seen(null)) and not measure.bent(null)
        if not silent:
            begin = _starting_points(null, nulls[-1])
            known += recurring(scan(bench, begin, MOST_SINGLE, FINEST_SINGLE), known, measure)
            far = min(measure.left(e) for e in known if e.inside) > MOSTLY * measure.left(null)
            if far and not problem.may_be_rough:
                known = distinct(bench, [*known, *recurring(scan_whole(bench, begin, MOST_WHOLE), known, measure)])
            # Another form may foretell the other run: only where none does is a further effect to be looked for.
            known, begun = regrown(bench, null, known, take_measure(bench, known), where_full=True)
            Growth(bench, null, known, settings.max_effects).run()
        elif silent_verdict(bench, given, null, measure) is Verdict.PARAMETERS_ONLY:
            # What shifts a run's phase or size may be an effect as well as a parameter far off.
            known += scan(bench, [null], MOST, 0)
        measure = take_measure(bench, known)
        known = lessened(bench, known, simplified(bench, known, measure), measure)
        known = retold(bench, null, told_exactly(bench, known, measure), measure)
        known, _ = regrown(bench, null, known, measure, begun=begun)
    except KeyboardInterrupt as stop:
        interrupted = True
        known = distinct(bench, [*known, *(stop.found if isinstance(stop, StoppedError) else ())])
    return _decide(bench, given, null, known, interrupted)


def _decide(bench: Bench, given: Array, null: Explanation, known: list[Explanation], interrupted: bool) -> Finding:
    measure = take_measure(bench, known)
    seen = measure.seen(null)
    best = best_set(null, known, measure) if seen or measure.bent(null) else null
    fine = not measure.rough or fits_roughly(null, measure)
    unfound = seen and fine and measure.left(best) > MOSTLY * measure.left(null)
    gone = not seen or as_parameters(null, given, measure)
    # Where no gap shows, a name that leaves the parameters off explains nothing.
    if unfound or (gone and best.fit.penalty >= MOSTLY * null.fit.penalty):
        best = null
    mine, left, gap = measure.score(best), measure.left(best), max(measure.left(null), 1e-9)
    scored = sorted(((measure.score(e) - mine, e) for e in known), key=lambda pair: pair[0])
    rival, further = "", False
    peers: list[tuple[float, Explanation]] = []
    if best.added:
        rival = stranger(best, scored, trifling=left <= DOUBT_SHARE * gap, rough=measure.rough)
        rival = rival or other_dynamics(bench.problem, best, measure.floors[0])
        rivals = [p for p in scored if p[1].inside and len(p[1].added) == len(best.added) and p[1] is not best]
        # One that is there only in name, its effect fitted to nothing, is no other explanation.
        peers = [p for p in rivals if not p[1].hollow and (p[0] > SAME or rivals_with(best, p[1], measure))]
        # Several effects that need nominal parameters further off than one of them have to explain all of it.
        parts = [e for _, e in scored if len(e.added) == 1 and set(e.added) < set(best.added)]
        further = measure.bent(best) and all(best.fit.penalty > e.fit.penalty for e in parts[:1])
        few = len(best.added) == 1 or not further
        share = ROUGH_SHARE if measure.rough else (LEFT_SHARE if few else BENT_SHARE)
        others = beside(best, scored, lambda e: measure.left(e) < LEFT_NOISE * measure.noise)
        # A larger set that was not believed mends the form of its part.
        apart = (e for e in known if not set(best.added) < set(e.added))
        if few and not measure.rough and min(measure.left(e) for e in apart) > NOBODY_LEAVES * left:
            share = REAL_SHARE
        if few and min((measure.left(e) for _, e in others), default=0.0) > NEEDED * left:
            share = max(share, REAL_SHARE)
        unexplained = left > share * gap and left > LEFT_NOISE * measure.noise
        doubtful = unexplained or doubted(best, gap, others, measure)
        verdict = Verdict.UNEXPLAINED if rival or doubtful else Verdict.NAMED
    else:
        verdict = silent_verdict(bench, given, null, measure)
    # Between forms that both miss as much as they miss of the truth, a likelihood decides nothing.
    much = left > LEFT_NOISE * measure.noise
    misfit = measure.missed_by(best)
    close = [p for p in peers if (much or p[0] < LEAD * misfit) and measure.left(p[1]) < ALIKE * left]
    if len(best.added) == 1 and FAINT * measure.noise < left and not much:
        close = [p for p in peers if measure.left(p[1]) < FAINT_ALIKE * left]
    alike = [p for p in close if sensible(p[1], bench.problem)]
    told = TOLD if len(best.added) == 1 else SAME
    equals = [p for p in peers if p[0] <= (BENDS_TOLD if both_limit(best, p[1]) else told) or p in alike]
    instead = alternatives(best, equals)
    most = max(map(len, instead), default=0)
    vague = most >= VAGUE or (much and any(measure.left(e) < ALIKE * left for e in in_place_of_one(best, known)))
    if len(best.added) > 1 and (vague or (verdict is Verdict.UNEXPLAINED and (further or rival))):
        # What others do as well, or bends the model and is not believed, mends the form of the rest.
        fewer = [e for e in known if len(e.added) < len(best.added)]
        without = _decide(bench, given, null, fewer, interrupted)
        hidden = verdict is Verdict.NAMED and hides(without.best, best)
        mended = vague and left > MOSTLY * measure.left(without.best)
        if not hidden and (without.verdict is Verdict.NAMED or mended):
            return without
    if verdict is Verdict.NAMED and most >= NAMELESS:
        verdict = Verdict.UNEXPLAINED
    if verdict is Verdict.NAMED:
        instead = with_namesakes(best, instead, [e for _, e in equals], bench.problem)
    if verdict is Verdict.PARAMETERS_ONLY:
        near = [e for behind, e in scored if behind < SAME and e.inside and len(e.added) == 1 and certain(e, measure)]
        instead = (tuple(dict.fromkeys(e.added[0] for e in near)),)
    return Finding(
        bench.problem,
        verdict,
        given,
        null,
        best,
        tuple(e for _, e in scored),
        tuple(behind for behind, _ in scored),
        instead,
        float(peers[0][0]) if peers else 0.0,
        float(measure.score(null) - mine),
        float(left / gap) if best.added else 0.0,
        float(measure.floors[0] ** 0.5),
        rival,
        interrupted,
        min((measure.left(e) / gap for e in known if e.inside and e.added), default=1.0),
        tuple(
            (max(over, 0.0) / floor + 1.0) ** 0.5
            for over, floor in zip(measure.gaps(best), measure.floors, strict=True)
        ),
        mimic(best, scored) if verdict is Verdict.NAMED else "",
    )
