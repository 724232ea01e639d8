"""How an oscillation's frequency and amplitude swing, read off what a run leaves."""

import numpy as np
import pytest

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import PathSimulator
from dt_station_nodes.core.run import Run
from dt_station_nodes.discovery import DiscoverySettings
from dt_station_nodes.discovery.candidates import Candidate, add_effect
from dt_station_nodes.discovery.channel import examine
from dt_station_nodes.discovery.modulation import modulation, swing_phases_rad
from dt_station_nodes.discovery.problem import Problem, make_problem
from dt_station_nodes.discovery.result import Verdict
from dt_station_nodes.discovery.unseen import unseen_residual

from .valves import BARE, SPEC, TIME_S, WAVES

STEP_S = 0.02
CARRIER_HZ, INDEX_RAD, SWING_HZ = 2.6, 1.4, 0.06
SWELL, SWELL_HZ = 0.3, 0.09
SHORT, NOISE, SHAKEN_PA = 800, 0.01, 6e4  # samples; of the pressure


def carried(size: float, turn_rad: float, swell: float = SWELL, index_rad: float = INDEX_RAD) -> np.ndarray:
    """A tone (n,) whose frequency swings and whose amplitude swells."""
    swing = index_rad * np.sin(2.0 * np.pi * SWING_HZ * TIME_S + turn_rad)
    envelope = size * (1.0 + swell * np.sin(2.0 * np.pi * SWELL_HZ * TIME_S - turn_rad))
    return envelope * np.sin(2.0 * np.pi * CARRIER_HZ * TIME_S + 2.0 * turn_rad + swing)


def noisy(size: float, seed: int = 4) -> np.ndarray:
    return size * np.random.default_rng(seed).standard_normal(TIME_S.size)


@pytest.mark.parametrize("seen_hz", [CARRIER_HZ, CARRIER_HZ + SWING_HZ])
def test_a_swing_is_seen_from_about_its_carrier(seen_hz: float) -> None:
    residual = carried(1.0, 0.7) + noisy(0.1)
    residual[:40] = 0.0
    found = modulation(residual, STEP_S, seen_hz)
    assert found is not None
    assert found.frequency_hz == pytest.approx(CARRIER_HZ, abs=5e-3)
    assert found.phase.size == pytest.approx(INDEX_RAD, rel=0.05)
    assert found.phase.frequency_hz == pytest.approx(SWING_HZ, rel=0.05)
    assert found.amplitude is not None
    assert found.amplitude.size == pytest.approx(SWELL, rel=0.15)
    phases = swing_phases_rad(residual, STEP_S, CARRIER_HZ, SWING_HZ, SWELL_HZ)
    assert phases == pytest.approx((0.7, -0.7), abs=0.1)


def test_a_steady_tone_does_not_swing_nor_does_what_is_too_slow_to_tell() -> None:
    steady = carried(1.0, 0.7, 0.0, 0.0)
    assert modulation(steady + noisy(0.1), STEP_S, CARRIER_HZ) is None
    assert modulation(steady, STEP_S, 0.1) is None
    assert swing_phases_rad(steady, STEP_S, 0.1, SWING_HZ, SWELL_HZ) == (0.0, 0.0)
    swings = modulation(carried(1.0, 0.7, 0.0), STEP_S, CARRIER_HZ)
    assert swings is not None
    assert swings.amplitude is None


def problem(wave: int, turn_rad: float) -> Problem:
    volts = 2.2 + 1.2 * WAVES[wave][:SHORT]
    pressure = PathSimulator(Channel.PRESSURE, STEP_S, volts, np.zeros(0), 1e6, 1e6).simulate(BARE)
    size = float(np.std(pressure))
    pressure += carried(SHAKEN_PA, turn_rad)[:SHORT] + noisy(NOISE * size, wave)[:SHORT]
    run = Run(STEP_S, {"load_voltage_v": volts, "pressure_pa": pressure})
    return make_problem(run, SPEC, Channel.PRESSURE, DiscoverySettings())


@pytest.mark.parametrize("turn_rad", [-2.0, 0.1, 1.6, 2.9])
def test_another_run_is_foretold_whatever_its_phases_are(turn_rad: float) -> None:
    """As fitted on a run in which they were other ones."""
    tone = {"amplitude": SHAKEN_PA, "frequency_hz": CARRIER_HZ, "phase_rad": 1.4, "swell": SWELL, "swell_hz": SWELL_HZ}
    swing = {"swell_rad": -0.7, "modulation_rad": INDEX_RAD, "modulation_hz": SWING_HZ, "modulation_phase_rad": 0.7}
    path = add_effect(BARE, Candidate("periodic_disturbance"), {**tone, **swing})
    other = problem(1, turn_rad)
    assert float(np.std(unseen_residual(other, path))) < 1.05 * NOISE * float(np.std(other.measured))


def test_a_machine_whose_speed_goes_up_and_down_is_a_disturbance_in_another_phase_each_run() -> None:
    found = examine(problem(0, 0.7), BARE, DiscoverySettings(), check=problem(1, 2.9))
    assert (found.verdict, found.best.added) == (Verdict.NAMED, ("periodic_disturbance",))
    numbers = found.best.fit.path.effect("periodic_disturbance").parameters
    assert numbers["modulation_rad"] == pytest.approx(INDEX_RAD, rel=0.05)
    assert numbers["frequency_hz"] == pytest.approx(CARRIER_HZ, abs=2e-3)
    assert all(left < 1.1 for left in found.over_noise)
