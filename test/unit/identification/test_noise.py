import numpy as np
import pytest
from scipy.signal import lfilter

from dt_station_nodes.identification.noise import autocorrelation, independence, noise_colour, whiteness


def white(seed, samples=2000):
    return np.random.default_rng(seed).normal(size=samples)


def test_white_noise_gives_the_textbook_covariance():
    jacobian = np.column_stack([np.ones(2000), np.linspace(-1.0, 1.0, 2000)])
    noise = noise_colour(white(0), 2)
    textbook = noise.innovation_std**2 * np.linalg.inv(jacobian.T @ jacobian)
    assert noise.order == 0
    assert noise.covariance(jacobian) == pytest.approx(textbook)
    assert noise.effective_samples == pytest.approx(2000.0)


def test_coloured_noise_widens_the_interval_of_a_mean_as_theory_says():
    means, claimed = [], []
    for seed in range(60):
        coloured = lfilter([1.0], [1.0, -0.8], white(seed, 3000))[1000:]
        means.append(coloured.mean())
        noise = noise_colour(coloured - coloured.mean(), 1)
        claimed.append(float(noise.covariance(np.ones((2000, 1)))[0, 0]))
    assert np.mean(claimed) == pytest.approx(np.var(means), rel=0.4)
    assert np.mean(claimed) == pytest.approx(1.0 / 0.2**2 / 2000, rel=0.2)


def test_whiteness_passes_white_and_fails_coloured_noise():
    assert sum(whiteness(white(seed)).passed for seed in range(40)) >= 37
    assert not whiteness(lfilter([1.0], [1.0, -0.3], white(1))).passed


def test_independence_sees_an_input_left_in_the_residual():
    signal = white(100)
    noise = noise_colour(white(2), 0)
    assert sum(independence(white(s), signal, noise_colour(white(s), 0), "x").passed for s in range(20)) >= 18
    assert not independence(white(2) + 0.2 * np.roll(signal, 3), signal, noise, "x").passed


def test_autocorrelation_begins_with_the_variance():
    signal = white(3)
    assert autocorrelation(signal, 5)[0] == pytest.approx(signal.var())
    assert autocorrelation(np.zeros(20), 3).tolist() == [0.0] * 4


def test_a_direction_without_information_gets_a_huge_variance():
    column = white(4)
    covariance = noise_colour(white(5), 2).covariance(np.column_stack([column, column]))
    assert np.all(np.diag(covariance) > 1e6 * covariance.sum())
