"""Noise, windows, the fitter and the data checks on their own."""

import numpy as np
import pytest

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.run import Run
from dt_station_nodes.discovery.data_checks import check_run, frozen_samples
from dt_station_nodes.discovery.fit import least_squares
from dt_station_nodes.discovery.noise import difference_noise, effective_samples, quantisation_step, whiteness
from dt_station_nodes.discovery.windows import make_windows

RNG = np.random.default_rng(5)


def test_noise_is_seen_through_smooth_movement_and_jumps():
    time = np.arange(3000) * 0.02
    signal = np.sin(time) + (time > 20) * 3.0 - (time > 40) * 2.0
    assert difference_noise(signal + 0.01 * RNG.standard_normal(3000)) == pytest.approx(0.01, rel=0.1)


def test_quantisation_step_is_found():
    assert quantisation_step(np.round(np.sin(np.arange(2000) * 0.01) / 0.05) * 0.05) == pytest.approx(0.05)
    assert quantisation_step(RNG.standard_normal(1000)) == 0.0


def test_white_residuals_count_fully_and_slow_ones_less():
    white = RNG.standard_normal(4000)
    slow = np.convolve(white, np.ones(50) / 50, "same")
    assert effective_samples(white) > 3500
    assert effective_samples(slow) < 400
    assert whiteness(white) < 2.5
    assert whiteness(slow) > 50


def test_anchored_windows_take_out_drift_only():
    windows = make_windows(1000, 0.02, 2.0, True)
    assert np.abs(windows.project(np.full(1000, 3.0))).max() < 1e-12
    once = windows.project(RNG.standard_normal(1000))
    assert np.allclose(windows.project(once), once)
    assert windows.freedoms == 10
    free = make_windows(1000, 0.02, 2.0, False)
    assert free.freedoms == 0
    assert np.array_equal(free.project(once), once)


def test_the_fitter_finds_a_minimum_and_keeps_to_bounds():
    time = np.linspace(0, 3, 200)
    target = 2.0 * np.exp(-1.5 * time)

    def residual(x):
        return x[0] * np.exp(-x[1] * time) - target

    free = least_squares(residual, np.array([1.0, 0.5]), np.zeros(2), np.full(2, 10.0), np.full(2, 1e-5), 40, 1e-12)
    assert np.allclose(free.x, [2.0, 1.5], atol=1e-4)
    kept = least_squares(residual, np.array([1.0, 0.5]), np.zeros(2), np.array([1.8, 10.0]), np.full(2, 1e-5), 40)
    assert kept.x[0] == pytest.approx(1.8)


def test_covariance_holds_the_scatter_of_estimates():
    x = np.linspace(-1, 1, 400)
    slopes, variances = [], []
    for _ in range(100):
        y = 0.7 * x + 0.1 * RNG.standard_normal(400)
        fit = least_squares(
            lambda p, y=y: p[0] * x - y, np.zeros(1), np.full(1, -9.0), np.full(1, 9.0), np.full(1, 1e-4)
        )
        slopes.append(fit.x[0])
        variances.append(fit.covariance(400, 400)[0, 0])
    assert np.std(slopes) == pytest.approx(np.mean(variances) ** 0.5, rel=0.25)


def test_frozen_stretches_are_found_in_noisy_signals_only():
    voltage = np.cos(np.arange(1000) * 0.05)
    signal = np.sin(np.arange(1000) * 0.05) + 0.01 * RNG.standard_normal(1000)
    assert not frozen_samples(signal, voltage).any()
    signal[300:340] = signal[300]
    assert frozen_samples(signal, voltage).sum() == 39
    assert not frozen_samples(signal, np.ones(1000)).any()
    assert not frozen_samples(np.round(signal, 0), voltage).any()


def test_an_object_that_stands_is_no_frozen_sensor():
    voltage = np.sin(np.arange(1000) * 0.02)
    standing = np.cumsum(np.where(np.abs(voltage) > 0.6, voltage - 0.6 * np.sign(voltage), 0.0))
    assert not frozen_samples(standing, voltage).any()
    assert not frozen_samples(np.round(standing, 1), voltage).any()
    frozen = 30.0 * np.cos(np.arange(1000) * 0.02)
    frozen[330:380] = frozen[330]
    assert frozen_samples(frozen, voltage).sum() == 49


def test_a_still_voltage_is_said():
    run = Run(0.02, {"load_voltage_v": np.zeros(300), "pressure_pa": RNG.standard_normal(300)})
    (check,) = check_run(run)
    assert check.channel is Channel.PRESSURE
    assert not check.excited
    assert "does not move" in check.notes[0]
