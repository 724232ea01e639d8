"""What speaks against forms before any run does: a leak uphill, a loop with corners, a rare place."""

from pathlib import Path

import pytest

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import ModelSpec
from dt_station_nodes.core.models.effects import Attachment
from dt_station_nodes.discovery.candidates import Candidate, add_effect
from dt_station_nodes.discovery.odds import LATE, SHARP_LOOP, UNUSUAL, UNUSUAL_FORMS, UPHILL, against, creeps_uphill

MODEL = Path(__file__).parents[3] / "config" / "models" / "paper.yaml"
PATHS = ModelSpec.from_yaml(MODEL.read_text(encoding="utf-8")).paths
POSITION = PATHS[Channel.POSITION]


def odds(channel: Channel, name: str, at: Attachment | None = None, **parameters: float) -> float:
    bare = PATHS[channel].model_copy(update={"effects": ()})
    return against(add_effect(bare, Candidate(name, at), parameters), channel)


@pytest.mark.parametrize(("coefficient", "uphill"), [(1e-10, False), (-1e-10, True)])
def test_a_leak_that_pushes_a_piston_against_its_load_is_rarer(coefficient: float, uphill: bool) -> None:
    assert odds(Channel.POSITION, "leakage", coefficient=coefficient) == (UPHILL if uphill else 0.0)
    path = add_effect(POSITION, Candidate("leakage"), {"coefficient": coefficient})
    assert creeps_uphill(path) is uphill
    # The other way round where the load pulls.
    assert POSITION.disturbance is not None
    pulled = POSITION.disturbance.model_copy(update={"numerator": tuple(-n for n in POSITION.disturbance.numerator)})
    assert creeps_uphill(path.model_copy(update={"disturbance": pulled})) is not uphill


def test_a_leak_that_slows_the_motion_or_has_no_load_goes_no_way() -> None:
    slows = {"coefficient": -1e-10, "against": 1.0}
    assert not creeps_uphill(add_effect(POSITION, Candidate("leakage"), slows))
    alone = POSITION.model_copy(update={"disturbance": None})
    assert not creeps_uphill(add_effect(alone, Candidate("leakage"), {"coefficient": -1e-10}))


def test_a_leak_that_takes_its_time_to_move_a_piston_is_rarer() -> None:
    position, pressure = (
        odds(c, "leakage", coefficient=1e-10, lag_s=0.5) for c in (Channel.POSITION, Channel.PRESSURE)
    )
    assert position == LATE
    assert pressure == odds(Channel.PRESSURE, "leakage", coefficient=1e-10)


def test_a_place_counts_before_the_channel() -> None:
    assert odds(Channel.PRESSURE, "delay", delay_s=0.03) == 0.0
    assert odds(Channel.PRESSURE, "delay", Attachment.OUTPUT, delay_s=0.03) == UNUSUAL["delay", "output"]
    assert odds(Channel.PRESSURE, "load_dependent_gain", per_load=1e-8) == UNUSUAL["load_dependent_gain", "pressure"]
    assert odds(Channel.POSITION, "load_dependent_gain", per_load=1e-8) == 0.0


def test_a_leak_behind_the_pressure_is_as_rare_as_a_spring_there_and_rarer_than_one_past_the_valve() -> None:
    behind = odds(Channel.PRESSURE, "leakage", Attachment.OUTPUT, coefficient=0.1, widening=1e-7)
    assert behind == odds(Channel.PRESSURE, "cubic_stiffness", Attachment.OUTPUT, coefficient=1e-20)
    assert behind > odds(Channel.PRESSURE, "leakage", coefficient=0.1, widening=1e-7)


def test_a_loop_with_corners_is_rarer_than_a_round_one() -> None:
    assert odds(Channel.POSITION, "hysteresis", half_width_v=0.2) == SHARP_LOOP
    assert odds(Channel.POSITION, "hysteresis", half_width_v=0.2, spread=0.5) == 0.0


def test_a_line_that_throws_back_what_passes_is_rarer_than_one_that_does_not() -> None:
    thrown, plain = (odds(Channel.POSITION, "delay", delay_s=0.03, echo=share) for share in (0.4, 0.0))
    assert thrown - plain == UNUSUAL_FORMS["delay", "echo"] > 0.0
    assert odds(Channel.POSITION, "extra_lag", time_constant_s=0.03, second_s=0.02) == plain


def test_cross_talk_that_fades_is_rarer_than_one_that_stays() -> None:
    stays, fades = (odds(Channel.PRESSURE, "cross_coupling", share=0.1, lag_s=0.5, changes=c) for c in (0.0, 0.1))
    assert fades - stays == UNUSUAL_FORMS["cross_coupling", "changes"] > 0.0
