"""One path alone: the same as in the whole model, whatever of it is simulated apart or once for all."""

import pickle
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import EffectSpec, ModelSpec, PathSimulator, PathSpec, PlantModel, single
from dt_station_nodes.core.models.effects import Attachment, registry
from dt_station_nodes.core.models.spec import DisturbanceSpec, Outlet

PAPER = ModelSpec.from_yaml((Path(__file__).parents[4] / "config" / "models" / "paper.yaml").read_text())
SAMPLE_S = 0.02
SAMPLES = 300
# On the output an effect remembers what was measured first, which a whole model does not know.
PLACES = [
    (name, at)
    for name, effect in sorted(registry().items())
    if Channel.POSITION in effect.channels
    for at in effect.places(Channel.POSITION)
    if at is not Attachment.OUTPUT
]


def drive():
    time = np.arange(SAMPLES) * SAMPLE_S
    servo = 1.5 * np.sin(2.0 * np.pi * 0.7 * time) + 0.4 * np.sign(np.sin(2.0 * np.pi * 1.3 * time))
    servo[0] = 0.0
    pressure = 1e6 + 1.5e6 * (1.0 - np.cos(2.0 * np.pi * 0.4 * time))
    return servo, pressure


def parameters(effect):
    hertz = {p.name: 2.0 for p in effect.parameters if p.name.endswith("_hz")}
    started = {p.name: p.starts[-1] for p in effect.parameters if p.starts}
    return effect.complete({**started, **hertz})


@pytest.mark.parametrize(("name", "at"), PLACES)
def test_alone_a_path_does_what_it_does_in_the_whole_model(name, at):
    servo, pressure = drive()
    effect = EffectSpec(name=name, at=at, parameters=parameters(registry()[name]))
    path = PAPER.paths[Channel.POSITION].model_copy(update={"effects": (effect,)})
    whole = ModelSpec(name="whole", paths={**PAPER.paths, Channel.POSITION: path})
    load_voltage = np.sin(np.arange(SAMPLES) / 9.0)
    made = PlantModel(whole, SAMPLE_S).simulate(load_voltage, servo, pressure, interpolate_pressure=True)
    alone = PathSimulator(Channel.POSITION, SAMPLE_S, servo, pressure, 1e6, 0.0, other_v=load_voltage)
    assert alone.simulate(path) == pytest.approx(made.position_m, rel=1e-9, abs=1e-9 * np.ptp(made.position_m))


def stopping(limit):
    overflow = EffectSpec(name="overflow", parameters={"limit": limit, "standing": 1.0})
    return PAPER.paths[Channel.POSITION].model_copy(update={"effects": (overflow,)})


def test_steps_back_to_where_a_path_was_measured_do_not_show_in_it():
    servo, pressure = drive()
    alone = PathSimulator(Channel.POSITION, SAMPLE_S, servo, pressure, 1e6, 0.0)
    far = stopping(10.0)
    free = alone.simulate(far)
    drifting = free + np.linspace(0.0, 0.01, SAMPLES)
    assert alone.simulate_beside(far, drifting) == pytest.approx(free, abs=1e-12)


def test_a_piston_whose_place_is_misjudged_meets_its_stop_where_it_was_measured():
    servo, pressure = drive()
    piston = stopping(0.04)
    noise = 1e-4 * np.random.default_rng(3).standard_normal(SAMPLES)
    true = PathSimulator(Channel.POSITION, SAMPLE_S, servo, pressure, 1e6, 0.0).simulate(piston)
    off = PathSimulator(Channel.POSITION, SAMPLE_S, servo, pressure, 1e6, 0.005)
    adrift, beside = off.simulate(piston), off.simulate_beside(piston, true + noise)
    assert true.max() == pytest.approx(0.04)
    assert np.std(adrift - true) > 1e-3
    assert np.std(beside - true) < 5e-5


def test_what_the_load_does_goes_with_the_disturbance_gain():
    servo, pressure = drive()
    path = PAPER.paths[Channel.POSITION]
    alone = PathSimulator(Channel.POSITION, SAMPLE_S, servo, pressure, 1e6, 0.0)
    given, twice, none = (
        alone.simulate(path.model_copy(update={"disturbance": path.disturbance.model_copy(update={"gain": gain})}))
        for gain in (1.0, 2.0, 0.0)
    )
    assert twice - none == pytest.approx(2.0 * (given - none), abs=1e-12)
    assert np.ptp(given - none) > 1e-4


def test_what_the_load_does_in_other_times_is_told_apart_and_not_kept_for_ever(monkeypatch):
    servo, pressure = drive()
    path = PAPER.paths[Channel.POSITION]
    alone = PathSimulator(Channel.POSITION, SAMPLE_S, servo, pressure, 1e6, 0.0)
    monkeypatch.setattr(single, "_REMEMBERED", 20 * 8 * len(servo))

    def answer(time_scale):
        away = path.disturbance.model_copy(update={"time_scale": time_scale})
        return alone.simulate(path.model_copy(update={"disturbance": away}))

    given = answer(1.0)
    others = [answer(1.0 + 0.01 * k) for k in range(1, 60)]
    assert np.ptp(others[-1] - given) > 1e-4
    assert len(alone._answers) == 20
    assert answer(1.0) == pytest.approx(given, abs=0.0)


CHANGES = {
    "gain": 1.1,
    "time_scale": 1.1,
    "scale": 0.02,
    "rest": 0.5,
    "outlet": Outlet.FASTEST,
    "numerator": (1.2,),
    "denominator": (1.0, 9.0, 25.0),
    "effects": (EffectSpec(name="leakage", parameters={"coefficient": 0.2}),),
}


AWAY_CHANGES = {
    "gain": 2.0,
    "time_scale": 1.3,
    "input_scale": 2e-6,
    "numerator": (0.02,),
    "denominator": (1.0, 9.0, 0.0),
}


def test_all_that_tells_one_path_from_another_is_looked_at_below():
    assert set(PathSpec.model_fields) == {*CHANGES, "disturbance"}
    assert set(DisturbanceSpec.model_fields) == set(AWAY_CHANGES)


@pytest.mark.parametrize("name", AWAY_CHANGES)
@pytest.mark.parametrize("inside", [False, True])
def test_a_load_that_acts_otherwise_is_simulated(name, inside):
    servo, pressure = drive()
    path = PAPER.paths[Channel.POSITION]
    if inside:
        # What acts behind the voltage is simulated with the load.
        path = path.model_copy(update={"effects": (EffectSpec(name="friction", parameters={"coulomb_v": 0.1}),)})
    away = path.disturbance.model_copy(update={name: AWAY_CHANGES[name]})
    other = path.model_copy(update={"disturbance": away})
    alone, fresh = (PathSimulator(Channel.POSITION, SAMPLE_S, servo, pressure, 1e6, 0.0) for _ in range(2))
    given, changed = alone.simulate(path), alone.simulate(other)
    assert np.ptp(changed - given) > 1e-5
    assert np.array_equal(changed, fresh.simulate(other))


@pytest.mark.parametrize("name", CHANGES)
def test_a_path_that_differs_in_anything_is_simulated_and_one_that_does_not_is_remembered(name, monkeypatch):
    voltage, _ = drive()
    leak = EffectSpec(name="leakage", parameters={"coefficient": 0.1})
    path = PathSpec(numerator=[1.0], denominator=[1.0, 7.0, 10.0], scale=0.01, effects=[leak])
    other = path.model_copy(update={name: CHANGES[name]})
    alone = PathSimulator(Channel.PRESSURE, SAMPLE_S, voltage, np.zeros(0), 0.0, 0.0)
    given, changed = alone.simulate(path), alone.simulate(other)
    assert np.ptp(changed - given) > 1e-6
    fresh = PathSimulator(Channel.PRESSURE, SAMPLE_S, voltage, np.zeros(0), 0.0, 0.0)
    assert np.array_equal(changed, fresh.simulate(other))
    monkeypatch.setattr(PathSimulator, "_simulate", None)
    assert np.array_equal(alone.simulate(path), given)


def test_what_a_path_remembers_of_the_load_stays_in_its_process():
    """A thread packs tasks for other processes while this one goes on remembering."""
    servo, pressure = drive()
    alone = PathSimulator(Channel.POSITION, SAMPLE_S, servo, pressure, 1e6, 0.0, first_velocity=0.01)
    fresh = pickle.dumps(alone)
    path = PAPER.paths[Channel.POSITION]
    answer = alone.simulate(path)
    assert pickle.dumps(alone) == fresh
    sent = pickle.loads(fresh)
    assert sent is not alone
    assert np.array_equal(sent.simulate(path), answer)


def test_a_process_that_is_sent_a_simulator_again_goes_on_with_what_it_remembers(monkeypatch):
    servo, pressure = drive()
    path = PAPER.paths[Channel.POSITION]
    packed = [
        pickle.dumps(PathSimulator(Channel.POSITION, SAMPLE_S, k * servo, pressure, 1e6, 0.0)) for k in range(1, 10)
    ]
    answers = [pickle.loads(each).simulate(path) for each in packed]
    assert all(np.ptp(one - other) > 1e-4 for one, other in pairwise(answers))
    assert len(single._UNPACKED) == single._MOST_UNPACKED
    first = pickle.loads(packed[0]).simulate(path)
    assert np.array_equal(first, answers[0])
    monkeypatch.setattr(PathSimulator, "_simulate", None)
    assert np.array_equal(pickle.loads(packed[-1]).simulate(path), answers[-1])


def test_a_path_of_one_state_begins_where_it_was_measured_however_fast_it_moved():
    lag = PathSpec(numerator=[30.0], denominator=[1.0, 25.0], rest=0.0)
    voltage = np.linspace(1.0, 2.0, 50)
    still, moving = (
        PathSimulator(Channel.POSITION, 2e-3, voltage, np.zeros(0), 0.0, 0.4, first_velocity=velocity).simulate(lag)
        for velocity in (None, 60.0)
    )
    assert moving == pytest.approx(still)
    assert moving[0] == pytest.approx(0.4)


def long_run(seconds: float) -> PathSimulator:
    time = np.arange(round(seconds / SAMPLE_S)) * SAMPLE_S
    load = 1e6 + 1.5e6 * (1.0 - np.cos(2.0 * np.pi * 0.4 * time))
    return PathSimulator(Channel.POSITION, SAMPLE_S, np.sin(2.0 * np.pi * 0.7 * time), load, 1e6, 0.0)


def test_a_long_run_is_simulated_coarsely_in_half_the_sub_steps_and_does_about_the_same():
    path = PAPER.paths[Channel.POSITION].model_copy(
        update={"effects": (EffectSpec(name="cubic_stiffness", parameters={"coefficient": 500.0}),)}
    )
    exact = long_run(45.0)
    coarse = exact.coarse(path)
    as_it_is, about = exact.simulate(path), coarse.simulate(path)
    assert 0.0 < np.std(about - as_it_is) < 1e-3 * np.std(as_it_is)
    assert np.array_equal(coarse._simulate(path, 2), about)
    assert np.array_equal(exact._simulate(path, 4), as_it_is)


def test_what_was_simulated_coarsely_and_as_it_is_is_remembered_together_and_told_apart(monkeypatch):
    path = PAPER.paths[Channel.POSITION]
    exact = long_run(60.0)
    about, as_it_is = exact.coarse(path).simulate(path), exact.simulate(path)
    assert not np.array_equal(about, as_it_is)
    monkeypatch.setattr(PathSimulator, "_simulate", None)
    assert np.array_equal(exact.coarse(path).simulate(path), about)
    assert np.array_equal(exact.simulate(path), as_it_is)


def test_nothing_is_saved_on_a_short_run_or_a_path_of_one_sub_step_a_sample():
    alone = PathSpec(numerator=[30.0], denominator=[1.0, 25.0])
    short, long = long_run(24.0), long_run(60.0)
    assert short.coarse(PAPER.paths[Channel.POSITION]) is short
    assert long.coarse(alone) is long


def test_a_slow_plant_with_the_most_sub_steps_a_sample_is_not_simulated_coarsely():
    store = PathSpec(numerator=[1.0], denominator=[160.0, 28.0, 1.0])
    spec = ModelSpec(name="store", paths={Channel.POSITION: store})
    path = spec.with_effect(Channel.POSITION, "overflow", {"limit": 2.0}).paths[Channel.POSITION]
    slowly = PathSimulator(Channel.POSITION, 2.0, np.ones(20_000), np.zeros(0), 0.0, 0.0)
    quickly = PathSimulator(Channel.POSITION, 0.02, np.ones(20_000), np.zeros(0), 0.0, 0.0)
    assert slowly.coarse(path) is slowly
    assert quickly.coarse(path) is not quickly
