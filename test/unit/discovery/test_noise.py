"""What is noise, what is movement as quick as the samples, and what a sensor counts."""

import numpy as np
import pytest

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import ModelSpec, PathSpec
from dt_station_nodes.core.run import Run
from dt_station_nodes.discovery import Verdict, discover
from dt_station_nodes.discovery.data_checks import frozen_samples
from dt_station_nodes.discovery.noise import difference_noise, driven_noise, quantisation_step

STEP = 2.0 * np.pi / 4000.0


def printed(values: np.ndarray, digits: int = 6) -> np.ndarray:
    return np.array([float(f"{value:.{digits}g}") for value in values])


@pytest.mark.parametrize("swing", [0.3, 12.0])
def test_counts_are_seen_in_a_file_that_prints_a_few_digits_of_them(swing: float) -> None:
    counts = np.round(swing * np.sin(0.013 * np.arange(3000)) / STEP) * STEP
    assert quantisation_step(printed(counts)) == pytest.approx(STEP, rel=0.02)


@pytest.mark.parametrize("digits", [10, 16])
def test_what_moves_smoothly_is_no_count(digits: int) -> None:
    assert quantisation_step(printed(12.0 * np.sin(0.013 * np.arange(3000)), digits)) < 1e-6


def test_a_motor_that_stands_on_a_count_is_no_frozen_sensor() -> None:
    time = np.arange(3000) * 0.01
    voltage = 4.0 * np.sin(1.6 * time)
    speed = np.where(np.abs(voltage) > 1.1, voltage - 1.1 * np.sign(voltage), 0.0)
    noisy = np.cumsum(speed) * 0.14 + 2e-4 * np.random.default_rng(3).standard_normal(3000)
    assert not frozen_samples(printed(np.round(noisy / STEP) * STEP), voltage).any()


def test_noise_above_the_steps_of_a_sensor_that_stops_is_a_frozen_one() -> None:
    time = np.arange(3000) * 0.01
    noisy = np.sin(1.6 * time) + 0.02 * np.random.default_rng(4).standard_normal(3000)
    counts = np.round(noisy / 0.002) * 0.002
    counts[1000:1020] = counts[1000]
    assert frozen_samples(counts, np.cos(1.6 * time)).sum() == 19


def test_movement_as_quick_as_its_samples_is_no_noise() -> None:
    rng = np.random.default_rng(5)
    voltage = rng.uniform(-6.0, 6.0, 1000)
    moved = np.where(np.abs(voltage) > 2.0, voltage - 2.0 * np.sign(voltage), 0.0)
    measured = np.concatenate([[0.0], moved[:-1]]) + 0.02 * rng.standard_normal(1000)
    assert difference_noise(measured) > 0.5 * np.std(measured)
    assert driven_noise(measured, voltage) < 0.2 * np.std(measured)


def test_what_a_loop_answers_to_its_noise_foretells_no_noise() -> None:
    noise = np.random.default_rng(11).standard_normal(2000)
    measured = np.sin(0.01 * np.arange(2000)) + noise
    assert driven_noise(measured, -3.0 * measured) > 0.9


def test_of_what_moves_slowly_the_noise_is_that_of_its_differences() -> None:
    voltage = np.sin(0.01 * np.arange(2000))
    measured = voltage + 0.01 * np.random.default_rng(6).standard_normal(2000)
    assert driven_noise(measured, voltage) == difference_noise(measured)


def test_a_model_that_misses_half_of_quick_movement_is_not_said_to_lack_nothing() -> None:
    rng = np.random.default_rng(7)
    voltage = rng.uniform(-6.0, 6.0, 600)
    free = np.where(np.abs(voltage) > 2.0, voltage - 2.0 * np.sign(voltage), 0.0)
    measured = np.concatenate([[0.0], free[:-1]]) + 0.02 * rng.standard_normal(600)
    run = Run(0.2, {"servo_voltage_v": voltage, "position_m": measured}, source="quick")
    lag = PathSpec(numerator=(20.0,), denominator=(1.0, 20.0))
    found = discover(run, ModelSpec(name="quick", paths={Channel.POSITION: lag}))
    assert found.verdict is Verdict.NAMED
    assert [e.name for e in found.effects] == ["dead_zone"]
    assert found.effects[0].parameters["half_width_v"].value == pytest.approx(2.0, abs=0.05)


def test_of_a_run_that_does_not_move_nothing_is_concluded() -> None:
    rng = np.random.default_rng(8)
    run = Run(
        0.02, {"servo_voltage_v": rng.standard_normal(600), "position_m": rng.standard_normal(600)}, source="held"
    )
    lag = PathSpec(numerator=(20.0,), denominator=(1.0, 20.0))
    found = discover(run, ModelSpec(name="held", paths={Channel.POSITION: lag}))
    assert found.verdict is Verdict.UNEXPLAINED
    assert "Nothing can be concluded" in found.sentence
    assert found.data_notes


@pytest.mark.parametrize("period", [6, 8, 13])
def test_a_fast_sawtooth_on_a_signal_is_no_noise(period: int) -> None:
    count = np.arange(1500)
    sawtooth = count % period / period
    noise = 0.01 * np.random.default_rng(period).standard_normal(1500)
    signal = np.sin(0.02 * count) + 0.5 * sawtooth + noise
    assert difference_noise(signal) == pytest.approx(0.01, rel=1.5)
    assert difference_noise(np.sin(0.02 * count) + noise) == pytest.approx(0.01, rel=0.1)
