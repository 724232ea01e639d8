"""Loops in one process: stepping the classes by hand gives the same bits; integral action leaves no error."""

import numpy as np
import pytest

from dt_station_nodes.core.closed_loop import ModelPlant, run_loops
from dt_station_nodes.core.control import ControlInput, LoopController
from dt_station_nodes.core.errors import StationError
from dt_station_nodes.core.models import ModelInput, PlantModel
from support.controllers import controller, paper_model

SAMPLE_TIME_S = 0.02


def loops() -> tuple[LoopController, LoopController]:
    return tuple(LoopController(controller(n), SAMPLE_TIME_S) for n in ("pressure_pi", "position_pid"))


def test_it_is_the_classes_stepped_by_hand() -> None:
    load, position = loops()
    model = PlantModel(paper_model(), SAMPLE_TIME_S)
    run = run_loops(ModelPlant(model), load, position, np.full(80, 2e6), np.full(80, 0.05))
    state, a, b = model.initial_state(), load.initial_state(), position.initial_state()
    for k in range(80):
        seen = model.output(state)
        a, u = load.step(a, ControlInput(2e6, seen.pressure_pa, seen.pressure_pa))
        b, v = position.step(b, ControlInput(0.05, seen.position_m, seen.pressure_pa))
        row = (seen.pressure_pa, seen.position_m, u.voltage_v, v.voltage_v)
        names = ("pressure_pa", "position_m", "load_voltage_v", "servo_voltage_v")
        assert tuple(run.signals[name][k] for name in names) == row
        state, said = model.step(state, ModelInput(u.voltage_v, v.voltage_v))
        assert said == seen


def test_both_loops_arrive() -> None:
    load, position = loops()
    plant = ModelPlant(PlantModel(paper_model(), SAMPLE_TIME_S))
    run = run_loops(plant, load, position, np.full(400, 3e6), np.full(400, 0.1))
    assert run.signals["pressure_pa"][-1] == pytest.approx(3e6, rel=1e-6)
    assert run.signals["position_m"][-1] == pytest.approx(0.1, abs=2e-5)


def test_set_points_of_different_length_are_refused() -> None:
    plant = ModelPlant(PlantModel(paper_model(), SAMPLE_TIME_S))
    with pytest.raises(StationError, match="same number of samples"):
        run_loops(plant, *loops(), np.zeros(3), np.zeros(4))
