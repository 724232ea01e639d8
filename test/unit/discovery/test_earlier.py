"""What goes by the clock of a run, in one that began earlier."""

from pathlib import Path

import numpy as np
import pytest

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import EffectSpec, ModelSpec, PathSimulator, PathSpec
from dt_station_nodes.core.models.effects import registry
from dt_station_nodes.core.run import Run
from dt_station_nodes.discovery import discover
from dt_station_nodes.discovery.earlier import begun_earlier

PAPER = ModelSpec.from_yaml((Path(__file__).parents[3] / "config/models/paper.yaml").read_text(encoding="utf-8"))
STEP_S, CUT = 0.02, 700


def having(name: str, **numbers: float) -> PathSpec:
    effect = EffectSpec(name=name, parameters=registry()[name].complete(numbers))
    return PAPER.paths[Channel.PRESSURE].model_copy(update={"effects": (effect,)})


@pytest.mark.parametrize(
    ("name", "numbers"),
    [
        ("periodic_disturbance", {"phase_rad": 1.0, "second_share": 0.4, "second_hz": 3.1, "second_rad": -2.0}),
        ("periodic_disturbance", {"phase_rad": 1.0, "swell": 0.5, "swell_hz": 0.2, "swell_rad": 0.7}),
        ("periodic_disturbance", {"phase_rad": 1.0, "modulation_rad": 2.0, "modulation_hz": 0.1}),
        ("periodic_disturbance", {"phase_rad": 1.0, "burst_period_s": 3.0, "burst_share": 0.4, "burst_start_s": 1.1}),
        ("gain_drift", {"jump": 0.3, "jump_s": 2.0, "second_jump": -0.2, "second_jump_s": 4.0, "rate_per_s": 0.0}),
        ("gain_drift", {"rate_per_s": 0.02, "onset_s": 2.0}),
        ("delay", {"delay_s": 0.1, "wander": 0.06, "wander_hz": 0.31, "wander_rad": 1.2}),
        ("bias", {"bias_v": 0.0, "jump_v": 0.3, "jump_s": 2.0}),
    ],
)
def test_the_same_comes_of_a_run_told_from_earlier_on(name: str, numbers: dict[str, float]) -> None:
    given = {"amplitude": 2e5, "frequency_hz": 1.3, **numbers} if name == "periodic_disturbance" else numbers
    late = having(name, **given)
    volts = 2.0 + np.sin(0.1 * np.arange(1200))

    def answer(path: PathSpec, first: int) -> np.ndarray:
        return PathSimulator(Channel.PRESSURE, STEP_S, volts[first:], np.zeros(0), 1e6, 1e6).simulate(path)

    whole = answer(begun_earlier(late, CUT * STEP_S), 0)
    # What the path remembers of where it began is forgotten within a second.
    assert whole[CUT + 50 :] == pytest.approx(answer(late, CUT)[50:], rel=1e-6)
    assert begun_earlier(late, 0.0) is late


def test_what_was_there_from_the_start_may_have_been_before() -> None:
    drift = having("gain_drift", rate_per_s=0.01)
    assert begun_earlier(drift, 5.0).effect("gain_drift").parameters == drift.effect("gain_drift").parameters


def test_both_tones_of_a_run_searched_in_a_late_stretch_are_those_of_the_whole() -> None:
    """A pump's ripple with its second harmonic, under a voltage that moves most in the end."""
    step_s, samples = 0.01, 5600
    rng = np.random.default_rng(14)
    volts = np.repeat(rng.uniform(-1.0, 1.0, samples // 80), 80) * np.linspace(0.2, 2.0, samples)
    crude = {"numerator": [1e6], "denominator": [0.095 * 0.28, 0.095 + 0.28, 1.0]}
    spec = ModelSpec.model_validate({"name": "crude", "paths": {Channel.PRESSURE: crude}})
    linear = PathSimulator(Channel.PRESSURE, step_s, volts, np.zeros(0), 0.0, 0.0).simulate(
        spec.paths[Channel.PRESSURE]
    )
    angle = 2.0 * np.pi * 6.87 * step_s * np.arange(samples) + 0.4
    ripple = 2e5 * np.sin(angle) + 6e4 * np.sin(2.0 * angle + 1.0)
    measured = linear + ripple + 5e3 * rng.standard_normal(samples)
    found = discover(Run(step_s, {"load_voltage_v": volts, "pressure_pa": measured}), spec)
    assert [effect.name for effect in found.effects] == ["periodic_disturbance"]
    assert found.gap.after[Channel.PRESSURE].rms < 1.2 * found.gap.noise_floor[Channel.PRESSURE].rms
