"""What a search does at once: one more effect on a base, held against the others that it is tried with."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from .candidates import Candidate, Freed
from .hypothesis_fit import Costs
from .selection import Bench, Explanation

HOPELESS = 50.0  # times the cost of the best where that is all there is: no refinement makes up for so much
OUTRUN = 8.0  # the same for what is behind so many names
FOREMOST = 10
LEADERS = 2  # whose refined forms the others' are held against
_SAME_GLANCE = 1e-3  # of the cost: so near, the same is found again
_FORLORN = 4.0  # times the cost of a rival
CONFUSED = (  # forms, not sizes: what one leaves at a glance does not tell what the other would leave when refined
    {"dead_zone", "friction"},
    {"hysteresis", "backlash"},
    {"extra_lag", "delay"},
    {"asymmetric_gain", "load_dependent_gain"},
    {"leakage", "load_dependent_gain"},
    {"saturation", "rate_limit"},
)
SETTLED = 2.0  # times the cost of the best: what misses the run by more is not settled on the validation run


@dataclass(frozen=True, slots=True)
class Task:
    """One more effect on a base; `seen`: the plain form found, `other`: its other form, `finer`: refined ones.

    What will not get below the cost of a `rival` is not followed to its end; what costs more is not settled. `ahead`:
    the cost of a form that leaves nothing but noise, infinite where none does. `known`: what its starts cost.
    """

    base: Explanation
    candidate: Candidate
    seen: Explanation | None = None
    other: Explanation | None = None
    finer: tuple[Explanation, ...] = ()
    rival: float = np.inf
    ahead: float = np.inf
    known: Costs = field(default_factory=dict, compare=False)

    @property
    def freed(self) -> Freed:
        """Parameters that the base's effects have free."""
        return {name: freed for name, freed in self.base.freed.items() if name != self.candidate.name}

    @property
    def added(self) -> tuple[str, ...]:
        """The names."""
        return (*(name for name in self.base.added if name != self.candidate.name), self.candidate.name)


def forms_of(task: Task) -> tuple[Explanation, ...]:
    """The plain form found, and the refined ones."""
    return (*([] if task.seen is None else [task.seen]), *task.finer)


class StoppedError(KeyboardInterrupt):
    """A search was interrupted; `found` is what it knew by then."""

    def __init__(self, found: list[Explanation]) -> None:
        super().__init__()
        self.found = found


def each(
    bench: Bench,
    work: Callable[[Bench, Task], Task],
    tasks: Sequence[Task],
    told: bool = True,
    before: Sequence[Task] = (),
) -> list[Task]:
    """All tasks' results in their order, whatever the number of workers; StoppedError with those done on Ctrl-C.

    `before`: what was done of them before, which is known then too.
    """
    done: list[Task] = []
    # A task that has none beside it may share its own work.
    shared = bench.workers.results(partial(work, bench.alone), tasks)
    try:
        for result in shared if len(tasks) > 1 else map(partial(work, bench), tasks):
            done.append(result)
            if bench.progress is not None and told:
                bench.progress(f"{bench.problem.channel.value}: {' + '.join(result.added)}")
    except KeyboardInterrupt:
        raise StoppedError(_known(bench, [*before, *done])) from None
    return done


def _known(bench: Bench, done: Sequence[Task]) -> list[Explanation]:
    """Explanations of an interrupted stage; rough data are not judged by a glance."""
    return [task.seen for task in done if task.seen is not None and (task.seen.held or not bench.rough)]


def done_again(
    bench: Bench,
    work: Callable[[Bench, Task], Task],
    tasks: Sequence[Task],
    done: Sequence[Task],
    worth: Callable[[Bench, Task], bool],
) -> list[Task]:
    """What was `done` of tasks, in its place what `work` makes of those `worth` it that none has outrun."""
    most = OUTRUN * _least_full(done)
    places = [i for i, task in enumerate(done) if _least(task) <= most and worth(bench, task)]
    again = each(bench, work, [tasks[i] for i in places], before=done)
    better = dict(zip(places, again, strict=True))
    return [better.get(i, task) for i, task in enumerate(done)]


def against(tasks: Sequence[Task], times: float = SETTLED) -> list[Task]:
    """Tasks to be held against the best of them, `times` its cost."""
    best = min(map(_least, tasks), default=np.inf)
    return [replace(task, rival=min(times * best, task.rival)) for task in tasks]


def to_settle(tasks: Sequence[Task], reached: float) -> list[Task]:
    """Tasks to be held against the best of them and what was `reached` before, whatever they were against.

    What was not worth its way to the end may foretell the other run better than what was.
    """
    return against([replace(task, rival=SETTLED * reached) for task in tasks])


def within_reach(tasks: Sequence[Task]) -> tuple[list[Task], list[Task]]:
    """Tasks that refining may bring near the best of them, and those far behind one that leaves nothing but noise.

    One that is never named leaves the question open how near the others get.
    """
    best = _least_full(tasks)
    foremost = list(dict.fromkeys(task.candidate.name for task in sorted(tasks, key=_least)))[:FOREMOST]

    def near(task: Task) -> bool:
        return _least(task) <= best * (HOPELESS if task.candidate.name in foremost else OUTRUN)

    return [replace(task, ahead=best) for task in tasks if near(task)], [task for task in tasks if not near(task)]


def in_turn(
    bench: Bench, work: Callable[[Bench, Task], Task], tasks: Sequence[Task], before: Sequence[Task]
) -> list[Task]:
    """All tasks' results in their order, the foremost two first: what these come to is `ahead` of the others."""
    places = sorted(range(len(tasks)), key=lambda i: (_least(tasks[i]), i))
    first, others = places[:LEADERS], sorted(places[LEADERS:])
    led = each(bench, work, [tasks[i] for i in first], before=before)
    ahead = _least_full([*tasks, *led])
    rest = [replace(tasks[i], ahead=ahead) for i in others]
    done = dict(zip(first + others, [*led, *each(bench, work, rest, before=[*before, *led])], strict=True))
    return [done[i] for i in range(len(tasks))]


def told_apart(tasks: Sequence[Task]) -> list[Task]:
    """Tasks of single effects but for those whose glance is that of one before, which keeps more of the model's own."""
    first: dict[Candidate, Task] = {}
    kept = []
    for task in tasks:
        one = task if task.base.added else first.setdefault(task.candidate, task)
        if one is task or abs(_cost(one) - _cost(task)) > _SAME_GLANCE * _cost(one):
            kept.append(task)
    return kept


def forlorn(task: Task, refined: Sequence[Explanation]) -> bool:
    """Whether each refinement leaves so much that all of them together leave more than what it is held against."""
    return min((form.fit.fitted.cost for form in refined), default=0.0) > _FORLORN * task.rival


def _least(task: Task) -> float:
    """The cost of its best form."""
    return min((form.fit.fitted.cost for form in forms_of(task)), default=np.inf)


def _least_full(tasks: Sequence[Task]) -> float:
    """The least cost of a name that leaves nothing but noise; infinite without one."""
    forms = (form for task in tasks for form in forms_of(task))
    return min((form.fit.fitted.cost for form in forms if form.inside and form.fit.full), default=np.inf)


def _cost(task: Task) -> float:
    return np.inf if task.seen is None else task.seen.fit.fitted.cost


def best_of(tasks: Sequence[Task], most: int) -> tuple[list[Task], list[Task]]:
    """The `most` tasks of least cost in their order, and the others.

    Further forms and those apart take no one's place; a single effect's apart brings the plain one along, which may be
    all that is to be named, and the foremost single effect what it is most easily taken for.
    """
    order = sorted(range(len(tasks)), key=lambda i: (_cost(tasks[i]), i))
    plain = np.cumsum([tasks[i].candidate.plain for i in order])
    chosen = {i for i, before in zip(order, plain, strict=True) if before <= most}
    apart = {_place(tasks[i]) for i in chosen if tasks[i].candidate.apart and not tasks[i].base.added}
    chosen |= {i for i in order if _place(tasks[i]) in apart}
    foremost = [tasks[i].candidate.name for i in order[:1] if not tasks[i].base.added]
    chosen |= {i for i in order if {*foremost, tasks[i].candidate.name} in CONFUSED}
    return [t for i, t in enumerate(tasks) if i in chosen], [t for i, t in enumerate(tasks) if i not in chosen]


def _place(task: Task) -> tuple[object, ...]:
    """What a form apart shares with its plain one; single effects' bases differ in how many effects they keep."""
    return len(task.base.fit.path.effects), task.candidate.name, task.candidate.at
