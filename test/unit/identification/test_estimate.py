import numpy as np
import pytest
from scipy.signal import lfilter

from dt_station_nodes.identification import (
    Data,
    Hold,
    IdentificationError,
    PathStructure,
    Structure,
    TransferFunction,
    estimate,
    fit_percent,
)
from support.known_systems import (
    DISTURBANCE,
    POSITION,
    PRESSURE,
    SAMPLE_TIME_S,
    disturbance_data,
    noisy,
    pressure_data,
    response,
    switching,
)

CASES = {
    "pressure (1)": (PRESSURE, PathStructure(6, 4), pressure_data, 6000, 2),
    "disturbance (6)": (DISTURBANCE, PathStructure(3, 1, 1, Hold.SMOOTH), disturbance_data, 3000, 2),
}


@pytest.mark.parametrize("name", CASES)
def test_known_systems_come_back_from_noisy_runs(name):
    truth, path, make, samples, dominant = CASES[name]
    found = estimate(Structure((path,)), make(samples, 0))
    other = make(samples // 2, 1)
    sizes = np.abs(truth.poles())
    sizes = sizes[sizes > 0.0]
    assert found.gain().value == pytest.approx(truth.gain(), rel=0.01)
    assert [i.value for i in found.pole_sizes()[:dominant]] == pytest.approx(sizes[:dominant].tolist(), rel=0.03)
    assert fit_percent(other.output, found.predict(other)) >= 97.0
    assert all(check.passed for check in found.checks)


def position_data(seed, share=0.01, samples=1500):
    """Proportional loop on a switching set-point; the noisy measurement is fed back."""
    rng = np.random.default_rng(seed)
    setpoint = switching(samples, 20, -2.0, 2.0, seed)
    decay = np.exp(-23.34 * SAMPLE_TIME_S)
    lag = (1.0 - decay) / 23.34
    position, velocity = 0.0, 0.0
    voltage, output = np.empty(samples), np.empty(samples)
    for k in range(samples):
        output[k] = position + share * 2.0 * rng.normal()
        voltage[k] = 3.0 * (setpoint[k] - output[k])
        steady = 206.4 / 23.34 * voltage[k]
        position += steady * SAMPLE_TIME_S + (velocity - steady) * lag
        velocity = steady + (velocity - steady) * decay
    return Data(SAMPLE_TIME_S, (voltage,), output)


def test_an_integrating_path_comes_back_from_a_closed_loop_and_its_intervals_hold():
    inside = {"gain": 0, "pole": 0}
    for seed in range(25):
        found = estimate(Structure((PathStructure(2, 0, 1),)), position_data(seed))
        inside["gain"] += found.gain().holds(POSITION.gain())
        inside["pole"] += found.pole_sizes()[0].holds(23.34)
        assert found.gain().value == pytest.approx(POSITION.gain(), rel=0.01)
    assert all(21 <= count <= 25 for count in inside.values())


def test_intervals_stay_honest_where_the_noise_is_coloured():
    inside = 0
    voltage = switching(1500, 10, 0.0, 5.0, 3)
    clean = response(TransferFunction((5.0,), (1.0, 5.0)), voltage)
    for seed in range(40):
        noise = lfilter([1.0], [1.0, -0.95], np.random.default_rng(seed).normal(size=1600))[100:]
        found = estimate(Structure((PathStructure(1, 0),)), Data(0.02, (voltage,), clean + 0.05 * noise), refinements=1)
        inside += found.gain().holds(1.0)
        assert found.noise.order >= 1
        assert found.noise.effective_samples < 500
    assert 34 <= inside <= 40


def test_offset_and_delay_are_found():
    signal = switching(2000, 15, 0.0, 5.0, 1)
    late = np.concatenate((np.zeros(3), signal[:-3]))
    clean = 2.5 + response(PRESSURE, late)
    found = estimate(
        Structure((PathStructure(3, 0, delay_s=0.03, estimate_delay=True),)), Data(0.02, (signal,), noisy(clean, 0))
    )
    assert found.offset.value == pytest.approx(2.5, abs=0.02)
    assert 0.06 < found.delay().value < 0.1


def test_two_paths_are_told_apart():
    samples = 3000
    voltage = switching(samples, 9, -1.0, 1.0, 1)
    pressure = response(PRESSURE, switching(samples, 10, 0.0, 5.0, 2))
    clean = response(POSITION, voltage) + response(DISTURBANCE, pressure, smooth=True)
    output = clean + 0.002 * np.random.default_rng(0).normal(size=samples)
    paths = (PathStructure(2, 0, 1), PathStructure(3, 1, 1, Hold.SMOOTH))
    found = estimate(Structure(paths, drift=True), Data(0.02, (voltage, pressure), output))
    assert found.gain(0).value == pytest.approx(POSITION.gain(), rel=0.002)
    assert found.gain(1).value == pytest.approx(DISTURBANCE.gain(), rel=0.02)
    assert [i.value for i in found.pole_sizes(1)] == pytest.approx([44.82, 44.82], rel=0.03)


def test_fewer_samples_than_parameters_are_refused():
    with pytest.raises(IdentificationError, match=r"12 samples for 1\d parameters"):
        estimate(Structure((PathStructure(6, 4),)), pressure_data().window(0, 12))


def test_an_improper_structure_is_refused():
    with pytest.raises(IdentificationError, match="improper"):
        PathStructure(2, 2)


def test_the_estimate_does_not_depend_on_units_of_time():
    slow = pressure_data(1500)
    fast = Data(SAMPLE_TIME_S / 1000.0, slow.inputs, slow.output)
    one, two = (estimate(Structure((PathStructure(3, 1),)), d) for d in (slow, fast))
    assert two.fit_percent == pytest.approx(one.fit_percent, abs=1e-3)
    assert [i.value for i in two.pole_sizes()] == pytest.approx([1000.0 * i.value for i in one.pole_sizes()], rel=1e-3)


def test_the_gains_band_holds_the_true_gain():
    found = estimate(Structure((PathStructure(6, 4),)), pressure_data(6000, 2))
    frequency = np.geomspace(1.0, 100.0, 60)
    off = np.abs(np.abs(found.paths[0].frequency_response(frequency)) - np.abs(PRESSURE.frequency_response(frequency)))
    assert np.mean(off <= found.gain_band(frequency)) > 0.6
    assert np.all(off <= 2.0 * found.gain_band(frequency))
    assert np.all(found.gain_band(frequency) > 0.0)
