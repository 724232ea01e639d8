"""The waveform proposed where a run leaves more than one explanation."""

from pathlib import Path

import numpy as np
import pytest

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import ModelSpec, PlantModel
from dt_station_nodes.core.run import Run
from dt_station_nodes.core.waveforms import Shape, Waveform, waveform_samples
from dt_station_nodes.discovery import NextExperiment, Verdict, discover

PAPER = ModelSpec.from_yaml(
    (Path(__file__).parents[3] / "config" / "models" / "paper.yaml").read_text(encoding="utf-8")
)
STEP_S = 0.02


def waved(shape: Shape, amplitude_v: float, frequency_hz: float, offset_v: float = 0.0) -> np.ndarray:
    """A servo voltage (n,) of 24 s."""
    return waveform_samples(Waveform(shape, amplitude_v, offset_v, frequency_hz), STEP_S, 1200)


def run_of(rig: ModelSpec, servo: np.ndarray, seed: int) -> Run:
    """What a rig measures at 40 dB under a servo voltage (n,), its load moving too."""
    load = 1.5 + 0.8 * np.sin(2.0 * np.pi * 0.23 * STEP_S * np.arange(servo.size))
    out = PlantModel(rig, STEP_S).simulate(load, servo)
    rng = np.random.default_rng(seed)
    measured = {"pressure_pa": out.pressure_pa, "position_m": out.position_m}
    noisy = {name: v + 0.01 * np.std(v) * rng.standard_normal(v.size) for name, v in measured.items()}
    return Run(STEP_S, {"load_voltage_v": load, "servo_voltage_v": servo, **noisy})


def proposed(experiment: NextExperiment | None) -> np.ndarray:
    assert experiment is not None
    assert (experiment.channel, experiment.drive) == (Channel.POSITION, "voltage")
    shape = Shape[experiment.shape.upper()]
    return waved(shape, experiment.amplitude, experiment.frequency_hz, experiment.offset)


@pytest.mark.parametrize(
    ("effect", "numbers", "shape", "frequency_hz"),
    [
        ("dead_zone", {"half_width_v": 0.1}, Shape.SQUARE, 0.4),
        ("delay", {"delay_s": 0.015}, Shape.SINE, 0.4),
    ],
)
def test_what_one_waveform_leaves_open_the_proposed_one_tells(
    effect: str, numbers: dict[str, float], shape: Shape, frequency_hz: float
) -> None:
    """Two levels take a dead zone for a gain that is off, a sine a delay for a time constant that is."""
    rig = PAPER.with_effect(Channel.POSITION, effect, numbers)
    first = run_of(rig, waved(shape, 1.0, frequency_hz), 3)
    open_ = discover(first, PAPER)
    assert open_.verdict is Verdict.PARAMETERS_ONLY
    assert effect in open_.effects[0].alternatives
    second = run_of(rig, proposed(open_.next_experiment), 4)
    told = discover(second, PAPER, validation=first)
    assert [(e.name, e.channel, e.alternatives) for e in told.effects] == [(effect, Channel.POSITION, ())]
