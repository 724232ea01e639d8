"""Whether an effect comes before or behind what the given model has on the voltage's way."""

from pathlib import Path

import numpy as np
import pytest

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import EffectSpec, ModelSpec, PathSimulator, PathSpec
from dt_station_nodes.core.models.effects import Attachment
from dt_station_nodes.core.run import Run
from dt_station_nodes.discovery import DiscoverySettings
from dt_station_nodes.discovery.candidates import Candidate, add_effect, hypothesis
from dt_station_nodes.discovery.hypothesis_fit import fit_hypothesis
from dt_station_nodes.discovery.problem import Problem, make_problem
from dt_station_nodes.discovery.search import scan
from dt_station_nodes.discovery.selection import Bench, Explanation, fit_null
from dt_station_nodes.discovery.sequence import in_sequence
from dt_station_nodes.discovery.terms import nominal_terms

MODEL = Path(__file__).parents[3] / "config" / "models" / "paper.yaml"
PAPER = ModelSpec.from_yaml(MODEL.read_text(encoding="utf-8"))
PATH = PAPER.paths[Channel.PRESSURE]
MODE = EffectSpec(name="resonance", parameters={"frequency_hz": 3.0, "damping": 0.12})
NOISE_PA = 4e3
OWN = [effect.name for effect in PATH.effects]


def names_in_sequence(explanation: Explanation) -> list[str]:
    return [effect.name for effect in explanation.fit.path.effects]


def shaken(path: PathSpec, middle_v: float = 0.8, swing_v: float = 0.7) -> Problem:
    """A square voltage that a ringing valve takes below 0 V, where it is shut."""
    voltage = middle_v + swing_v * np.sign(np.sin(3.1 * np.arange(900) * 0.02))
    pressure = PathSimulator(Channel.PRESSURE, 0.02, voltage, np.zeros(0), 1e6, 1e6).simulate(path)
    pressure += NOISE_PA * np.random.default_rng(11).standard_normal(voltage.size)
    run = Run(0.02, {"load_voltage_v": voltage, "pressure_pa": pressure})
    return make_problem(run, PAPER, Channel.PRESSURE, DiscoverySettings())


@pytest.mark.parametrize("first", [True, False])
def test_a_mode_is_found_on_its_side_of_the_valves_limits(first: bool) -> None:
    effects = (MODE, *PATH.effects) if first else (*PATH.effects, MODE)
    problem = shaken(PATH.model_copy(update={"effects": effects}))
    bench = Bench(problem, nominal_terms(PATH, problem.signal))
    best = scan(bench, [fit_null(bench, PATH)], 6, 2)[0]
    assert best.added == ("resonance",)
    assert float(np.std(best.fit.residual)) < 1.1 * NOISE_PA
    assert names_in_sequence(best) == (["resonance", *OWN] if first else [*OWN, "resonance"])


def test_a_mode_swings_beyond_the_cards_limit_and_the_valve_is_still_shut_at_zero() -> None:
    shut = EffectSpec(name="saturation", parameters={"upper_v": 1e9, "lower_v": 0.0})
    problem = shaken(PATH.model_copy(update={"effects": (MODE, shut)}), 2.4, 2.1)
    bench = Bench(problem, nominal_terms(PATH, problem.signal))
    best = scan(bench, [fit_null(bench, PATH)], 6, 2)[0]
    assert best.added == ("resonance",)
    assert float(np.std(best.fit.residual)) < 1.1 * NOISE_PA


@pytest.mark.parametrize("first", [True, False])
def test_a_drift_as_large_as_its_refined_form_says_is_asked_again_what_limits_it(first: bool) -> None:
    """Its straight form, all that is tried at first, comes to the limit on neither run."""
    drift = EffectSpec(name="gain_drift", parameters={"rate_per_s": 0.42 / 5.0, "settling_s": 5.0})
    path = PATH.model_copy(update={"effects": (drift, *PATH.effects) if first else (*PATH.effects, drift)})
    time = np.arange(1200) * 0.02

    def driven(voltage: np.ndarray, seed: int) -> Problem:
        pressure = PathSimulator(Channel.PRESSURE, 0.02, voltage, np.zeros(0), 1e6, 1e6).simulate(path)
        pressure += NOISE_PA * np.random.default_rng(seed).standard_normal(voltage.size)
        run = Run(0.02, {"load_voltage_v": voltage, "pressure_pa": pressure})
        return make_problem(run, PAPER, Channel.PRESSURE, DiscoverySettings())

    problem = driven(1.7 + 1.4 * np.sin(1.3 * time), 1)
    check = driven(2.1 + 1.9 * np.sign(np.sin(0.8 * time)), 2)
    bench = Bench(problem, nominal_terms(PATH, problem.signal), check)
    best = scan(bench, [fit_null(bench, PATH)], 6, 6)[0]
    assert best.added == ("gain_drift",)
    assert names_in_sequence(best) == (["gain_drift", *OWN] if first else [*OWN, "gain_drift"])


@pytest.mark.parametrize("relieved_last", [True, False])
def test_a_relief_valve_cuts_off_what_ripples_before_it_and_not_what_the_sensor_adds(relieved_last: bool) -> None:
    relief, ripple = Candidate("overflow", Attachment.OUTPUT), Candidate("periodic_disturbance", Attachment.OUTPUT)
    numbers = {
        "overflow": {"limit": 1.6e6},
        "periodic_disturbance": {"amplitude": 8e4, "frequency_hz": 4.3, "phase_rad": 0.4},
    }
    rightly = (ripple, relief) if relieved_last else (relief, ripple)
    there, wrong = PATH, PATH
    for one, other in zip(rightly, rightly[::-1], strict=True):
        there, wrong = add_effect(there, one, numbers[one.name]), add_effect(wrong, other, numbers[other.name])
    problem = shaken(there, 1.5, 1.1)
    bench = Bench(problem, nominal_terms(PATH, problem.signal))
    freed = {name: tuple(values) for name, values in numbers.items()}
    begin = hypothesis(problem, wrong, bench.nominal, freed)
    found = bench.explained(fit_hypothesis(problem, begin, [begin.start()]), tuple(freed), freed, glance=True)
    put, _ = in_sequence(bench, found, relief)
    names = [effect.name for effect in put.fit.path.effects if effect.name in freed]
    assert names == [one.name for one in rightly]
    again, _ = in_sequence(bench, put, relief)
    assert again is put


def test_an_effect_stays_on_its_side_when_its_form_is_changed() -> None:
    candidate = Candidate("resonance", first=True)
    once = add_effect(PATH, candidate, dict(MODE.parameters))
    again = add_effect(once, Candidate("resonance"), {**MODE.parameters, "damping": 0.2})
    assert [effect.name for effect in again.effects] == ["resonance", *(effect.name for effect in PATH.effects)]
    assert again.effects[0].parameters["damping"] == 0.2
