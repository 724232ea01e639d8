"""A channel as a fitting problem: what its residual says of starts, of runaway simulations and of a noisy load."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import EffectSpec, ModelSpec, PlantModel
from dt_station_nodes.core.run import Run
from dt_station_nodes.discovery.problem import make_problem
from dt_station_nodes.discovery.settings import DiscoverySettings

PAPER = ModelSpec.from_yaml((Path(__file__).resolve().parents[3] / "config/models/paper.yaml").read_text())
STEP_S = 0.02


def station_run(begins: int = 0, load_noise_pa: float = 0.0) -> Run:
    """A run of the paper's model, from its sample `begins` on."""
    time = np.arange(1500) * STEP_S
    load = 2.0 + np.sin(2.0 * np.pi * 0.3 * time)
    servo = 0.5 * np.sign(np.sin(2.0 * np.pi * 0.2 * time))
    model = PlantModel(PAPER, STEP_S)
    out = model.simulate(load, servo, state=model.initial_state())
    hiss = load_noise_pa * np.random.default_rng(3).standard_normal(len(time))
    signals = {
        "load_voltage_v": load,
        "servo_voltage_v": servo,
        "pressure_pa": out.pressure_pa + hiss,
        "position_m": out.position_m,
    }
    return Run(STEP_S, {name: np.ascontiguousarray(values[begins:]) for name, values in signals.items()})


def problem_of(run: Run, channel: Channel):
    return make_problem(run, PAPER, channel, DiscoverySettings())


def test_a_run_that_begins_in_motion_leaves_no_gap():
    for channel in Channel:
        problem = problem_of(station_run(begins=37), channel)
        gap = problem.residual(PAPER.paths[channel])
        assert np.std(gap) < 2e-3 * problem.signal


def test_a_simulation_that_runs_away_is_the_worst_of_all():
    problem = problem_of(station_run(), Channel.POSITION)
    path = PAPER.with_effect(Channel.POSITION, "cubic_stiffness", {"coefficient": -1e5}).paths[Channel.POSITION]
    still = problem.residual(PAPER.paths[Channel.POSITION].model_copy(update={"gain": 1e-9}))
    assert np.sum(problem.residual(path) ** 2) > 1e3 * np.sum(still**2)


def test_a_piston_meets_its_stop_where_it_was_measured_wherever_it_is_thought_to_begin():
    problem = problem_of(station_run(), Channel.POSITION)
    end = problem.simulator.first + 0.4 * float(np.ptp(problem.measured))
    stop = EffectSpec(name="overflow", parameters={"limit": end, "standing": 1.0})
    path = PAPER.paths[Channel.POSITION].model_copy(update={"effects": (stop,)})
    away = replace(problem.simulator, first=problem.simulator.first + 0.005)
    displaced = replace(problem, measured=problem.simulator.simulate(path), simulator=away)
    adrift = float(np.std(displaced.compare(away.simulate(path))))
    assert adrift > 3e-4
    assert np.std(displaced.residual(path)) < 0.1 * adrift


def test_noise_of_the_measured_load_counts_as_no_gap():
    problem = problem_of(station_run(load_noise_pa=5e4), Channel.POSITION)
    assert np.std(problem.residual(PAPER.paths[Channel.POSITION])) < 1.5 * problem.inherited
    assert problem.inherited > 2.0 * problem_of(station_run(), Channel.POSITION).inherited


@pytest.mark.parametrize(("turns", "excited"), [(0.0, True), (0.1, True), (0.4, False)])
@pytest.mark.parametrize("known_hz", [3 * 0.37, 0.37 - 0.15, 0.37 + 0.15])
def test_two_excitations_excite_at_their_harmonics_and_where_they_beat(known_hz: float, turns: float, excited: bool):
    problem = replace(problem_of(station_run(), Channel.POSITION), excitations_hz=(0.37, 0.15))
    assert problem.excited_at(known_hz + turns / problem.length_s, 0.2) is excited


def test_only_a_long_run_is_another_problem_coarsely():
    run = station_run()
    path = PAPER.paths[Channel.POSITION]
    short = problem_of(run, Channel.POSITION)
    assert short.coarse(path) is short
    long = problem_of(Run(STEP_S, {name: np.tile(v, 2) for name, v in run.signals.items()}), Channel.POSITION)
    coarse = long.coarse(path)
    assert coarse.sigma == long.sigma
    gap = coarse.residual(path) - long.residual(path)
    assert 0.0 < np.std(gap) < 1e-3 * long.signal
