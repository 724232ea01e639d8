"""Work shared with other processes: results in the tasks' order, whatever the number of workers.

Threads would wait for each other: a simulation is short, and much of what surrounds it holds the interpreter. This
process works too, alone until its helpers have started, so that a short search does not wait for them. Little is
imported here, so that helpers can start while this process still imports what it is going to do.
"""

import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future
from importlib import import_module
from multiprocessing import resource_tracker
from typing import TypeVar

try:
    from joblib.externals.loky import ProcessPoolExecutor
except ImportError:  # distributions that take the parts of joblib apart
    from loky import ProcessPoolExecutor

T = TypeVar("T")
R = TypeVar("R")

# Tasks that a helper has before it, at most: it must not wait while this process is at work.
_AHEAD = 6


def _ready(modules: tuple[str, ...]) -> int:
    """Have these modules and the compiled models at hand."""
    from ..core.models.warm import warm

    for module in modules:
        import_module(module)
    return warm()


class Workers:
    """The process that asks and its helpers, which start when told, or with the first work; the context ends them."""

    def __init__(self, jobs: int = 1) -> None:
        self._helpers = jobs - 1
        self._executor: ProcessPoolExecutor | None = None
        self._begun: list[Future[int]] = []

    def __enter__(self) -> "Workers":
        return self

    def __exit__(self, *_: object) -> None:
        if self._executor is not None:
            self._executor.shutdown(wait=True, kill_workers=True)
            self._executor, self._begun = None, []

    def start(self, *modules: str) -> None:
        """Let helpers start, with these modules imported: there will be work for them."""
        if self._helpers > 0:
            self._started(modules)

    def results(self, work: Callable[[T], R], tasks: Sequence[T]) -> Iterator[R]:
        """What `work` (a function of a module, or a partial one) makes of each task, in their order."""
        if self._helpers < 1 or len(tasks) < 2:
            yield from map(work, tasks)
            return
        executor = self._started()
        given: dict[int, Future[R]] = {}
        known: dict[int, R] = {}
        first = following = 0
        while first < len(tasks):
            while self._have_room(sum(not future.done() for future in given.values()), len(tasks) - following):
                given[following] = executor.submit(work, tasks[following])
                following += 1
            if following < len(tasks):
                known[following] = work(tasks[following])
                following += 1
            while first in known or (first in given and (given[first].done() or following == len(tasks))):
                yield known.pop(first) if first in known else given.pop(first).result()
                first += 1

    def _started(self, modules: tuple[str, ...] = ()) -> ProcessPoolExecutor:
        if self._executor is None:
            self._executor = ProcessPoolExecutor(self._helpers)
            # Ctrl-C is for the process that asks: to helpers it is blocked from their first moment on. Starting the
            # tracker that they need unblocks it, so that comes first.
            resource_tracker.ensure_running()
            before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
            try:
                self._begun = [self._executor.submit(_ready, modules) for _ in range(self._helpers)]
            finally:
                signal.pthread_sigmask(signal.SIG_SETMASK, before)
        return self._executor

    def _have_room(self, given: int, left: int) -> bool:
        """Whether the helpers shall be given a task more, of so many left."""
        started = sum(future.done() for future in self._begun)
        # In the end no helper shall have a row of tasks before it while the others have none.
        ahead = max(1, min(_AHEAD, left // (2 * self._helpers + 2)))
        return left > 1 and given < ahead * started


ALONE = Workers()
