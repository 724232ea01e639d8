"""Work shared with other processes: the same results in the same order, errors and all."""

import math
import os

import pytest

from dt_station_nodes.workers import Workers

PLACE = "sum(range(200_000)) and __import__('os').getpid()"
MANY = 4000


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
        places = list(workers.results(eval, [at_hand] * MANY))
    assert places[0] == (os.getpid(), False)
    assert sorted(known for _, known in set(places)) == [False, True]


def test_one_worker_starts_no_other() -> None:
    with Workers(1) as workers:
        workers.start("tabnanny")
        assert set(workers.results(eval, [PLACE] * 9)) == {os.getpid()}


@pytest.mark.parametrize("jobs", [1, 2])
def test_an_error_is_the_callers(jobs: int) -> None:
    with Workers(jobs) as workers, pytest.raises(ValueError, match="factorial"):
        list(workers.results(math.factorial, [*range(40), -1, *range(40)]))
