"""Discovery on a measured positioning axis (EMPS): dry friction; published figures stand beside."""

import numpy as np
import pytest
from scipy import signal

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.discovery import DiscoverySettings, Verdict, discover
from dt_station_nodes.discovery.problem import make_problem
from support.measured import model, names, table

pytestmark = [pytest.mark.measured, pytest.mark.timeout(900)]

FORCE_N_PER_V = 35.15065
COULOMB_N = 20.39


def parameters(result, name):
    return next(effect.parameters for effect in result.effects if effect.name == name)


@pytest.fixture(scope="module")
def emps(measured_data):
    run = table(measured_data, "emps.mat", "emps")
    pulses = table(measured_data, "emps_pulses.mat", "emps_pulses")
    return run, pulses, discover(run, model("emps"), validation=pulses)


def test_emps_lacks_friction_of_the_published_size(emps):
    _, _, result = emps
    assert result.verdict is Verdict.NAMED
    assert "friction" in names(result, Channel.POSITION)
    coulomb = parameters(result, "friction")["coulomb_v"].value * FORCE_N_PER_V
    assert coulomb == pytest.approx(COULOMB_N, rel=0.02)


def test_emps_free_run_of_the_pulses(emps):
    _, pulses, result = emps
    problem = make_problem(pulses, result.model, Channel.POSITION, DiscoverySettings())
    gap = problem.measured - problem.simulate(result.model.paths[Channel.POSITION])
    assert np.sqrt(np.mean(np.square(gap))) <= 0.003


def test_emps_lacks_friction_whether_another_run_says_so_or_not(emps):
    run, _, _ = emps
    result = discover(run, model("emps"))
    assert names(result, Channel.POSITION) == {"friction"}
    coulomb = parameters(result, "friction")["coulomb_v"].value * FORCE_N_PER_V
    assert coulomb == pytest.approx(COULOMB_N, rel=0.02)


def test_emps_force_on_the_pulses_run(emps):
    _, pulses, result = emps
    path = result.model.paths[Channel.POSITION]
    gain = path.gain * path.numerator[-1] / path.denominator[-2]  # m/s per V
    lag = path.time_scale / path.denominator[-2]
    friction = next(effect.parameters for effect in path.effects if effect.name == "friction")
    bias = {effect.name: effect.parameters for effect in path.effects}.get("bias", {}).get("offset_v", 0.0)
    step = pulses.sample_time_s
    b, a = signal.butter(4, 60 * 2 * step)
    speed = np.gradient(signal.filtfilt(b, a, pulses.signals["position_m"]), step)
    # An offset of the drive may come as a bias or as a Coulomb level that differs with direction.
    dry = friction["coulomb_v"] * (np.sign(speed) + friction.get("asymmetry", 0.0))
    wanted = (lag * np.gradient(speed, step) + speed) / gain + dry - bias

    def slow(values):
        return signal.decimate(values, 25, zero_phase=True)[10:-10]

    applied = slow(pulses.signals["servo_voltage_v"])
    error = np.linalg.norm(applied - slow(wanted)) / np.linalg.norm(applied)
    assert error <= 0.06
