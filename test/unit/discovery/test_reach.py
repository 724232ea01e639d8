"""Voltages that an output which integrates can bear in open loop."""

from pathlib import Path

import numpy as np
import pytest

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import ModelSpec, PlantModel
from dt_station_nodes.core.run import Run
from dt_station_nodes.core.waveforms import Shape, Waveform, waveform_samples
from dt_station_nodes.discovery.problem import Problem, make_problem
from dt_station_nodes.discovery.reach import simulated, within_reach
from dt_station_nodes.discovery.settings import DiscoverySettings

PAPER = ModelSpec.from_yaml(
    (Path(__file__).parents[3] / "config" / "models" / "paper.yaml").read_text(encoding="utf-8")
)
STEP_S = 0.02
SAMPLES = 1200


def problem_of(channel: Channel, servo: np.ndarray) -> Problem:
    """A run of the nominal object under a servo voltage (n,)."""
    load = 1.5 + 0.8 * np.sin(2.0 * np.pi * 0.25 * STEP_S * np.arange(servo.size))
    out = PlantModel(PAPER, STEP_S).simulate(load, servo)
    signals = {"pressure_pa": out.pressure_pa, "position_m": out.position_m}
    run = Run(STEP_S, {"load_voltage_v": load, "servo_voltage_v": servo, **signals})
    return make_problem(run, PAPER, channel, DiscoverySettings())


SERVO = waveform_samples(Waveform(Shape.SINE, 1.0, 0.0, 0.5), STEP_S, SAMPLES)
LARGE = Waveform(Shape.SQUARE, 2.0, 0.0, 0.1)


@pytest.mark.parametrize(
    ("effect", "numbers"),
    [("bias", {"bias_v": 0.4}), ("asymmetric_gain", {"asymmetry": 0.2}), ("dead_zone", {"half_width_v": 0.2})],
)
def test_a_piston_neither_drifts_nor_leaves_where_it_was_seen(effect: str, numbers: dict[str, float]) -> None:
    problem = problem_of(Channel.POSITION, SERVO)
    path = PAPER.with_effect(Channel.POSITION, effect, numbers).paths[Channel.POSITION]
    reached = within_reach(problem, path, LARGE, SAMPLES)
    _, moved = simulated(problem, path, waveform_samples(reached, STEP_S, SAMPLES))
    assert (reached.shape, reached.frequency_hz) == (LARGE.shape, LARGE.frequency_hz)
    seen = float(np.ptp(problem.measured))
    assert abs(np.polyfit(np.arange(SAMPLES), moved, 1)[0]) * SAMPLES < 0.5 * seen
    assert np.ptp(moved) < 2.0 * seen


def test_the_voltage_is_balanced_against_a_null_that_is_off() -> None:
    path = PAPER.with_effect(Channel.POSITION, "bias", {"bias_v": 0.4}).paths[Channel.POSITION]
    reached = within_reach(problem_of(Channel.POSITION, SERVO), path, LARGE, SAMPLES)
    assert reached.offset == pytest.approx(-0.4, abs=0.01)


def test_a_piston_that_sags_back_to_its_rest_needs_no_balance() -> None:
    numbers = {"coefficient": 0.0, "sag_per_s": 1.0}
    path = PAPER.with_effect(Channel.POSITION, "leakage", numbers).paths[Channel.POSITION]
    alone = path.model_copy(update={"disturbance": None})
    small = Waveform(Shape.SQUARE, 0.2, 0.0, 0.4)
    assert within_reach(problem_of(Channel.POSITION, SERVO), alone, small, SAMPLES).offset == 0.0


@pytest.mark.parametrize("frequency_hz", [0.1, 0.4, 1.5])
@pytest.mark.parametrize(
    ("effect", "numbers"), [("leakage", {"coefficient": 0.0, "sag_per_s": 2.0}), ("bias", {"bias_v": 3.0})]
)
def test_no_voltage_is_asked_for_that_the_run_did_not_see(
    effect: str, numbers: dict[str, float], frequency_hz: float
) -> None:
    path = PAPER.with_effect(Channel.POSITION, effect, numbers).paths[Channel.POSITION]
    asked = Waveform(Shape.TRIANGLE, 0.25, 0.0, frequency_hz)
    reached = within_reach(problem_of(Channel.POSITION, SERVO), path, asked, SAMPLES)
    assert abs(reached.offset) + reached.amplitude <= np.abs(SERVO).max()


def test_what_comes_to_rest_by_itself_is_driven_as_asked() -> None:
    problem = problem_of(Channel.PRESSURE, SERVO)
    assert within_reach(problem, PAPER.paths[Channel.PRESSURE], LARGE, SAMPLES) == LARGE
