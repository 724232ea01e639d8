"""A gain that settles or is heated: found where a ramp's fit does not lead, told from one that is off all the time."""

from pathlib import Path

import numpy as np
import pytest

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import ModelSpec, PathSimulator, PathSpec
from dt_station_nodes.core.models.effects import Attachment, registry
from dt_station_nodes.core.run import Run
from dt_station_nodes.discovery import discover
from dt_station_nodes.discovery.candidates import Candidate, add_effect
from dt_station_nodes.discovery.problem import make_problem
from dt_station_nodes.discovery.refinements import refinements, step_starts
from dt_station_nodes.discovery.result import Verdict
from dt_station_nodes.discovery.settings import DiscoverySettings
from dt_station_nodes.discovery.settling import SETTLING, heated_drift, settling_drift

MODEL = Path(__file__).parents[3] / "config" / "models" / "paper.yaml"
PAPER = ModelSpec.from_yaml(MODEL.read_text(encoding="utf-8"))
PATH = PAPER.paths[Channel.PRESSURE].model_copy(update={"effects": ()})
SPEC = ModelSpec(name="valve", paths={Channel.PRESSURE: PATH})
TURNS = 2.0 * np.pi * 0.02 * np.arange(2600)
WAVES = (3.4 + 0.6 * np.sin(0.9 * TURNS), 2.7 + np.sin(0.7 * TURNS))
PLAIN = Candidate("gain_drift")


def warming(wave: int, path: PathSpec = PATH, noise_pa: float = 0.0, **drift: float) -> Run:
    """Pressure of a valve whose gain drifts."""
    volts = WAVES[wave]
    simulator = PathSimulator(Channel.PRESSURE, 0.02, volts, np.zeros(0), float(path.rest), 0.0)
    noise = noise_pa * np.random.default_rng(wave).standard_normal(volts.size)
    pressure = simulator.simulate(add_effect(path, PLAIN, drift)) + noise
    return Run(0.02, {"load_voltage_v": volts, "pressure_pa": pressure})


@pytest.mark.parametrize("gain", [1.0, 1.02])
@pytest.mark.parametrize("rate", [-0.002, 0.004])
def test_its_time_constant_and_rate_whatever_the_gain_is_off(rate: float, gain: float) -> None:
    off = PATH.model_copy(update={"scale": PATH.scale * gain})
    run = warming(0, off, rate_per_s=rate, settling_s=0.1 * 52.0)
    problem = make_problem(run, SPEC, Channel.PRESSURE, DiscoverySettings())
    settling_s, found = settling_drift(problem, add_effect(PATH, PLAIN, {"rate_per_s": 0.1 * rate}))
    assert settling_s == pytest.approx(5.2)
    assert found == pytest.approx(rate * gain, rel=0.02)


def test_its_form_begins_there() -> None:
    run = warming(0, rate_per_s=-0.002, settling_s=5.2)
    problem = make_problem(run, SPEC, Channel.PRESSURE, DiscoverySettings())
    ramp = add_effect(PATH, PLAIN, {"rate_per_s": -1e-4})
    forms = refinements(problem, ramp, PLAIN, problem.residual(PATH))
    neutral, start = (s.effect("gain_drift").parameters for s in step_starts(ramp, forms, (SETTLING,)))
    assert neutral["rate_per_s"] == -1e-4
    assert start[SETTLING] == pytest.approx(5.2)
    assert start["rate_per_s"] == pytest.approx(-0.002, rel=0.02)


def test_a_gain_that_settles_early_in_a_long_run_is_gain_drift() -> None:
    """A warm-up over a tenth of the run bends a ramp's fit to next to nothing, from where no step leads back."""
    runs = [warming(wave, noise_pa=4.5e3, rate_per_s=-0.002, settling_s=5.2) for wave in (0, 1)]
    result = discover(runs[0], SPEC, runs[1])
    (effect,) = result.effects
    assert effect.name == "gain_drift"
    assert set(effect.parameters) == {"rate_per_s", SETTLING}
    assert effect.parameters[SETTLING].value == pytest.approx(5.2, rel=0.1)


WARMING = (2.5 + 1.5 * np.sin(0.9 * TURNS) * np.sin(0.13 * TURNS), 2.0 + 1.8 * np.sign(np.sin(0.3 * TURNS)))


def heating(wave: int, noise_pa: float = 0.0, **drift: float) -> Run:
    """Pressure of a valve that what is put in heats."""
    volts = WARMING[wave]
    simulator = PathSimulator(Channel.PRESSURE, 0.02, volts, np.zeros(0), float(PATH.rest), 0.0)
    noise = noise_pa * np.random.default_rng(wave).standard_normal(volts.size)
    pressure = simulator.simulate(add_effect(PATH, PLAIN, {"rate_per_s": 0.0, **drift})) + noise
    return Run(0.02, {"load_voltage_v": volts, "pressure_pa": pressure})


@pytest.mark.parametrize("gain", [1.0, 1.02])
def test_what_heats_it_by_how_much_and_how_fast_whatever_the_gain_is_off(gain: float) -> None:
    problem = make_problem(heating(0, heat_per_v2=-0.002, heat_s=7.8), SPEC, Channel.PRESSURE, DiscoverySettings())
    off = PATH.model_copy(update={"scale": PATH.scale / gain})
    found = heated_drift(problem, add_effect(off, PLAIN, {"rate_per_s": -0.01}))
    assert found["heat_s"] == pytest.approx(7.8)
    assert found["heat_per_v2"] == pytest.approx(-0.002, rel=0.05)


def test_a_sensor_is_not_heated_by_the_voltage() -> None:
    problem = make_problem(heating(0), SPEC, Channel.PRESSURE, DiscoverySettings())
    sensor = Candidate("gain_drift", Attachment.OUTPUT)
    assert heated_drift(problem, add_effect(PATH, sensor, {"rate_per_s": -0.01})) == {}


def tiring(wave: int) -> Run:
    """Pressure of a valve whose gain falls along a line with the filtered size of its voltage."""
    volts, effort = WARMING[wave], np.zeros(2600)
    for k in range(1, 2600):
        effort[k] = effort[k - 1] + 0.02 / 9.0 * (volts[k - 1] - effort[k - 1])
    simulator = PathSimulator(Channel.PRESSURE, 0.02, volts * (1.0 - 0.08 * effort), np.zeros(0), float(PATH.rest), 0.0)
    noise = 4.5e3 * np.random.default_rng(wave).standard_normal(volts.size)
    return Run(0.02, {"load_voltage_v": volts, "pressure_pa": simulator.simulate(PATH) + noise})


def derated(wave: int, recovery_s: float) -> Run:
    """Pressure of a valve whose gain falls as one over the filtered square of its voltage."""
    volts, heat = WARMING[wave], np.zeros(2600)
    for k in range(1, 2600):
        heat[k] = heat[k - 1] + 0.02 / recovery_s * (volts[k - 1] ** 2 - heat[k - 1])
    simulator = PathSimulator(Channel.PRESSURE, 0.02, volts / (1.0 + 0.012 * heat), np.zeros(0), float(PATH.rest), 0.0)
    noise = 4.5e3 * np.random.default_rng(wave).standard_normal(volts.size)
    return Run(0.02, {"load_voltage_v": volts, "pressure_pa": simulator.simulate(PATH) + noise})


def test_a_coil_that_its_voltage_warms_is_gain_drift() -> None:
    """A ramp's fit left twice the noise, and a stranger that weakens with past effort stood before it."""
    warm = discover(derated(0, 8.0), SPEC, derated(1, 8.0))
    (effect,) = warm.effects
    assert effect.name == "gain_drift"
    assert effect.parameters["heat_s"].value == pytest.approx(8.0, rel=0.1)


def test_what_a_slow_fatigue_weakens_has_no_name() -> None:
    """With the voltage's size, and as slowly as a coil warms."""
    tired = discover(tiring(0), SPEC, tiring(1))
    assert tired.verdict is Verdict.UNEXPLAINED


def test_what_forgets_quicker_than_anything_cools_is_left_to_the_stranger() -> None:
    slowest, quickest = registry()["fatigue"].parameter("recovery_s"), registry()["gain_drift"].parameter("heat_s")
    assert slowest.upper > quickest.lower
    problem = make_problem(derated(0, 1.0), SPEC, Channel.PRESSURE, DiscoverySettings())
    assert heated_drift(problem, add_effect(PATH, PLAIN, {"rate_per_s": -0.01}))["heat_s"] == quickest.lower
