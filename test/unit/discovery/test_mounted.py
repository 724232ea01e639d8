"""A piston's spring may be mounted about another place when another run begins."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))

from valves import PAPER, TIME_S

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import ModelSpec
from dt_station_nodes.core.models.effects import Attachment
from dt_station_nodes.core.run import Run
from dt_station_nodes.discovery import DiscoverySettings
from dt_station_nodes.discovery.candidates import Candidate, add_effect
from dt_station_nodes.discovery.mounted import mounted_anywhere, spring_of
from dt_station_nodes.discovery.problem import Problem, make_problem
from dt_station_nodes.discovery.unseen import unseen_residual

SAMPLE_S, PARTS = 0.02, 100
PISTON = PAPER.paths[Channel.POSITION].model_copy(update={"effects": (), "disturbance": None})
SPEC = ModelSpec(name="piston", paths={Channel.POSITION: PISTON})
POLE = PISTON.denominator[1]
GAIN = PISTON.scale * PISTON.numerator[0] / POLE
PER_M3 = 600.0


def problem(centre_m: float, start_m: float, beside: float = 0.0) -> Problem:
    """A piston pulled at by a spring, and by what goes `beside` with the voltage's square, by its own integration."""
    voltage = 2.0 * np.sin(2.0 * np.pi * 0.2 * TIME_S)
    step_s, place, speed, places = SAMPLE_S / PARTS, start_m, 0.0, []
    for now in map(float, voltage):
        places.append(place)
        for _ in range(PARTS):
            force = PER_M3 * (place - centre_m) ** 3 - beside * now**2
            speed += step_s * POLE * (GAIN * (now - force) - speed)
            place += step_s * speed
    noise = 1e-4 * np.random.default_rng(5).standard_normal(len(places))
    signals = {"servo_voltage_v": voltage, "position_m": np.array(places) + noise}
    return make_problem(Run(SAMPLE_S, signals), SPEC, Channel.POSITION, DiscoverySettings())


SPRING = add_effect(PISTON, Candidate("cubic_stiffness"), {"coefficient": PER_M3, "centre": 0.3})


@pytest.mark.parametrize("centre_m", [0.3, 0.42, 0.24])
def test_where_a_spring_is_mounted_is_no_gap_of_another_run(centre_m: float) -> None:
    other = problem(centre_m, centre_m - 0.03)
    assert np.std(unseen_residual(other, SPRING)) < 1.1 * other.noise
    assert bool(np.std(other.residual(SPRING)) < 1.1 * other.noise) is (centre_m == 0.3)
    moved, _ = mounted_anywhere(other, SPRING, spring_of(SPRING), other.residual(SPRING))
    assert moved.effect("cubic_stiffness").parameters["centre"] == pytest.approx(centre_m, abs=0.003)


def test_what_no_place_of_it_explains_leaves_it_where_it_was() -> None:
    other = problem(0.42, 0.4, beside=0.2)
    left = other.residual(SPRING)
    path, same = mounted_anywhere(other, SPRING, spring_of(SPRING), left)
    assert path is SPRING
    assert np.array_equal(same, left)


def test_a_pressures_spring_stays_where_it_is() -> None:
    other = problem(0.42, 0.4)
    still = replace(other, windows=replace(other.windows, anchored=False))
    left = still.residual(SPRING)
    assert mounted_anywhere(still, SPRING, spring_of(SPRING), left)[0] is SPRING


def test_only_a_piston_has_a_spring_that_is_mounted_anew() -> None:
    assert spring_of(PISTON) is None
    slack = add_effect(PISTON, Candidate("cubic_stiffness"), {"coefficient": 0.0, "centre": 0.3})
    assert spring_of(slack) is None
    assert spring_of(add_effect(PISTON, Candidate("cubic_stiffness", Attachment.OUTPUT), {"coefficient": 1.0})) is None
