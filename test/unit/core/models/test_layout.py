"""A path's remembered layout: asked for twice it is the same, and no user of it can change it for another."""

from pathlib import Path

import numpy as np

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import ModelSpec, path_map
from dt_station_nodes.core.models.layout import NOTHING
from dt_station_nodes.core.models.prepare import prepare

MODEL = Path(__file__).parents[4] / "config" / "models" / "paper.yaml"
PRESSURE = ModelSpec.from_yaml(MODEL.read_text(encoding="utf-8")).paths[Channel.PRESSURE]


def test_a_path_is_laid_out_the_same_each_time() -> None:
    once = prepare(PRESSURE, Channel.PRESSURE, 0.005, 3)
    once.numbers[:] = np.nan
    again, elsewhere = prepare(PRESSURE, Channel.PRESSURE, 0.005, 3), prepare(PRESSURE, Channel.PRESSURE, 0.005, 40)
    assert np.isfinite(again.numbers).all()
    assert np.array_equal(again.numbers, elsewhere.numbers)
    assert elsewhere.places[path_map.STATE_AT] - again.places[path_map.STATE_AT] == 37


def test_rest_is_the_paths_own() -> None:
    high = PRESSURE.model_copy(update={"rest": 7.0e5})
    assert prepare(PRESSURE, Channel.PRESSURE, 0.005, 3).numbers[path_map.REST_OUTPUT] == PRESSURE.rest
    assert prepare(high, Channel.PRESSURE, 0.005, 3).numbers[path_map.REST_OUTPUT] == 7.0e5


def test_an_absent_path_is_marked_so() -> None:
    absent = prepare(None, Channel.PRESSURE, 0.005, 3)
    absent.numbers[path_map.REST_OUTPUT] = 5.0
    assert absent.places[path_map.PRESENT] == 0
    assert prepare(PRESSURE, Channel.PRESSURE, 0.005, 3).places[path_map.PRESENT] == 1
    assert NOTHING.numbers[path_map.REST_OUTPUT] == 0.0
