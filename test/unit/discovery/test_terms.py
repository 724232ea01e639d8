"""What a fit may move: which numbers are free, and that they go into a path and come out again."""

from pathlib import Path

import numpy as np
import pytest

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import ModelSpec, PathSpec
from dt_station_nodes.discovery.terms import Hypothesis, nominal_terms, refits_all

MODEL = Path(__file__).parents[3] / "config" / "models" / "paper.yaml"
PAPER = ModelSpec.from_yaml(MODEL.read_text(encoding="utf-8"))
VALVE = PathSpec(numerator=[960.0], denominator=[1.0, 56.0, 1600.0])
AXIS = PathSpec(numerator=[216.0], denominator=[1.0, 42.0, 3600.0, 0.0])


def names(path: PathSpec, whole: bool = False) -> list[str]:
    return [term.name for term in nominal_terms(path, 1.0, whole)]


def test_a_load_path_may_be_off_in_gain_and_time() -> None:
    assert names(PAPER.paths[Channel.POSITION]) == [
        "gain", "time_scale", "disturbance_gain", "disturbance_time_scale",
    ]  # fmt: skip


def test_damping_is_free_where_a_time_scale_cannot_stand_for_it() -> None:
    assert names(PathSpec(numerator=[1.0], denominator=[0.1, 1.0])) == ["gain", "time_scale"]
    assert names(VALVE) == names(AXIS) == ["gain", "time_scale", "denominator_1"]
    assert names(PAPER.paths[Channel.PRESSURE]) == ["gain", "time_scale"]


def test_a_path_that_is_refitted_as_a_whole_keeps_no_gain_of_its_own() -> None:
    assert refits_all(VALVE)
    assert not refits_all(AXIS)
    assert names(VALVE, whole=True) == ["numerator_0", "denominator_1", "denominator_2", "rest"]


@pytest.mark.parametrize("path", [PAPER.paths[Channel.POSITION], VALVE, AXIS])
def test_free_numbers_begin_at_their_centres_and_move_the_path(path: PathSpec) -> None:
    free = Hypothesis(path, nominal_terms(path))
    begin = free.start()
    assert begin == pytest.approx([term.centre for term in free.terms])
    assert free.path_at(begin).denominator == pytest.approx(path.denominator)
    moved = begin + np.linspace(0.1, 0.4, len(begin))
    assert Hypothesis(free.path_at(moved), free.terms).start() == pytest.approx(moved)
