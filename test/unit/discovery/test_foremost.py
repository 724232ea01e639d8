"""Which explanations are worth a closer look."""

import sys
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from cases import Case, make

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import ModelSpec
from dt_station_nodes.discovery import DiscoverySettings
from dt_station_nodes.discovery.foremost import foremost
from dt_station_nodes.discovery.measure import take_measure
from dt_station_nodes.discovery.problem import make_problem
from dt_station_nodes.discovery.selection import Bench, Explanation, fit_null
from dt_station_nodes.discovery.terms import nominal_terms

MODEL = Path(__file__).parents[3] / "config" / "models" / "paper.yaml"
PAPER = ModelSpec.from_yaml(MODEL.read_text(encoding="utf-8"))
NAMED = ("bias", "delay", "friction", "leakage", "hysteresis", "saturation", "extra_lag", "dead_zone", "rate_limit")
RIVALS = ("memory", "fatigue", "thixotropy", "trapped_air")


def test_forms_that_are_never_named_take_no_place_of_those_that_could_be() -> None:
    problem = make_problem(make(Case((), "sine", seed=3, seconds=12.0)), PAPER, Channel.POSITION, DiscoverySettings())
    path = PAPER.paths[Channel.POSITION]
    bench = Bench(problem, nominal_terms(path, problem.signal))
    null = fit_null(bench, path)

    def worth(name: str, times: float) -> Explanation:
        return replace(null, added=(name,), powers=tuple(times * power for power in null.powers))

    # Each rival does a little better than all that could be named but the first, and these lie close together.
    named = [worth(name, 1.0 + 1e-4 * index) for index, name in enumerate(NAMED)]
    rivals = [worth(name, 1.00005) for name in RIVALS]
    far = worth("overflow", 1e3)
    near = foremost([far, *rivals, *named, null], take_measure(bench, [null]))
    assert [e.added[0] for e in near if e.inside] == list(NAMED[:8])
    assert {e.added[0] for e in near if not e.inside} == set(RIVALS)
    assert near == sorted(near, key=lambda e: e.powers)
