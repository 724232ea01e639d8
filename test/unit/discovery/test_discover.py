"""The whole of discovery on runs made by forms of their own (`cases`)."""

import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import signal

sys.path.insert(0, str(Path(__file__).parent))

from cases import Case, make
from far_workers import FarWorkers

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import ModelSpec, PathSimulator
from dt_station_nodes.core.run import Run
from dt_station_nodes.discovery import DiscoverySettings, UnusableRunError, Verdict, discover

PAPER = ModelSpec.from_yaml(
    (Path(__file__).resolve().parents[3] / "config" / "models" / "paper.yaml").read_text(encoding="utf-8")
)


def only(channel):
    """The paper's model with one path: half the time of both."""
    paths = {c: p for c, p in PAPER.paths.items() if c.value == channel}
    return PAPER.model_copy(update={"paths": paths})


@pytest.mark.parametrize(
    ("name", "channel"),
    [
        ("dead_zone", "position"),
        ("saturation", "pressure"),
        ("hysteresis", "pressure"),
        ("friction", "position"),
        ("delay", "pressure"),
        ("extra_lag", "pressure"),
        ("leakage", "position"),
        ("periodic_disturbance", "pressure"),
    ],
)
def test_single_effect_is_named_and_the_gap_falls_to_the_noise(name, channel):
    effects = ((name, channel, 1.0),)
    run = make(Case(effects=effects, seconds=24.0))
    unseen = make(Case(effects=effects, seconds=24.0, shape="triangle", seed=3))
    result = discover(run, only(channel), unseen)
    assert result.verdict is Verdict.NAMED
    assert [(e.name, e.channel.value) for e in result.effects] == [(name, channel)]
    place = Channel(channel)
    assert result.gap.after[place].rms < 1.1 * result.gap.noise_floor[place].rms
    assert result.gap.validation_before[place].rms > 1.2 * result.gap.validation_after[place].rms


@pytest.mark.parametrize("pace", [0.005, 1.0, 500.0])
def test_a_rig_of_any_pace_is_read_alike(pace):
    """Only the clock differs: from a fast magnet to a slow oven the same effect is found, its times so much longer."""
    run = make(Case(effects=(("extra_lag", "pressure", 1.0),), seconds=24.0))
    rig = Run(run.sample_time_s * pace, run.signals)
    path = PAPER.paths[Channel.PRESSURE].model_copy(update={"time_scale": pace})
    result = discover(rig, PAPER.model_copy(update={"paths": {Channel.PRESSURE: path}}))
    assert [e.name for e in result.effects] == ["extra_lag"]
    assert result.effects[0].parameters["time_constant_s"].value == pytest.approx(0.05 * pace, rel=0.2)


def test_two_effects_are_both_named():
    run = make(Case(effects=(("dead_zone", "position", 1.0), ("delay", "position", 1.0)), seconds=24.0))
    result = discover(run, only("position"))
    assert {e.name for e in result.effects} == {"dead_zone", "delay"}


@pytest.mark.parametrize("seed", [1, 2])
def test_nothing_is_named_where_nothing_is_missing(seed):
    result = discover(make(Case(seed=seed, seconds=24.0)), PAPER)
    assert result.verdict is Verdict.NOTHING_MISSING
    assert not result.effects


def test_a_mismatch_is_parameters_only():
    result = discover(make(Case(gain_error=0.05, time_error=0.1, seconds=24.0)), PAPER)
    assert result.verdict is Verdict.PARAMETERS_ONLY
    assert {e.name for e in result.effects} == {"parameter_mismatch"}
    assert result.nominal["position gain"].value == pytest.approx(1.05, abs=0.02)


def test_a_load_that_acts_faster_than_the_model_says_is_no_effect():
    """Its time constants may be off as the valve's may, by their own share."""
    path = PAPER.paths[Channel.POSITION]
    quick = PAPER.with_path(Channel.POSITION, disturbance=path.disturbance.model_copy(update={"time_scale": 0.6}))
    result = discover(make(Case(seconds=24.0, shape="square")), quick)
    assert result.verdict is Verdict.PARAMETERS_ONLY
    assert result.nominal["position disturbance_time_scale"].value == pytest.approx(1.0, abs=0.06)


@pytest.mark.parametrize("name", ["stroke_dependent_gain", "memory"])
def test_effects_outside_the_vocabulary_are_not_named(name):
    result = discover(make(Case(effects=((name, "position", 1.0),), seconds=24.0)), only("position"))
    assert result.verdict is Verdict.UNEXPLAINED
    assert not result.effects
    assert "no named effect explains" in result.sentence


def test_a_frozen_sensor_is_said_not_named():
    result = discover(make(Case(effects=(("frozen_sensor", "pressure", 0.5),), seconds=24.0)), only("pressure"))
    assert result.verdict is Verdict.UNEXPLAINED
    assert any("frozen" in note for note in result.data_notes)


def test_json_holds_the_contract_and_workers_change_nothing():
    run = make(Case(effects=(("hysteresis", "pressure", 1.0),), seconds=24.0))
    one = discover(run, only("pressure"), settings=DiscoverySettings(max_effects=1))
    two = discover(run, only("pressure"), settings=DiscoverySettings(max_effects=1, jobs=2))
    answer = one.to_json()
    assert json.dumps(answer) == json.dumps(two.to_json())
    assert set(answer) == {"verdict", "effects", "where", "gap", "next_experiment", "run"}
    assert set(answer["gap"]) == {"before", "after", "noise_floor", "validation"}
    effect = answer["effects"][0]
    assert set(effect) == {"name", "channel", "confidence", "parameters", "alternatives", "why"}
    assert (effect["name"], effect["channel"]) == ("hysteresis", "pressure")
    assert all(set(p) == {"value", "ci95", "unit"} for p in effect["parameters"].values())
    assert ModelSpec.from_yaml(one.model.to_yaml()) == one.model


def test_a_band_that_no_voltage_lies_in_is_the_valves_and_may_be_a_bias() -> None:
    """A proportional valve at positive voltages only: both take off the same constant."""
    path = PAPER.paths[Channel.PRESSURE]
    band = {"half_width_v": 0.125}
    wide = path.model_copy(
        update={"effects": (path.effects[0].model_copy(update={"parameters": band}), path.effects[1])}
    )

    def run(voltage: np.ndarray, seed: int) -> Run:
        pressure = PathSimulator(Channel.PRESSURE, 0.02, voltage, np.zeros(0), 1e6, 1e6).simulate(wide)
        noise = 0.01 * np.std(pressure) * np.random.default_rng(seed).standard_normal(len(pressure))
        return Run(0.02, {"load_voltage_v": voltage, "pressure_pa": pressure + noise})

    time = np.arange(1200) * 0.02
    square, sine = (1.9 + 1.5 * shape(1.1 * time) for shape in (lambda x: np.sign(np.sin(x)), np.sin))
    (effect,) = discover(run(square, 1), only("pressure"), validation=run(sine, 2)).effects
    assert effect.name == "dead_zone"
    assert "bias" in effect.alternatives


def test_interrupted_search_of_given_workers_says_what_it_knows():
    workers = FarWorkers()

    def interrupt(text):
        if "hysteresis" in text:
            raise KeyboardInterrupt

    run = make(Case(effects=(("hysteresis", "pressure", 1.0),), seconds=24.0))
    result = discover(run, only("pressure"), progress=interrupt, workers=workers)
    assert result.interrupted
    assert max(workers.asked) > 10


def test_unusable_runs_are_refused_in_one_sentence():
    run = make(Case(seconds=4.0))
    short = run.window(0, 50)
    with pytest.raises(UnusableRunError, match="50 samples"):
        discover(short, PAPER)
    broken = dict(run.signals)
    broken["pressure_pa"] = np.where(np.arange(len(run)) == 7, np.nan, broken["pressure_pa"])
    with pytest.raises(UnusableRunError, match="pressure_pa is not a number in row 8"):
        discover(replace(run, signals=broken), PAPER)
    with pytest.raises(UnusableRunError, match="no channel"):
        discover(Run(0.02, {"pressure_pa": np.zeros(200)}), PAPER)


@pytest.mark.parametrize("half_width_v", [0.1, 0.2])
def test_what_two_levels_cannot_tell_from_a_gain_another_waveform_does(half_width_v):
    """On a square of two voltages a loop takes off gain and nothing else; on a triangle both differ."""
    path = only("position").paths[Channel.POSITION].model_copy(update={"disturbance": None})
    spec = PAPER.model_copy(update={"paths": {Channel.POSITION: path}})
    hidden = spec.with_effect(Channel.POSITION, "hysteresis", {"half_width_v": half_width_v})

    def run(wave, seed):
        time_s = np.arange(1200) * 0.02
        voltage = 2.0 * wave(2.0 * np.pi * 0.65 * time_s + 0.3)
        simulator = PathSimulator(Channel.POSITION, 0.02, voltage, np.zeros(0), 0.0, 0.0)
        noise = 1e-4 * np.random.default_rng(seed).standard_normal(time_s.size)
        position = simulator.simulate(hidden.paths[Channel.POSITION]) + noise
        return Run(0.02, {"servo_voltage_v": voltage, "position_m": position})

    square, triangle = run(signal.square, 1), run(lambda phase: signal.sawtooth(phase, 0.5), 2)
    alone = discover(square, spec)
    assert alone.verdict is not Verdict.NAMED
    both = discover(square, spec, validation=triangle)
    assert both.verdict is Verdict.NAMED
    (found,) = both.effects
    # Without a feedback that hunts, play in a linkage shows as the valve's does.
    assert "hysteresis" in {found.name, *found.alternatives} <= {"hysteresis", "backlash"}


def test_an_effect_that_only_the_validation_run_shows_is_found_there():
    """A limit that one run keeps within and the other does not: the runs change places, and the report says so."""
    path = only("position").paths[Channel.POSITION].model_copy(update={"disturbance": None})
    spec = PAPER.model_copy(update={"paths": {Channel.POSITION: path}})
    hidden = spec.with_effect(Channel.POSITION, "saturation", {"upper_v": 2.0, "lower_v": -2.0})

    def run(peak_v, seed):
        voltage = peak_v * np.sin(2.0 * np.pi * 0.4 * np.arange(900) * 0.02)
        simulator = PathSimulator(Channel.POSITION, 0.02, voltage, np.zeros(0), 0.0, 0.0)
        noise = 1e-4 * np.random.default_rng(seed).standard_normal(900)
        position = simulator.simulate(hidden.paths[Channel.POSITION]) + noise
        return Run(0.02, {"servo_voltage_v": voltage, "position_m": position})

    small, large = run(1.5, 1), run(3.0, 2)
    result = discover(small, spec, validation=large)
    assert [effect.name for effect in result.effects] == ["saturation"]
    assert any("only the validation run shows" in note for note in result.data_notes)
    limit = result.effects[0].parameters["upper_v"].value
    assert limit == pytest.approx(2.0, rel=0.01)
    assert result.gap.after[Channel.POSITION].rms <= 1.02 * result.gap.before[Channel.POSITION].rms
    fall = result.gap.validation_after[Channel.POSITION].rms / result.gap.validation_before[Channel.POSITION].rms
    assert fall < 0.1
    (turned,) = discover(large, spec, validation=small).effects
    assert turned.parameters["upper_v"].value == pytest.approx(limit, rel=1e-6)


def test_what_the_validation_run_alone_tells_apart_is_found_there():
    """Friction stands for overlap as well while the voltage only ramps; under steps they are two."""
    path = only("position").paths[Channel.POSITION].model_copy(update={"disturbance": None})
    spec = PAPER.model_copy(update={"paths": {Channel.POSITION: path}})
    overlap = spec.with_effect(Channel.POSITION, "dead_zone", {"half_width_v": 0.6})
    hidden = overlap.with_effect(Channel.POSITION, "friction", {"coulomb_v": 0.5}).paths[Channel.POSITION]

    def run(voltage, seed):
        simulator = PathSimulator(Channel.POSITION, 0.02, voltage, np.zeros(0), 0.0, 0.0)
        noise = 1e-4 * np.random.default_rng(seed).standard_normal(len(voltage))
        return Run(0.02, {"servo_voltage_v": voltage, "position_m": simulator.simulate(hidden) + noise})

    levels = np.repeat(np.random.default_rng(5).uniform(-2.5, 2.5, 30), 30)
    ramps = run(2.0 * signal.sawtooth(0.5 * np.pi * np.arange(900) * 0.02 + 0.5 * np.pi, 0.5), 1)
    result = discover(ramps, spec, validation=run(levels - levels.mean(), 2))
    told = {effect.name: effect.parameters for effect in result.effects}
    assert set(told) == {"dead_zone", "friction"}
    assert any("the validation run shows more" in note for note in result.data_notes)
    friction_v, overlap_v = told["friction"]["coulomb_v"].value, told["dead_zone"]["half_width_v"].value
    # Their sum is what the steps must overcome; along it the fit is flat to some hundredths of a volt.
    assert friction_v + overlap_v == pytest.approx(1.1, rel=0.005)
    assert friction_v == pytest.approx(0.5, abs=0.03)
    assert [effect.name for effect in discover(ramps, spec).effects] == ["friction"]
