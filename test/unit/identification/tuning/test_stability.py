"""Margins against python-control, and the published PID's slow pole by name."""

import math

import control
import numpy as np
import pytest

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.identification import tuning
from support.controllers import controller, paper_model

SAMPLE_TIME_S = 0.02
MODEL = paper_model()


def judged(name: str) -> tuning.Stability:
    channel = Channel.PRESSURE if name.startswith("pressure") else Channel.POSITION
    return tuning.stability(MODEL, channel, controller(name), SAMPLE_TIME_S)


def test_the_published_pid_s_slow_unstable_pole_is_reported_by_name() -> None:
    found = judged("position_pid")
    assert not found.stable
    assert [f"{pole.magnitude:.6f}" for pole in found.slow_poles] == ["1.000013"]
    assert found.slow_poles[0].e_folding_s == pytest.approx(25 * 60, rel=0.05)
    [finding] = found.findings
    assert "slow unstable pole |z| = 1.000013" in finding
    assert "negative integral gain I = -0.0047" in finding


@pytest.mark.parametrize("name", ["pressure_pi", "pressure_pi_zn", "pressure_pi_tuned", "position_pid_tuned"])
def test_the_others_are_stable(name) -> None:
    found = judged(name)
    assert found.stable
    assert not found.slow_poles
    assert max(map(abs, found.poles)) < 1.0


@pytest.mark.parametrize("name", ["pressure_pi", "pressure_pi_zn", "position_pid", "position_pid_tuned"])
def test_margins_are_python_control_s(name) -> None:
    found = judged(name)
    channel = Channel.PRESSURE if name.startswith("pressure") else Channel.POSITION
    loop = tuning.open_loop(MODEL, channel, controller(name), SAMPLE_TIME_S)
    omega = np.geomspace(1e-2, math.pi / SAMPLE_TIME_S * (1 - 1e-9), 5000)
    gain, phase, _, _, crossover, _ = control.stability_margins(control.frd(loop, omega))
    assert found.gain_margin == pytest.approx(gain, rel=1e-2)
    assert found.phase_margin_deg == pytest.approx(phase, abs=0.2)
    assert found.crossover_rad_s == pytest.approx(crossover, rel=1e-2)


@pytest.mark.parametrize("name", ["pressure_pi", "position_pid_tuned", "pressure_pi_tuned"])
def test_the_gain_margin_is_where_poles_leave_the_circle(name) -> None:
    found = judged(name)
    channel = Channel.PRESSURE if name.startswith("pressure") else Channel.POSITION
    loop = tuning.open_loop(MODEL, channel, controller(name), SAMPLE_TIME_S)
    for factor, stable in ((0.99, True), (1.01, False)):
        poles = control.feedback(loop * (found.gain_margin * factor), 1).poles()
        assert bool(max(abs(poles)) < 1.0) is stable


def test_one_sample_of_delay_breaks_a_loop_whose_delay_margin_is_less() -> None:
    # That is why commands act at once on the station.
    found = judged("position_pid")
    assert found.delay_margin_s < SAMPLE_TIME_S
    loop = tuning.open_loop(MODEL, Channel.POSITION, controller("position_pid"), SAMPLE_TIME_S)
    late = control.feedback(loop * control.tf([1], [1, 0], SAMPLE_TIME_S), 1)
    assert max(abs(late.poles())) > 1.01


def test_a_fast_instability_is_told_with_its_growth() -> None:
    wild = controller("position_pid").changed(pid={"p": 40.0, "error_scale": 100.0})
    found = tuning.stability(MODEL, Channel.POSITION, wild, SAMPLE_TIME_S)
    assert not found.stable
    assert "outside the unit circle" in found.findings[0]


def test_fuzzy_is_judged_at_its_steepest_and_says_so() -> None:
    found = judged("position_fuzzy")
    assert found.stable
    assert "judged at its steepest" in found.findings[0]
    gentle = controller("position_fuzzy").changed(
        fuzzy=controller("position_fuzzy").fuzzy.model_copy(update={"output_gain": 0.5})
    )
    softer = tuning.stability(MODEL, Channel.POSITION, gentle, SAMPLE_TIME_S)
    assert softer.gain_margin == pytest.approx(2.0 * found.gain_margin, rel=1e-2)


def test_a_model_without_the_path_is_refused() -> None:
    only = MODEL.model_copy(update={"paths": {Channel.PRESSURE: MODEL.paths[Channel.PRESSURE]}})
    with pytest.raises(tuning.TuningError, match="no position path"):
        tuning.stability(only, Channel.POSITION, controller("position_pid"), SAMPLE_TIME_S)
