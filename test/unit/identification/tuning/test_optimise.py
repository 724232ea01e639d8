"""The optimiser beats the published settings on the same nonlinear loop, within its bounds; so do the shipped ones."""

from functools import cache

import numpy as np
import pytest

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.identification import tuning
from support.controllers import controller, paper_model

MODEL = paper_model()
OTHER = {Channel.PRESSURE: "position_pid", Channel.POSITION: "pressure_pi"}


@cache
def experiment(channel: Channel) -> tuning.Experiment:
    return tuning.usual_experiment(MODEL, channel, controller(OTHER[channel]))


@cache
def trial(name: str) -> tuning.Trial:
    channel = Channel.PRESSURE if name.startswith("pressure") else Channel.POSITION
    config = controller(name)
    return experiment(channel).trial(config, tuning.error_scale(config))


def optimised(name: str, evaluations: int) -> tuning.Tuning:
    channel = Channel.PRESSURE if name.startswith("pressure") else Channel.POSITION
    config = controller(name)
    return tuning.optimise(
        config, experiment(channel), tuning.usual_goal(channel), tuning.error_scale(config), evaluations,
        frozen=frozenset({"integral_gain"}),
    )  # fmt: skip


@pytest.mark.parametrize("found", [lambda: trial("pressure_pi_tuned"), lambda: optimised("pressure_pi_zn", 150).after])
def test_our_pi_is_at_least_as_good_as_the_published_one_with_margins(found) -> None:
    ours, published = found(), trial("pressure_pi")
    assert ours.step.ise <= published.step.ise
    assert ours.step.settling_s <= published.step.settling_s
    assert ours.step.overshoot_percent <= 0.5
    assert ours.stability.stable
    assert ours.stability.gain_margin >= 2.0
    assert ours.stability.phase_margin_deg >= 45.0


@pytest.mark.parametrize("found", [lambda: trial("position_pid_tuned"), lambda: optimised("position_pid", 200).after])
def test_tuned_pid_beats_the_published_index_and_is_stable(found) -> None:
    ours, published = found(), trial("position_pid")
    assert ours.hold_index < published.hold_index
    assert ours.step.overshoot_percent < published.step.overshoot_percent
    assert ours.stability.stable
    assert ours.stability.phase_margin_deg >= published.stability.phase_margin_deg


def test_tuned_fuzzy_beats_the_published_index_too() -> None:
    ours, published = trial("position_fuzzy_tuned"), trial("position_pid")
    assert ours.hold_index < published.hold_index
    assert ours.stability.stable
    assert ours.stability.phase_margin_deg >= published.stability.phase_margin_deg
    assert ours.stability.gain_margin >= 2.0


def test_optimised_fuzzy_improves_on_its_start_within_the_bounds() -> None:
    found = optimised("position_fuzzy", 160)
    assert found.after.hold_index < found.before.hold_index
    assert not found.crossed
    assert found.after.config.fuzzy.integral_gain == 0.0


def test_it_is_deterministic_and_counts() -> None:
    first, second = (optimised("pressure_pi", 60) for _ in range(2))
    assert first == second
    assert first.evaluations <= 64


def test_a_bound_that_cannot_be_met_is_told() -> None:
    config = controller("pressure_pi")
    goal = tuning.Goal(phase_margin_deg=170.0, gain_margin=50.0)
    found = tuning.optimise(config, experiment(Channel.PRESSURE), goal, 1e-6, 60)
    assert any("phase margin" in text for text in found.crossed)


def test_manual_mode_has_nothing_to_turn() -> None:
    config = controller("pressure_pi").changed(mode="manual")
    with pytest.raises(tuning.TuningError, match="no settings to optimise"):
        tuning.optimise(config, experiment(Channel.PRESSURE))


def test_figures_of_a_first_order_step_are_the_textbook_ones() -> None:
    t = 0.001 * np.arange(20000)
    figures = tuning.step_figures(1.0, 3.0, 3.0 - 2.0 * np.exp(-t), np.linspace(0.0, 5.0, t.size), 0.001)
    assert figures.settling_s == pytest.approx(np.log(50.0), abs=0.002)
    assert figures.overshoot_percent == 0.0
    assert figures.ise == pytest.approx(2.0, rel=1e-2)
    assert figures.itae == pytest.approx(2.0, rel=1e-2)
    assert (figures.peak_v, figures.travel_v) == pytest.approx((5.0, 5.0))


def test_overshoot_is_of_the_step_either_way_and_never_settling_is_none() -> None:
    up = tuning.step_figures(0.0, 2.0, np.array([0.0, 2.2, 2.0, 2.0]), np.zeros(4), 1.0)
    down = tuning.step_figures(2.0, 0.0, np.array([2.0, -0.2, 0.0, 0.0]), np.zeros(4), 1.0)
    assert up.overshoot_percent == pytest.approx(10.0)
    assert down.overshoot_percent == pytest.approx(10.0)
    assert up.settling_s == 2.0
    assert tuning.step_figures(0.0, 1.0, np.zeros(4), np.zeros(4), 1.0).settling_s is None


def test_the_index_is_a_plain_sum_of_squares() -> None:
    assert tuning.error_index(np.array([1.0, 2.0]), np.array([0.0, 4.0])) == 5.0
