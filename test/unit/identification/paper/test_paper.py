"""The comparison with the paper: what must be reproduced is, and nothing is claimed without a reason."""

from functools import cache

import pytest

from dt_station_nodes.hardware import open_backend
from dt_station_nodes.identification import paper
from dt_station_nodes.identification.paper.row import judged_same, judged_small
from support.controllers import CONFIG, controller, paper_model


def rig():
    device = open_backend("virtual", {"sample_time_s": 0.02, "rig": str(CONFIG / "rigs" / "paper.yaml"), "seed": 1})
    device.open()
    return device


def bench() -> paper.Bench:
    return paper.Bench(paper_model(), {name: controller(name) for name in paper.CONTROLLERS}, rig)


@cache
def compared() -> dict[str, paper.Row]:
    return {row.what: row for row in paper.rows(paper.run_all(bench()))}


def rows(start: str) -> list[paper.Row]:
    found = [row for what, row in compared().items() if what.startswith(start)]
    assert found
    return found


@pytest.mark.parametrize(
    "start",
    [
        "Table 1",
        "pressure path (1): DC gain, model",
        "position path (5): K, model",
        "position path (5): T, model",
        "disturbance path (6): kick, model",
        "disturbance path (6): drift, model",
        "published PID: slow unstable pole",
        "PI optimised settles, simulation (2 %)",
        "simulation: index, fuzzy over PID",
    ],
)
def test_what_follows_from_the_printed_numbers_is_reproduced(start) -> None:
    assert {row.status for row in rows(start)} == {paper.Status.REPRODUCED}


@pytest.mark.parametrize("start", ["our optimised PI", "tuned PID", "tuned fuzzy"])
def test_our_tunings_are_better(start) -> None:
    assert {row.status for row in rows(start)} == {paper.Status.BETTER}


def test_every_row_gives_a_reason_and_a_unit() -> None:
    for row in compared().values():
        assert row.why
        assert row.unit
        assert row.ours is not None


def test_what_the_paper_does_not_print_is_not_compared() -> None:
    for row in compared().values():
        if row.paper is None:
            assert row.status is paper.Status.NOT_COMPARABLE


def test_absolute_indices_are_not_compared_without_amplitude_and_unit() -> None:
    for row in rows("index (8)"):
        assert row.status is paper.Status.NOT_COMPARABLE
        assert "amplitude" in row.why


def test_the_hold_experiment_is_four_whole_cycles_of_eight_hundred_samples() -> None:
    held = paper.hold(bench(), bench().fresh_model(), "position_pid")
    load = held.run.signals["pressure_setpoint_pa"][200:1000]
    assert len(held.run) == 1200
    assert (load == 4.5e6).sum() == (load == 1.5e6).sum() == 400
    error = 1000.0 * (held.run.signals["position_setpoint_m"] - held.run.signals["position_m"])[200:1000]
    assert held.index == pytest.approx((error**2).sum(), rel=1e-9)


def test_the_rig_is_deterministic() -> None:
    first, second = (paper.hold(bench(), rig(), "position_fuzzy").index for _ in range(2))
    assert first == second


def test_judgements() -> None:
    assert judged_small(1.0, 0.5, 0.1) is paper.Status.BETTER
    assert judged_small(1.0, 1.05, 0.1) is paper.Status.REPRODUCED
    assert judged_small(1.0, 1.5, 0.1) is paper.Status.WORSE
    assert judged_same(1.0, 1.5, 0.1) is paper.Status.NOT_COMPARABLE
