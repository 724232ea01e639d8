"""A form outside the vocabulary that explains as much makes a name doubtful; one that holds the name must do more."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from dt_station_nodes.core.models import EffectSpec, PathSpec
from dt_station_nodes.core.models.effects import registry
from dt_station_nodes.discovery.selection import Explanation
from dt_station_nodes.discovery.strangers import beside, mimic, other_dynamics, stranger


def spec(name: str, parameters: dict[str, float]) -> EffectSpec:
    """An effect with its numbers, those it needs at 1 where none are given."""
    effect = registry()[name]
    needed = {p.name: 1.0 for p in effect.parameters if not p.optional}
    return EffectSpec.model_construct(name=name, at=None, parameters=effect.complete({**needed, **parameters}))


def named(*names: str, **parameters: float) -> Explanation:
    """An explanation of which only its names count, and parameters of the last of them."""
    effects = tuple(spec(name, parameters if name == names[-1] else {}) for name in names)
    fit = SimpleNamespace(path=PathSpec.model_construct(effects=effects), hypothesis=SimpleNamespace(terms=()))
    return Explanation(cast(Any, fit), names, {}, (1.0,))


LIMIT = named("saturation")
LAG = named("extra_lag")


def ahead(best: Explanation, behind: float, other: Explanation, trifling: bool = False, rough: bool = False) -> str:
    return stranger(best, [(behind, other), (0.0, best)], trifling, rough)


@pytest.mark.parametrize(("behind", "name"), [(-50.0, "memory"), (1.5, "memory"), (6.5, "")])
def test_a_stranger_that_ties_makes_a_name_doubtful(behind: float, name: str) -> None:
    assert ahead(LIMIT, behind, named("memory")) == name


@pytest.mark.parametrize(("behind", "name"), [(1.5, ""), (-5.0, ""), (-7.0, "trapped_air")])
def test_one_that_holds_the_name_as_a_special_case_has_to_explain_more(behind: float, name: str) -> None:
    assert ahead(LAG, behind, named("trapped_air")) == name


@pytest.mark.parametrize(("numbers", "name"), [({}, ""), ({"second_s": 0.01, "straight": 0.3}, "trapped_air")])
def test_what_needs_more_numbers_than_the_form_that_holds_it_is_no_special_case(
    numbers: dict[str, float], name: str
) -> None:
    free = {"extra_lag": ("time_constant_s", "second_s", "straight")}
    lag = replace(named("extra_lag", time_constant_s=0.05, **numbers), freed=free)
    air = replace(named("trapped_air", stiffening=0.1), freed={"trapped_air": ("softness_s", "stiffening")})
    assert ahead(lag, -20.0, air, trifling=True) == name


@pytest.mark.parametrize(
    ("saturation", "behind", "name"), [(0.0, -20.0, ""), (0.7, -20.0, "trapped_air"), (0.7, -5.0, "")]
)
def test_a_coil_that_saturates_is_no_special_case_of_oil_with_air_in_it(
    saturation: float, behind: float, name: str
) -> None:
    free = {"extra_lag": ("time_constant_s", "saturation")}
    coil = replace(named("extra_lag", time_constant_s=0.05, saturation=saturation), freed=free)
    numbers = ("softness_s", "stiffening", "power")
    air = replace(named("trapped_air", stiffening=0.1, power=2.0), freed={"trapped_air": numbers})
    assert ahead(coil, behind, air, trifling=True) == name


@pytest.mark.parametrize(("behind", "lag_s", "name"), [(4.5, 0.0, ""), (-4.0, 0.0, "cross_coupling"), (-4.0, 0.05, "")])
def test_cross_talk_that_does_not_lag_holds_no_leak(behind: float, lag_s: float, name: str) -> None:
    assert ahead(named("leakage"), behind, named("cross_coupling", share=-0.06, lag_s=lag_s), trifling=True) == name


@pytest.mark.parametrize(("behind", "name"), [(2.0, "cross_coupling"), (-2.0, ""), (6.5, "")])
def test_one_that_ties_and_could_be_told_apart_is_a_mimic(behind: float, name: str) -> None:
    leak, talk = named("leakage"), named("cross_coupling", share=-0.02, lag_s=0.0)
    assert mimic(leak, [(0.0, leak), (behind, talk)]) == name


def test_one_that_can_only_be_the_name_or_has_more_names_is_no_mimic() -> None:
    assert not mimic(LAG, [(0.0, LAG), (1.0, named("trapped_air"))])
    assert not mimic(named("leakage"), [(1.0, named("cross_coupling", share=-0.02, lag_s=0.05))])
    assert not mimic(LIMIT, [(1.0, named("saturation", "memory")), (1.0, named("rate_limit"))])


@pytest.mark.parametrize(("lag_s", "name"), [(0.01, ""), (0.0, "trapped_air")])
def test_one_that_could_be_a_name_that_does_as_well_is_no_stranger_to_the_other(lag_s: float, name: str) -> None:
    """A delay and a lag tie: soft air, itself a lag, does not make them doubtful; one of no length is no name."""
    delay, lag, air = named("delay"), named("extra_lag", time_constant_s=lag_s), named("trapped_air", stiffening=0.1)
    assert stranger(delay, [(0.0, delay), (0.1, lag), (4.5, air)], trifling=False, rough=False) == name
    assert stranger(delay, [(0.0, delay), (6.5, lag), (4.5, air)], trifling=False, rough=False) == "trapped_air"


@pytest.mark.parametrize("mends", [True, False])
def test_a_set_with_a_stranger_stands_beside_the_name_it_holds_where_it_mends_all(mends: bool) -> None:
    leak, gap = named("leakage"), named("dead_zone", "saturation")
    talk, larger = named("leakage", "cross_coupling"), named("leakage", "bias")
    scored = [(-400.0, talk), (-350.0, larger), (0.0, leak), (10.0, gap)]
    found = [one for _, one in beside(leak, scored, lambda _: mends)]
    assert found == ([talk, gap] if mends else [gap])


def test_it_has_to_explain_much_more_where_next_to_nothing_is_left() -> None:
    assert not ahead(LAG, -30.0, named("trapped_air"), trifling=True)
    assert ahead(LAG, -41.0, named("trapped_air"), trifling=True) == "trapped_air"


def test_it_holds_a_set_where_it_stands_for_the_name_that_is_missing() -> None:
    both = named("dead_zone", "extra_lag")
    assert not ahead(both, -1.0, named("dead_zone", "trapped_air"))
    assert ahead(both, -1.0, named("backlash", "trapped_air")) == "trapped_air"


def test_on_rough_data_any_stranger_has_to_explain_more() -> None:
    assert not ahead(LIMIT, -5.0, named("memory"), rough=True)
    assert ahead(LIMIT, -7.0, named("memory"), rough=True) == "memory"


def test_larger_sets_and_names_are_no_strangers() -> None:
    assert not ahead(LIMIT, -99.0, named("memory", "delay"))
    assert not ahead(LIMIT, -99.0, named("delay"))


VOLTS = np.random.default_rng(9).standard_normal(800)
AFTER = np.convolve(VOLTS, [0.0, 1.0, -0.6, 0.2])[:800]
HISS = 0.05 * np.random.default_rng(10).standard_normal(800)


@pytest.mark.parametrize(
    ("added", "left", "name"),
    [
        (("delay", "resonance"), AFTER + HISS, "linear dynamics of another order"),
        (("delay", "resonance"), AFTER**2 + HISS, ""),
        (("delay", "resonance"), 0.05 * AFTER + HISS, ""),
        (("delay", "saturation"), AFTER + HISS, ""),
    ],
)
def test_linear_names_that_leave_a_linear_answer_are_dynamics_of_another_order(
    added: tuple[str, ...], left: np.ndarray, name: str
) -> None:
    problem = SimpleNamespace(rough=False, sigma=0.05, simulator=SimpleNamespace(voltage_v=VOLTS))
    best = Explanation(cast(Any, SimpleNamespace(residual=left)), added, {}, (1.0,))
    assert other_dynamics(cast(Any, problem), best, 0.05**2) == name
