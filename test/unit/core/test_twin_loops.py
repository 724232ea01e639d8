"""A twin with its own loops answers by its inputs alone, whichever of them comes first."""

from itertools import permutations
from pathlib import Path

import pytest

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.control import LoopConfig, LoopController
from dt_station_nodes.core.models import ModelSpec, PlantModel
from dt_station_nodes.core.samples import PlantSample, Setpoint
from dt_station_nodes.core.twin_loops import TwinLoops

CONFIG = Path(__file__).parents[3] / "config"
STEP_S = 0.02
SAMPLE = PlantSample(0, 10**9, 0.0, 1.0e6, 0.0, 0.0)
NEXT = PlantSample(1, 10**9 + 20_000_000, 0.0, 1.0e6, 0.0, 0.0)
BOTH = frozenset(Channel)


@pytest.fixture(scope="module")
def loops() -> TwinLoops:
    controllers = [
        LoopController(LoopConfig.from_yaml((CONFIG / "controllers" / f"{name}.yaml").read_text()), STEP_S)
        for name in ("pressure_pi", "position_pid")
    ]
    model = PlantModel(ModelSpec.from_yaml((CONFIG / "models" / "paper.yaml").read_text()), STEP_S)
    return TwinLoops(model, *controllers)


def setpoints(k: int) -> list[tuple[Channel, Setpoint]]:
    return [
        (Channel.PRESSURE, Setpoint(k, SAMPLE.stamp_ns, 3.0e6, True)),
        (Channel.POSITION, Setpoint(k, SAMPLE.stamp_ns, 0.01, True)),
    ]


@pytest.mark.parametrize("order", list(permutations(range(3))))
def test_the_first_sample_waits_for_set_points_that_have_a_publisher(loops: TwinLoops, order: tuple[int, ...]) -> None:
    state, answers = loops.initial_state(), []
    for i in order:
        if i == 2:
            state, done = loops.on_sample(state, SAMPLE, BOTH)
        else:
            state, done = loops.on_setpoint(state, *setpoints(0)[i])
        answers += done
    for channel, setpoint in setpoints(1):
        state, done = loops.on_setpoint(state, channel, setpoint)
        answers += done
    state, done = loops.on_sample(state, NEXT)
    answers += done
    assert [sample.sequence for sample in answers] == [0, 1]
    assert answers[1].load_voltage_v > 0.0
    assert answers[1].servo_voltage_v > 0.0
    assert state.late == 0


def test_without_a_publisher_the_set_points_of_rest_stand(loops: TwinLoops) -> None:
    _, done = loops.on_sample(loops.initial_state(), SAMPLE)
    assert [sample.sequence for sample in done] == [0]


def test_a_publisher_that_stays_silent_is_waited_for_only_so_long(loops: TwinLoops) -> None:
    state, answers = loops.initial_state(), []
    for k in range(30):
        state, done = loops.on_sample(state, PlantSample(k, k * 20_000_000, 0.0, 1.0e6, 0.0, 0.0), BOTH)
        answers += done
    assert [sample.sequence for sample in answers] == list(range(10))
    assert state.late == 10
