"""A gain that steps shows in a residual when and by how much it does."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))

from valves import BARE, SPEC, TIME_S, WAVES, answered

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.run import Run
from dt_station_nodes.discovery import discover
from dt_station_nodes.discovery.gain_steps import gain_steps
from dt_station_nodes.discovery.problem import make_problem
from dt_station_nodes.discovery.settings import DiscoverySettings


def run(wave: int, *steps: tuple[float, float]) -> Run:
    """Pressure of a valve whose gain changes at once, each of `steps` its size and its time (s)."""
    given = 2.0 + 1.2 * WAVES[wave]
    gain = 1.0 + sum(size * (at_s <= TIME_S) for size, at_s in steps)
    return answered(given, given * gain, wave)


def found(steps: Run) -> dict[str, float]:
    problem = make_problem(steps, SPEC, Channel.PRESSURE, DiscoverySettings())
    return gain_steps(problem, BARE)


@pytest.mark.parametrize("wave", [0, 1])
@pytest.mark.parametrize("steps", [((-0.2, 9.3),), ((0.15, 6.1), (-0.3, 17.7))])
def test_steps_are_found_where_and_as_large_as_they_were_made(
    wave: int, steps: tuple[tuple[float, float], ...]
) -> None:
    numbers = found(run(wave, *steps))
    assert len(numbers) == 2 * len(steps)
    for name, (size, at_s) in zip(("jump", "second_jump"), steps, strict=False):
        assert numbers[name] == pytest.approx(size, abs=0.02)
        assert numbers[f"{name}_s"] == pytest.approx(at_s, abs=0.15)


def test_a_gain_that_is_only_another_has_no_steps() -> None:
    given = 2.0 + 1.2 * WAVES[0]
    assert found(answered(given, 1.1 * given, 0)) == {}
    assert found(answered(given, given, 0)) == {}


def test_a_limit_is_no_step() -> None:
    given = 2.0 + 1.2 * WAVES[0]
    assert found(answered(given, np.minimum(given, 2.8), 0)) == {}


def test_a_gain_that_steps_is_gain_drift_with_its_numbers() -> None:
    result = discover(run(0, (-0.15, 8.0), (0.1, 15.5)), SPEC, validation=run(1, (-0.15, 8.0), (0.1, 15.5)))
    (effect,) = result.effects
    assert effect.name == "gain_drift"
    assert effect.parameters["jump"].value == pytest.approx(-0.15, abs=0.01)
    assert effect.parameters["second_jump_s"].value == pytest.approx(15.5, abs=0.05)
    assert result.gap.after[Channel.PRESSURE].rms < 1.05 * result.gap.noise_floor[Channel.PRESSURE].rms
