"""Where a candidate's fits begin."""

import numpy as np

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.discovery.candidates import Candidate, plain_starts
from dt_station_nodes.discovery.glance import starts_of
from dt_station_nodes.discovery.hypothesis_fit import Costs
from dt_station_nodes.discovery.problem import make_problem
from dt_station_nodes.discovery.selection import Bench, fit_null
from dt_station_nodes.discovery.settings import DiscoverySettings
from dt_station_nodes.discovery.tasks import Task
from dt_station_nodes.discovery.terms import nominal_terms

from .valves import BARE, SPEC, WAVES, answered


def test_of_all_stairs_that_a_spool_may_be_on_few_are_begun_from() -> None:
    given = 2.0 + 1.2 * WAVES[0]
    late = given - 0.2 * np.sign(np.gradient(given))
    problem = make_problem(answered(given, late, 0), SPEC, Channel.PRESSURE, DiscoverySettings())
    bench = Bench(problem, nominal_terms(BARE, problem.signal))
    task = Task(fit_null(bench, BARE), Candidate("friction", apart=True))
    every = plain_starts(problem, task.base.fit.path, task.candidate, task.base.fit.residual, fine=True)
    known: Costs = {}
    starts, near, _ = starts_of(bench, task, known)
    assert len(every) > 1000
    assert 0 < len(starts) <= 60
    assert len(near) <= 60
    assert len(known) >= len(every)
