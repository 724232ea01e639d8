"""Names that no run tells apart."""

from pathlib import Path
from types import SimpleNamespace
from typing import cast

import pytest

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import EffectSpec, ModelSpec
from dt_station_nodes.core.models.effects import Attachment, Quantity
from dt_station_nodes.discovery.choice import with_namesakes
from dt_station_nodes.discovery.namesakes import namesakes
from dt_station_nodes.discovery.problem import Problem
from dt_station_nodes.discovery.selection import Explanation

PAPER = ModelSpec.from_yaml((Path(__file__).parents[3] / "config" / "models" / "paper.yaml").read_text("utf-8"))


SCALES = {Quantity.INPUT_PEAK: 4.0}


def others(channel: Channel, loop: dict[str, float], *beside: str) -> tuple[tuple[str, ...], ...]:
    path = PAPER.with_effect(channel, "hysteresis", {"half_width_v": 0.1, **loop}).paths[channel]
    return namesakes(path, (*beside, "hysteresis"), channel, SCALES)


def play(at: Attachment, channel: Channel = Channel.PRESSURE, **form: float) -> tuple[tuple[str, ...], ...]:
    effect = EffectSpec(name="backlash", at=at, parameters={"half_width": 0.1, **form})
    path = PAPER.paths[channel].model_copy(update={"effects": (effect,)})
    return namesakes(path, ("backlash",), channel, SCALES)


def test_what_stands_for_one_of_the_names_stands_for_all() -> None:
    """A loop too round to be a play operator, where a play explains as much: that may be a spool's friction."""

    def explained(name: str, at: Attachment, **numbers: float) -> Explanation:
        spec = EffectSpec(name=name, at=at, parameters=numbers)
        path = PAPER.paths[Channel.PRESSURE].model_copy(update={"effects": (spec,)})
        return cast("Explanation", SimpleNamespace(added=(name,), fit=SimpleNamespace(path=path)))

    problem = cast("Problem", SimpleNamespace(channel=Channel.PRESSURE, scales=SCALES))
    loop = explained("hysteresis", Attachment.INPUT, half_width_v=0.1, bend_per_v=0.2)
    play_there = explained("backlash", Attachment.INPUT, half_width=0.1)
    assert with_namesakes(loop, ((),), [], problem) == ((),)
    assert with_namesakes(loop, (("backlash",),), [play_there], problem) == (("backlash", "friction"),)


def test_so_may_play_on_the_voltage_and_one_that_gives_a_spool_with_mass() -> None:
    assert play(Attachment.INPUT) == (("hysteresis", "friction"),)
    assert play(Attachment.INPUT, lag_s=0.02) == (("friction",),)
    assert play(Attachment.INPUT, coast_s=0.02) == (("friction",),)
    assert play(Attachment.OUTPUT) == ((),)


@pytest.mark.parametrize(("left", "also"), [(0.3, ()), (0.7, ("leakage",))])
def test_a_relief_valve_that_leaves_most_of_what_comes_on_top_may_be_a_seal(left: float, also: tuple[str, ...]) -> None:
    """Inside the path what it leaves is what a static leak of the same slope would."""
    path = PAPER.paths[Channel.PRESSURE]
    lag_s = path.denominator[-2] / path.denominator[-1]
    for numbers, at in (({"override": left}, Attachment.OUTPUT), ({"weir_s": lag_s * left / (1.0 - left)}, None)):
        valve = EffectSpec(name="overflow", at=at, parameters={"limit": 2e6, **numbers})
        with_valve = path.model_copy(update={"effects": (valve,)})
        assert namesakes(with_valve, ("overflow",), Channel.PRESSURE, SCALES) == (also,)
        assert namesakes(with_valve, ("overflow", "leakage"), Channel.PRESSURE, SCALES) == ((), ())


def test_play_on_a_cylinders_valve_and_a_loop_with_corners_are_one() -> None:
    assert play(Attachment.INPUT, Channel.POSITION) == (("hysteresis",),)
    assert play(Attachment.INPUT, Channel.POSITION, spread=0.2) == (("hysteresis",),)
    assert play(Attachment.INPUT, Channel.POSITION, lag_s=0.02) == ((),)
    assert play(Attachment.OUTPUT, Channel.POSITION) == ((),)
    assert others(Channel.POSITION, {}) == (("backlash",),)
    assert others(Channel.POSITION, {"bouc_wen": 1.0}) == ((),)


def test_a_sharp_loop_of_a_pressure_valve_may_be_its_spools_friction_or_its_linkages_play() -> None:
    assert others(Channel.PRESSURE, {}) == (("friction", "backlash"),)
    assert others(Channel.PRESSURE, {"depth": 0.7}) == (("friction", "backlash"),)
    assert others(Channel.PRESSURE, {"depth": 1.03}, "bias") == ((), ("friction", "backlash"))
    assert others(Channel.PRESSURE, {"bouc_wen": 0.2, "sharpness": 6.0, "way_back": 1.0}) == (("friction", "backlash"),)
    assert others(Channel.PRESSURE, {}, "friction") == ((), ())


@pytest.mark.parametrize(("swing_s", "also"), [(0.0, ()), (0.004, ("backlash",))])
def test_a_spool_with_mass_that_is_held_may_be_a_load_that_coasts_in_its_gap(
    swing_s: float, also: tuple[str, ...]
) -> None:
    spool = {"coulomb_v": 0.1, "slip": 0.5, "swing_s": swing_s}
    path = PAPER.with_effect(Channel.PRESSURE, "friction", spool).paths[Channel.PRESSURE]
    assert namesakes(path, ("friction",), Channel.PRESSURE, SCALES) == (also,)
    assert namesakes(path, ("friction", "backlash"), Channel.PRESSURE, SCALES)[0] == ()


@pytest.mark.parametrize(
    ("channel", "also"), [(Channel.PRESSURE, ("backlash", "friction")), (Channel.POSITION, ("backlash",))]
)
def test_several_plays_that_the_whole_voltage_goes_through_may_be_a_linkages_joints(
    channel: Channel, also: tuple[str, ...]
) -> None:
    assert others(channel, {"spread": 0.9}) == (also,)
    assert others(channel, {"spread": 0.9, "depth": 0.5}) == ((),)
    assert others(channel, {"spread": 0.9, "bouc_wen": 1.0}) == ((),)


@pytest.mark.parametrize("form", [{"bouc_wen": 1.0}, {"depth": 0.5}, {"bend_per_v": 0.4}])
def test_a_smooth_loop_or_a_part_of_one_is_magnetisation(form: dict[str, float]) -> None:
    assert others(Channel.PRESSURE, form) == ((),)


@pytest.mark.parametrize(("at", "also"), [(Attachment.OUTPUT, ("saturation",)), (None, ())])
def test_what_stops_a_positions_reading_and_not_the_piston_may_be_its_sensors_range(
    at: Attachment | None, also: tuple[str, ...]
) -> None:
    effect = EffectSpec(name="overflow", at=at, parameters={"limit": 0.05})
    path = PAPER.paths[Channel.POSITION].model_copy(update={"effects": (effect,)})
    assert namesakes(path, ("overflow",), Channel.POSITION, SCALES) == (also,)


@pytest.mark.parametrize(
    ("form", "also"),
    [
        ({"upper_v": 8.0, "knee": 0.6}, ("cubic_stiffness",)),
        ({"upper_v": 4.5, "knee": 0.6}, ()),
        ({"upper_v": 8.0, "knee": 0.1}, ()),
        ({"upper_v": 2.4, "straight": 0.0, "passing": 0.3, "centre_v": -0.6}, ("cubic_stiffness",)),
        ({"upper_v": 2.4, "straight": 0.0}, ()),
        ({"upper_v": 2.4, "passing": 0.3}, ()),
    ],
)
@pytest.mark.parametrize("channel", Channel)
def test_a_curve_that_bends_softly_and_meets_no_limit_may_be_a_spring(
    channel: Channel, form: dict[str, float], also: tuple[str, ...]
) -> None:
    path = PAPER.with_effect(channel, "saturation", {"lower_v": -1e9, **form}).paths[channel]
    assert namesakes(path, ("saturation",), channel, SCALES) == (also,)
    assert namesakes(path, ("saturation", "cubic_stiffness"), channel, SCALES)[0] == ()


@pytest.mark.parametrize(
    ("channel", "form", "also"),
    [
        (Channel.PRESSURE, {"unequal": -0.5}, ("asymmetric_gain",)),
        (Channel.PRESSURE, {"closing": 0.4}, ("asymmetric_gain",)),
        (Channel.PRESSURE, {"unequal": 0.1}, ()),
        (Channel.POSITION, {"unequal": -0.5}, ()),
    ],
)
def test_a_pressure_that_lags_more_one_way_fills_quicker_than_it_vents(
    channel: Channel, form: dict[str, float], also: tuple[str, ...]
) -> None:
    path = PAPER.with_effect(channel, "extra_lag", {"time_constant_s": 0.05, **form}).paths[channel]
    assert namesakes(path, ("extra_lag",), channel, SCALES) == (also,)


@pytest.mark.parametrize(
    ("channel", "asymmetry", "centre_v", "found"),
    [
        (Channel.PRESSURE, -0.1, 2.0, ("overflow",)),
        (Channel.PRESSURE, 0.1, 2.0, ()),
        (Channel.PRESSURE, -0.1, 0.5, ()),
        (Channel.POSITION, -0.1, 2.0, ()),
    ],
)
def test_a_pressure_that_answers_less_from_a_voltage_on_may_have_a_relief_valve(
    channel: Channel, asymmetry: float, centre_v: float, found: tuple[str, ...]
) -> None:
    curve = {"asymmetry": asymmetry, "centre_v": centre_v}
    path = PAPER.with_effect(channel, "asymmetric_gain", curve).paths[channel]
    assert namesakes(path, ("asymmetric_gain",), channel, SCALES) == (found,)
    both = (*path.effects, EffectSpec(name="overflow", parameters={"limit": 3e6}))
    beside = path.model_copy(update={"effects": both})
    assert namesakes(beside, ("asymmetric_gain", "overflow"), channel, SCALES)[0] == ()


@pytest.mark.parametrize(("base", "also"), [(0.0, ()), (1.0, ()), (2.5, ("overflow",))])
def test_a_leak_past_a_piston_that_begins_well_above_rest_may_be_a_relief_valve(
    base: float, also: tuple[str, ...]
) -> None:
    leak = EffectSpec(name="leakage", parameters={"coefficient": 1e-9, "base": base, "opens": 1.0})
    for channel, expected in ((Channel.POSITION, also), (Channel.PRESSURE, ())):
        path = PAPER.paths[channel].model_copy(update={"effects": (leak,)})
        assert namesakes(path, ("leakage",), channel, SCALES) == (expected,)
    path = PAPER.paths[Channel.POSITION].model_copy(update={"effects": (leak,)})
    assert namesakes(path, ("overflow", "leakage"), Channel.POSITION, SCALES) == ((), ())
