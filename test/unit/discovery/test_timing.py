"""What a run itself shows of when things happen: fitted from there, it is named where it used to have no word."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))

from cases import Case, make

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import ModelSpec, PlantModel
from dt_station_nodes.core.run import Run
from dt_station_nodes.discovery import Verdict, discover
from dt_station_nodes.discovery.problem import Problem, make_problem
from dt_station_nodes.discovery.settings import DiscoverySettings
from dt_station_nodes.discovery.timing import begun, seen_timing
from dt_station_nodes.discovery.unseen import unseen_residual

MODEL = Path(__file__).parents[3] / "config" / "models" / "paper.yaml"
PAPER = ModelSpec.from_yaml(MODEL.read_text(encoding="utf-8"))
SINE = {"amplitude": 1.2e5, "frequency_hz": 3.1, "phase_rad": 0.3}
BURSTS = {"burst_period_s": 6.5, "burst_share": 0.45, "burst_start_s": 1.2}
SECOND_HZ = 4.4
SWELL_HZ = 0.27
PUSH_HZ = 1.37
DELAY_S, WANDER, WANDER_HZ = 0.06, 0.4, 0.21
SHIFT_V, FALL, SHIFT_LAG_S = 0.2, -0.3, 0.3


def noisy(signals: dict[str, np.ndarray], run: Run, seed: int) -> Run:
    rng = np.random.default_rng(seed)
    for name in ("pressure_pa", "position_m"):
        signals[name] = signals[name] + 0.01 * np.std(signals[name]) * rng.standard_normal(len(run))
    return Run(run.sample_time_s, {**run.signals, **signals})


def shaken(
    start_s: float | None,
    phase_rad: float = 0.3,
    seed: int = 8,
    second: float = 0.0,
    swell: float = 0.0,
    second_hz: float = SECOND_HZ,
) -> Run:
    """A run whose pressure a neighbour shakes, in bursts from `start_s` on or swelling, and a second one by a share."""
    plain = make(Case(shape="triangle", seed=seed, seconds=24.0, noise_db=300.0))
    time_s = plain.sample_time_s * np.arange(len(plain))
    wave = SINE["amplitude"] * np.sin(2.0 * np.pi * SINE["frequency_hz"] * time_s + phase_rad)
    wave = wave * (1.0 + swell * np.sin(2.0 * np.pi * SWELL_HZ * time_s - phase_rad))
    if start_s is not None:
        wave = wave * (((time_s - start_s) / BURSTS["burst_period_s"]) % 1.0 < BURSTS["burst_share"])
    other = second * SINE["amplitude"] * np.sin(2.0 * np.pi * second_hz * time_s + 5.0 * phase_rad)
    pressure_pa = plain.signals["pressure_pa"] + wave + other
    return noisy({"pressure_pa": pressure_pa, "position_m": plain.signals["position_m"]}, plain, seed)


def late(wander: float, phase_rad: float = 0.8, seed: int = 8) -> Run:
    """A run whose servo voltage comes late, by a time that swings."""
    plain = make(Case(shape="triangle", seed=seed, seconds=24.0, noise_db=300.0, closed=False))
    time_s = plain.sample_time_s * np.arange(len(plain))
    given = plain.signals["servo_voltage_v"]
    swing = 1.0 + wander * np.sin(2.0 * np.pi * WANDER_HZ * time_s + phase_rad)
    arrived = np.interp(time_s - DELAY_S * swing, time_s, given)
    out = PlantModel(PAPER, plain.sample_time_s).simulate(plain.signals["load_voltage_v"], arrived)
    return noisy({"pressure_pa": out.pressure_pa, "position_m": out.position_m}, plain, seed)


def pushed(phase_rad: float, seed: int, push_v: float = 0.1) -> Run:
    """A run whose servo valve a pump's pulses push one way: most of what is seen is a drift."""
    plain = make(Case(shape="square", seed=seed, seconds=24.0, noise_db=300.0, closed=False))
    time_s = plain.sample_time_s * np.arange(len(plain))
    push = push_v * np.maximum(np.sin(2.0 * np.pi * PUSH_HZ * time_s + phase_rad), 0.0)
    at_valve = plain.signals["servo_voltage_v"] - push
    out = PlantModel(PAPER, plain.sample_time_s).simulate(plain.signals["load_voltage_v"], at_valve)
    return noisy({"pressure_pa": out.pressure_pa, "position_m": out.position_m}, plain, seed)


def shifted(comes: str, time_s: float, shape: str = "triangle", seed: int = 8) -> Run:
    """A run in which an offset of the servo voltage comes, or its gain falls, by first order or evenly about a time."""
    plain = make(Case(shape=shape, seed=seed, seconds=24.0, noise_db=300.0, closed=False))
    late_s = plain.sample_time_s * np.arange(len(plain)) - time_s
    by_first_order = 1.0 - np.exp(-np.maximum(late_s, 0.0) / SHIFT_LAG_S)
    share = by_first_order if comes == "bias" else 0.5 + 0.5 * np.tanh(late_s / (2.0 * SHIFT_LAG_S))
    given = plain.signals["servo_voltage_v"]
    at_valve = given + share * (SHIFT_V if comes == "bias" else FALL * given)
    out = PlantModel(PAPER, plain.sample_time_s).simulate(plain.signals["load_voltage_v"], at_valve)
    return noisy({"pressure_pa": out.pressure_pa, "position_m": out.position_m}, plain, seed)


def problem(of: Run, channel: Channel) -> Problem:
    return make_problem(of, PAPER, channel, DiscoverySettings())


def test_a_disturbance_in_bursts_is_named() -> None:
    found = discover(shaken(1.2), PAPER, validation=shaken(4.0, 2.0, seed=9))
    assert found.verdict is Verdict.NAMED
    assert [(e.name, e.channel) for e in found.effects] == [("periodic_disturbance", Channel.PRESSURE)]
    assert found.effects[0].parameters["burst_period_s"].value == pytest.approx(6.5, rel=0.02)


@pytest.mark.parametrize("second_hz", [SECOND_HZ, 2.0 * SINE["frequency_hz"]])
def test_two_tones_are_one_disturbance(second_hz: float) -> None:
    run = shaken(None, second=0.5, second_hz=second_hz)
    found = discover(run, PAPER, validation=shaken(None, 2.0, seed=9, second=0.5, second_hz=second_hz))
    assert [(e.name, e.channel) for e in found.effects] == [("periodic_disturbance", Channel.PRESSURE)]
    numbers = found.effects[0].parameters
    assert numbers["second_hz"].value == pytest.approx(second_hz, rel=2e-3)
    assert numbers["second_share"].value > 0.2
    assert found.gap.after[Channel.PRESSURE].rms < 1.1 * found.gap.noise_floor[Channel.PRESSURE].rms


def test_one_that_swells_and_sinks_is_named() -> None:
    found = discover(shaken(None, swell=0.8), PAPER, validation=shaken(None, 2.0, seed=9, swell=0.8))
    assert [(e.name, e.channel) for e in found.effects] == [("periodic_disturbance", Channel.PRESSURE)]
    assert found.effects[0].parameters["swell_hz"].value == pytest.approx(SWELL_HZ, rel=0.01)
    assert found.effects[0].parameters["swell"].value == pytest.approx(0.8, rel=0.1)


def test_what_pushes_one_way_is_a_disturbance_and_no_bias_beside_it() -> None:
    found = discover(pushed(0.3, 8), PAPER, validation=pushed(2.0, 9))
    assert [(e.name, e.channel) for e in found.effects] == [("periodic_disturbance", Channel.POSITION)]
    numbers = found.effects[0].parameters
    assert numbers["frequency_hz"].value == pytest.approx(PUSH_HZ, rel=2e-3)
    assert numbers["push_share"].value == pytest.approx(-0.5, rel=0.2)
    assert found.gap.after[Channel.POSITION].rms < 1.1 * found.gap.noise_floor[Channel.POSITION].rms


def test_a_delay_that_wanders_is_named() -> None:
    found = discover(late(WANDER), PAPER, validation=late(WANDER, 2.0, seed=9))
    assert found.verdict is Verdict.NAMED
    assert [(e.name, e.channel) for e in found.effects] == [("delay", Channel.POSITION)]
    assert found.effects[0].parameters["wander"].value == pytest.approx(WANDER, rel=0.15)


@pytest.mark.parametrize("other_s", [9.0, 17.0, -5.0, 99.0])
def test_an_offset_that_comes_in_the_run_is_a_bias_whenever_it_comes_in_another(other_s: float) -> None:
    found = discover(shifted("bias", 9.0), PAPER, validation=shifted("bias", other_s, "sine", seed=9))
    assert [(e.name, e.channel) for e in found.effects] == [("bias", Channel.POSITION)]
    numbers = found.effects[0].parameters
    assert numbers["bias_v"].value == pytest.approx(0.0, abs=0.02)
    assert numbers["jump_v"].value == pytest.approx(SHIFT_V, rel=0.05)
    assert numbers["jump_s"].value == pytest.approx(9.0, abs=0.1)
    assert numbers["jump_lag_s"].value == pytest.approx(SHIFT_LAG_S, rel=0.3)
    assert found.gap.after[Channel.POSITION].rms < 1.1 * found.gap.noise_floor[Channel.POSITION].rms


def test_a_gain_that_falls_gradually_is_a_drift() -> None:
    found = discover(shifted("gain", 9.0), PAPER, validation=shifted("gain", 9.0, "sine", seed=9))
    assert [(e.name, e.channel) for e in found.effects] == [("gain_drift", Channel.POSITION)]
    numbers = found.effects[0].parameters
    assert numbers["jump"].value == pytest.approx(FALL, rel=0.05)
    assert numbers["jump_s"].value == pytest.approx(9.0, abs=0.1)
    assert found.gap.after[Channel.POSITION].rms < 1.1 * found.gap.noise_floor[Channel.POSITION].rms


def test_what_goes_on_as_it_is_shows_no_timing() -> None:
    path = PAPER.with_effect(Channel.PRESSURE, "periodic_disturbance", SINE).paths[Channel.PRESSURE]
    assert seen_timing(problem(shaken(None), Channel.PRESSURE), path, "periodic_disturbance") == {}
    assert "burst_period_s" in seen_timing(problem(shaken(1.2), Channel.PRESSURE), path, "periodic_disturbance")
    assert "second_hz" in seen_timing(problem(shaken(None, second=0.3), Channel.PRESSURE), path, "periodic_disturbance")
    assert "swell_hz" in seen_timing(problem(shaken(None, swell=0.5), Channel.PRESSURE), path, "periodic_disturbance")
    path = PAPER.with_effect(Channel.POSITION, "delay", {"delay_s": DELAY_S}).paths[Channel.POSITION]
    assert seen_timing(problem(late(0.0), Channel.POSITION), path, "delay") == {}
    assert seen_timing(problem(late(WANDER), Channel.POSITION), path, "delay")
    path = PAPER.with_effect(Channel.POSITION, "bias", {"bias_v": SHIFT_V}).paths[Channel.POSITION]
    assert seen_timing(problem(shifted("bias", -5.0), Channel.POSITION), path, "bias") == {}
    assert "jump_s" in seen_timing(problem(shifted("bias", 9.0), Channel.POSITION), path, "bias")


def test_when_bursts_begin_is_each_runs_own() -> None:
    model = PAPER.with_effect(Channel.PRESSURE, "periodic_disturbance", {**SINE, **BURSTS})
    path, check = model.paths[Channel.PRESSURE], problem(shaken(4.0), Channel.PRESSURE)
    assert begun(check, path, path.effects[-1]) == pytest.approx(4.0, abs=0.1)
    assert np.std(unseen_residual(check, path)) < 0.4 * np.std(check.residual(path))
