"""Sets beside a found one: less one effect, the best form of each."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import partial

from ..core.models import PathSpec
from .candidates import Candidate, Freed, hypothesis
from .choice import ENOUGH_TO_TELL
from .distinct import distinct
from .hypothesis_fit import fit_hypothesis
from .measure import Measure
from .refinements import Refinements, refined_starts, refinements, step_starts
from .selection import Bench, Explanation
from .timing import without


@dataclass(frozen=True, slots=True)
class _Bare:
    """What is left of a set, the numbers of it to fit and where from."""

    bare: Explanation
    freed: Freed
    paths: list[PathSpec]


def _without(bench: Bench, explanation: Explanation, name: str) -> Explanation:
    """An explanation less one effect, the others as they were fitted beside it: one to fit from, not to judge."""
    fit = explanation.fit
    path = without(fit.path, name)
    residual = bench.problem.residual(path)
    bare = replace(fit, path=path, residual=residual, rss=float(residual @ residual) / bench.problem.sigma**2)
    freed = {key: value for key, value in explanation.freed.items() if key != name}
    return replace(explanation, fit=bare, added=tuple(n for n in explanation.added if n != name), freed=freed)


def parts(bench: Bench, explanation: Explanation) -> list[Explanation]:
    """A set less each of its effects in turn."""
    return [_without(bench, explanation, name) for name in explanation.added]


def reduced(bench: Bench, explanations: Iterable[Explanation]) -> list[Explanation]:
    """Each set less each of its effects, the rest fitted on from there: a larger set may have found the way for it.

    What was taken out may have stood for a refinement of one that stays, so each of these is tried refined too.
    """
    tasks: list[_Bare] = []
    wholes: list[tuple[int, Explanation]] = []
    for explanation in explanations:
        for bare in parts(bench, explanation):
            if not bare.added:
                continue
            wholes.append((len(tasks), explanation))
            tasks.append(_Bare(bare, bare.freed, [bare.fit.path]))
            for spec in bare.fit.path.effects:
                if spec.name not in bare.added:
                    continue
                candidate = Candidate(spec.name, spec.at)
                if not candidate.optional:
                    continue
                left, timed = bare.fit.residual, not bench.rough
                forms = refinements(bench.problem, bare.fit.path, candidate, left, timed, bench.nominal)
                free = dict.fromkeys((*candidate.required, *forms.names, *bare.freed.get(spec.name, ())))
                starts = refined_starts(bare.fit.path, forms)
                tasks.append(_Bare(bare, {**bare.freed, spec.name: tuple(free)}, [bare.fit.path, *starts]))
    found = list(bench.workers.results(partial(_fitted, bench.alone), tasks))
    steps = [step for at, whole in wholes if told_there(bench, found[at], whole) for step in _steps(bench, found[at])]
    return found + list(bench.workers.results(partial(_fitted, bench.alone), steps))


def told_there(bench: Bench, less: Explanation, whole: Explanation) -> bool:
    """Whether the other run alone tells a set from what is left of it."""
    if bench.check is None or bench.rough:
        return False
    measure = Measure(bench, bench.floors(whole), bench.worth(whole), bench.rough)
    # Settled, what is left may miss the run for the other's sake.
    here = bench.tells(less.fit, whole.fit, measure.samples)
    return here < ENOUGH_TO_TELL <= measure.told(less, whole)[1]


def _steps(bench: Bench, explanation: Explanation) -> list[_Bare]:
    """A set with each refinement of each of its effects alone, from each of its starts.

    All of them free, a fit ends anywhere where the run does not tell them, and what foretells the other is missed.
    """
    tasks = []
    for forms in refinable(bench, explanation):
        for name in forms.grids:
            freed = also_free(explanation, forms, (name,))
            starts = step_starts(explanation.fit.path, forms, (name,))
            tasks += [_Bare(explanation, freed, [start]) for start in starts]
    return tasks


def refinable(bench: Bench, explanation: Explanation) -> Iterator[Refinements]:
    """What may refine each effect of a set, but what comes and goes and forms so free that they mend the others."""
    fit = explanation.fit
    for spec in fit.path.effects:
        if spec.name in explanation.added:
            candidate = Candidate(spec.name, spec.at)
            yield refinements(bench.problem, fit.path, candidate, fit.residual, False, bench.nominal, False)


def also_free(explanation: Explanation, forms: Refinements, names: tuple[str, ...]) -> Freed:
    """What is free in a set with some refinements of one of its effects free too."""
    own = forms.candidate.name
    return {**explanation.freed, own: tuple(dict.fromkeys((*explanation.freed[own], *names)))}


def _fitted(bench: Bench, task: _Bare) -> Explanation:
    hypotheses = [hypothesis(bench.problem, path, bench.nominal, task.freed) for path in task.paths]
    starts = [h.start() for h in hypotheses]
    fit = fit_hypothesis(bench.problem, hypotheses[0], starts, bench.iterations)
    return bench.judged(bench.explained(fit, task.bare.added, task.freed))


def lessened(
    bench: Bench, before: Iterable[Explanation], known: list[Explanation], measure: Measure
) -> list[Explanation]:
    """What is known; as long as a larger set leads in a form that it had not `before`, that less each effect too.

    A form come upon on a larger set's way may be all that one of its effects lacked.
    """
    leader = min((e for e in known if e.inside), key=measure.score)
    if bench.rough or len(leader.added) < 2 or any(e is leader for e in before):
        return known
    return lessened(bench, known, distinct(bench, [*known, *reduced(bench, [leader])]), measure)
