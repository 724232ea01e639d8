"""Whether an effect comes before or behind what the given model has on the voltage's way."""

from pathlib import Path

import numpy as np
import pytest

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import EffectSpec, ModelSpec, PathSimulator, PathSpec
from dt_station_nodes.core.run import Run
from dt_station_nodes.discovery import DiscoverySettings
from dt_station_nodes.discovery.candidates import Candidate, add_effect, as_it_stands
from dt_station_nodes.discovery.problem import Problem, make_problem
from dt_station_nodes.discovery.search import scan
from dt_station_nodes.discovery.selection import Bench, fit_null
from dt_station_nodes.discovery.terms import nominal_terms

MODEL = Path(__file__).parents[3] / "config" / "models" / "paper.yaml"
PAPER = ModelSpec.from_yaml(MODEL.read_text(encoding="utf-8"))
PATH = PAPER.paths[Channel.PRESSURE]
MODE = EffectSpec(name="resonance", parameters={"frequency_hz": 3.0, "damping": 0.12})
NOISE_PA = 4e3


def shaken(path: PathSpec) -> Problem:
    """A square voltage that a ringing valve takes below 0 V, where it is shut."""
    voltage = 0.8 + 0.7 * np.sign(np.sin(3.1 * np.arange(900) * 0.02))
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
    assert as_it_stands(best.fit.path, "resonance", best.added).first is first


def test_an_effect_stays_on_its_side_when_its_form_is_changed() -> None:
    candidate = Candidate("resonance", first=True)
    once = add_effect(PATH, candidate, dict(MODE.parameters))
    again = add_effect(once, as_it_stands(once, "resonance", ("resonance",)), {**MODE.parameters, "damping": 0.2})
    assert [effect.name for effect in again.effects] == ["resonance", *(effect.name for effect in PATH.effects)]
    assert again.effects[0].parameters["damping"] == 0.2
