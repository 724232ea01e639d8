"""A run that no fit has seen: what carries over to it and what does not."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))

from cases import Case, make

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import ModelSpec
from dt_station_nodes.core.run import Run
from dt_station_nodes.discovery.problem import Problem, make_problem
from dt_station_nodes.discovery.settings import DiscoverySettings
from dt_station_nodes.discovery.unseen import shows_only, unseen_residual

MODEL = Path(__file__).parents[3] / "config" / "models" / "paper.yaml"
PAPER = ModelSpec.from_yaml(MODEL.read_text(encoding="utf-8"))
HERTZ, METRES = 3.1, 2e-3


def problem(phase_rad: float) -> Problem:
    run = make(Case(shape="sine", seed=8, seconds=24.0, noise_db=50.0))
    time_s = np.arange(len(run)) * run.sample_time_s
    moved = run.signals["position_m"] + METRES * np.sin(2.0 * np.pi * HERTZ * time_s + phase_rad)
    return make_problem(
        Run(run.sample_time_s, {**run.signals, "position_m": moved}), PAPER, Channel.POSITION, DiscoverySettings()
    )


@pytest.mark.parametrize("phase_rad", [0.3, 1.9, 3.4, 5.5])
def test_a_disturbance_is_foretold_but_for_its_phase(phase_rad: float) -> None:
    model = PAPER.with_effect(
        Channel.POSITION, "periodic_disturbance", {"amplitude": METRES, "frequency_hz": HERTZ, "phase_rad": 0.3}
    )
    path = model.paths[Channel.POSITION]
    check = problem(phase_rad)
    alone = float(np.std(check.residual(PAPER.paths[Channel.POSITION])))
    assert float(np.std(unseen_residual(check, path))) < 0.2 * alone
    if abs(phase_rad - 0.3) > 1.0:
        assert float(np.std(check.residual(path))) > 0.9 * alone


def test_any_other_path_is_taken_as_it_is() -> None:
    check, path = problem(1.0), PAPER.paths[Channel.POSITION]
    assert np.array_equal(unseen_residual(check, path), check.residual(path))


@pytest.mark.parametrize(("here", "there", "only"), [(0.5, 4.0, True), (4.0, 4.0, False), (0.5, 1.0, False)])
def test_without_noise_a_trace_of_form_error_is_no_gap(here: float, there: float, only: bool) -> None:
    """Gaps in multiples of what no one would call one; the noise is a thousandth of that."""
    run, other = (
        make_problem(
            make(Case(shape=shape, seconds=24.0, noise_db=120.0)), PAPER, Channel.POSITION, DiscoverySettings()
        )
        for shape in ("sine", "triangle")
    )
    shape = np.where(np.arange(len(run.measured)) % 8 < 4, 1.0, -1.0)
    gap, unseen = here * run.negligible * shape, there * other.negligible * shape
    assert shows_only(run, other, unseen, gap, 1e-3 * run.negligible) is only
    assert not shows_only(run, other, None, gap, 1e-3 * run.negligible)
