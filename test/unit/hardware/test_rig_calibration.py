"""The paper rig behaves near the paper's equations (1), (5) and (6), within stated tolerances."""

import numpy as np
import pytest
from scipy import signal
from scipy.optimize import least_squares

from dt_station_nodes.hardware.virtual import VirtualRig, load_rig
from support.rigs import FINE_S, drive, noiseless, rig, settled

PRESSURE = ([295.1, -2.944e4, 7.457e6, -1.267e8, 3.217e10], [1, 159.3, 1.962e4, 1.479e6, 7.247e7, 2.244e9, 3.242e10])
POSITION = ([206.4], [1, 23.34, 0])
DISTURBANCE = ([64.72, -16.45], [1, 76.54, 2009, 0])


@pytest.fixture(scope="module")
def paper() -> VirtualRig:
    return VirtualRig(noiseless(load_rig("paper")), FINE_S)


def held_step(model, voltage, sample_time_s):
    """Response of a continuous model to held voltages at the samples."""
    numerator, denominator, _ = signal.cont2discrete(model, sample_time_s)
    return signal.lfilter(numerator.ravel(), denominator, voltage)


def fit_percent(measured, simulated):
    return 100 * (1 - np.linalg.norm(measured - simulated) / np.linalg.norm(measured - measured.mean()))


def response(rig, load_v, servo_v, of, by, frequency_hz):
    """Complex response at a frequency from the last two periods, the hold's half sample taken out."""
    run = drive(rig, load_v, servo_v)
    last = round(2 / frequency_hz / rig.sample_time_s)
    t = run.time_s[-last:]
    w = 2 * np.pi * frequency_hz
    basis = np.column_stack([np.sin(w * t), np.cos(w * t), np.ones_like(t), t])
    given, got = (np.linalg.lstsq(basis, run.signals[name][-last:], rcond=None)[0] for name in (by, of))
    return complex(got[0], got[1]) / complex(given[0], given[1]) * np.exp(0.5j * w * rig.sample_time_s)


def sine(amplitude, frequency_hz, sample_time_s, before_s=1.0):
    periods = max(3, int(np.ceil(frequency_hz)) + 2)
    t = np.arange(round(periods / frequency_hz / sample_time_s)) * sample_time_s
    return np.concatenate([np.zeros(round(before_s / sample_time_s)), amplitude * np.sin(2 * np.pi * frequency_hz * t)])


def test_square_of_the_pressure_path_follows_equation_1(paper):
    voltage = np.where((np.arange(600) * FINE_S) % 1.0 < 0.5, 0.0, 5.0)
    measured = drive(paper, voltage, 0.0).signals["pressure_pa"] / 1e6
    model = 1.0 + held_step(PRESSURE, voltage, FINE_S)
    assert fit_percent(measured, model) > 93.0
    assert (measured[199] - measured[0]) / 5.0 == pytest.approx(0.9923, rel=0.03)


def test_rest_pressure_is_one_megapascal(paper):
    assert drive(paper, np.zeros(20), 0.0).signals["pressure_pa"] == pytest.approx(np.full(20, 1.0e6), abs=300.0)


@pytest.mark.parametrize("frequency_hz", [0.5, 1.0, 2.0, 4.0])
def test_pressure_frequency_response_follows_equation_1(frequency_hz):
    ideal = rig("ideal")
    load = 2.5 + sine(1.5, frequency_hz, FINE_S)
    measured = response(ideal, load, 0.0, "pressure_pa", "load_voltage_v", frequency_hz) / 1e6
    s = 2j * np.pi * frequency_hz
    ratio = measured / (np.polyval(PRESSURE[0], s) / np.polyval(PRESSURE[1], s))
    assert abs(20 * np.log10(abs(ratio))) < 0.5
    assert abs(np.degrees(np.angle(ratio))) < 8.0


@pytest.mark.parametrize("frequency_hz", [0.5, 1.0, 2.0, 4.0])
def test_position_frequency_response_follows_equation_5(paper, frequency_hz):
    servo = sine(1.0, frequency_hz, FINE_S)
    measured = response(paper, 2.5, servo, "position_m", "servo_voltage_v", frequency_hz) * 100
    s = 2j * np.pi * frequency_hz
    ratio = measured / (np.polyval(POSITION[0], s) / np.polyval(POSITION[1], s))
    assert abs(20 * np.log10(abs(ratio))) < 1.2
    assert abs(np.degrees(np.angle(ratio))) < 10.0


def test_identified_gain_and_time_constant_are_those_of_equation_5(paper):
    rng = np.random.default_rng(5)
    servo = np.repeat(rng.uniform(-1.5, 1.5, 24), 30)
    position = drive(paper, 2.0, servo, settled(paper, 2.0)).signals["position_m"] * 100

    def residual(theta):
        gain, lag = theta
        return held_step(([gain], [lag, 1.0, 0.0]), servo, FINE_S) + position[0] - position

    gain, lag = least_squares(residual, [5.0, 0.02]).x
    assert gain == pytest.approx(8.843, rel=0.04)
    assert lag == pytest.approx(0.0428, rel=0.15)


def test_load_step_kicks_and_then_drifts_as_equation_6(paper):
    load = np.where(np.arange(800) < 100, 0.0, 1.0)
    run = drive(paper, load, 0.0)
    position = run.signals["position_m"] * 100
    step_mpa = (run.signals["pressure_pa"][-1] - run.signals["pressure_pa"][90]) / 1e6
    model = held_step(DISTURBANCE, (run.signals["pressure_pa"] - run.signals["pressure_pa"][90]) / 1e6, FINE_S)
    kick = position[100:200].max() / step_mpa
    drift = (position[-1] - position[400]) / (399 * FINE_S) / step_mpa
    assert kick == pytest.approx(model[100:200].max() / step_mpa, rel=0.1)
    assert drift == pytest.approx(-0.0082, rel=0.35)


def settling(pressure, sample_time_s, low, high):
    beyond = np.flatnonzero(np.abs((pressure - low) / (high - low) - 1) > 0.02)
    return (beyond[-1] + 1) * sample_time_s


@pytest.mark.parametrize(
    ("a", "b", "settles_s", "within_s"),
    [(0.2861, 0.1595, 0.5, 0.1), (0.4590, 0.3899, 1.2, 0.3)],
    ids=["optimised", "Z-N"],
)
def test_published_pi_settles_as_on_the_papers_rig(a, b, settles_s, within_s):
    rig_20ms = rig("paper", 0.02)
    state, voltage, before, pressure = rig_20ms.initial_state(), 0.0, 0.0, []
    for k in range(400):
        wanted = 1.5e6 if k < 200 else 4.5e6
        measured, _, _ = rig_20ms.read(state)
        error = (wanted - measured) / 1e6
        voltage, before = min(max(voltage + a * error - b * before, 0.0), 5.0), error
        state = rig_20ms.after(np.array([voltage]), np.zeros(1), state)
        pressure.append(measured)
    rise = np.array(pressure[200:]) / 1e6
    assert settling(rise, 0.02, 1.5, 4.5) == pytest.approx(settles_s, abs=within_s)
    assert rise.max() < 4.5 * 1.01
