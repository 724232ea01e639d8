"""Work shared with other processes: the same results in the same order, errors and all."""

import math
import os
import subprocess
import sys

import pytest

from dt_station_nodes.workers import Workers

PLACE = "sum(range(200_000)) and __import__('os').getpid()"


@pytest.mark.parametrize("jobs", [1, 2, 3])
def test_results_come_in_the_order_of_the_tasks(jobs: int) -> None:
    tasks = [(7 * n) % 101 + 1 for n in range(200)]
    with Workers(jobs) as workers:
        for _ in range(3):
            assert list(workers.results(math.factorial, tasks)) == [math.factorial(n) for n in tasks]


@pytest.mark.parametrize("tasks", [[], [5]])
def test_few_tasks_are_done_here(tasks: list[int]) -> None:
    with Workers(2) as workers:
        assert list(workers.results(math.factorial, tasks)) == [math.factorial(n) for n in tasks]


def test_helpers_work_once_they_have_started_with_what_they_were_told_to_import() -> None:
    at_hand = f"({PLACE}, 'tabnanny' in __import__('sys').modules)"
    with Workers(2) as workers:
        workers.start("tabnanny")
        places = [next(workers.results(eval, [at_hand] * 2))]
        while len(set(places)) < 2:
            places += workers.results(eval, [at_hand] * 50)
    assert places[0] == (os.getpid(), False)
    assert sorted(known for _, known in set(places)) == [False, True]


def test_ctrl_c_is_for_the_process_that_asks_also_where_it_never_had_a_helper_before() -> None:
    script = f"""
from dt_station_nodes.workers import Workers
deaf = "({PLACE}, 2 in __import__('signal').pthread_sigmask(0, []))"
with Workers(2) as workers:
    workers.start()
    seen = set()
    while len(seen) < 2:
        seen |= set(workers.results(eval, [deaf] * 50))
    print(*sorted(known for _, known in seen), *eval(deaf)[1:])
"""
    told = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert told.stdout.split() == ["False", "True", "False"]


def test_one_worker_starts_no_other() -> None:
    with Workers(1) as workers:
        workers.start("tabnanny")
        assert set(workers.results(eval, [PLACE] * 9)) == {os.getpid()}


@pytest.mark.parametrize("jobs", [1, 2])
def test_an_error_is_the_callers(jobs: int) -> None:
    with Workers(jobs) as workers, pytest.raises(ValueError, match="factorial"):
        list(workers.results(math.factorial, [*range(40), -1, *range(40)]))
