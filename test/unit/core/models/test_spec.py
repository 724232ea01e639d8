"""The model file: round trip, and one sentence for each mistake."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import ModelError, ModelSpec, PathSpec

PAPER = (Path(__file__).parents[4] / "config" / "models" / "paper.yaml").read_text()
FIRST_ORDER = "name: x\npaths:\n  pressure:\n    numerator: [1]\n    denominator: [1, 2]\n"


def test_paper_round_trip():
    spec = ModelSpec.from_yaml(PAPER)
    assert ModelSpec.from_yaml(spec.to_yaml()) == spec


@given(
    st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=3),
    st.lists(st.floats(-1e6, 1e6), min_size=2, max_size=4),
    st.floats(0.1, 10),
)
def test_any_path_round_trip(numerator, tail, time_scale):
    path = PathSpec(numerator=numerator, denominator=[1.0, *tail], time_scale=time_scale)
    spec = ModelSpec(name="any", paths={Channel.POSITION: path})
    assert ModelSpec.from_yaml(spec.to_yaml()) == spec


def test_numbers_without_a_dot_are_numbers():
    spec = ModelSpec.from_yaml(FIRST_ORDER + "    scale: 1e6\n    rest: 1e6\n")
    assert spec.paths[Channel.PRESSURE].scale == 1e6


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("name: [", "line 1"),
        ("- a", "mapping"),
        ("name: x", "paths"),
        (FIRST_ORDER.replace("[1]", "[1, 2, 3]"), "improper"),
        (FIRST_ORDER.replace("[1, 2]", "[0, 2]"), "must not be 0"),
        (FIRST_ORDER.replace("pressure", "presure"), "presure"),
        (FIRST_ORDER + "    rst: 3\n", "rst"),
        (FIRST_ORDER + "    effects: [{name: ghost}]\n", "no effect is called ghost"),
        (FIRST_ORDER + "    effects: [{name: quadratic_damping, parameters: {coefficient: 1}}]\n", "does not act"),
        (FIRST_ORDER + "    effects: [{name: dead_zone, parameters: {width: 1}}]\n", "half_width_v"),
        (FIRST_ORDER + "    effects: [{name: dead_zone, parameters: {half_width_v: .nan}}]\n", "finite"),
        (FIRST_ORDER + "    disturbance: {numerator: [1], denominator: [1, 1]}\n", "only the position path"),
    ],
)
def test_a_mistake_gets_one_sentence(text, says):
    with pytest.raises(ModelError) as caught:
        ModelSpec.from_yaml(text, "model.yaml")
    assert says in str(caught.value)
    assert "model.yaml" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_an_effect_replaces_its_namesake_in_place():
    spec = ModelSpec.from_yaml(PAPER)
    changed = spec.with_effect(Channel.PRESSURE, "dead_zone", {"half_width_v": 0.3})
    assert [e.name for e in changed.paths[Channel.PRESSURE].effects] == ["dead_zone", "saturation"]
    assert changed.paths[Channel.PRESSURE].effects[0].parameters == {"half_width_v": 0.3}
    assert spec.without_effect(Channel.PRESSURE, "dead_zone") == changed.without_effect(Channel.PRESSURE, "dead_zone")


def test_a_path_gives_its_effect_by_name_or_says_what_it_has():
    path = ModelSpec.from_yaml(PAPER).with_effect(Channel.POSITION, "bias", {"bias_v": 0.1}).paths[Channel.POSITION]
    assert path.effect("bias").parameters["bias_v"] == 0.1
    with pytest.raises(ModelError, match="no friction; it has .*bias"):
        path.effect("friction")
