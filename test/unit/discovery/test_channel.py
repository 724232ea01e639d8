"""What one channel answers where a limit is only come near, where much is left, and where a refit is enough."""

import numpy as np
import pytest
from scipy import signal

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import ModelSpec, PathSimulator
from dt_station_nodes.core.run import Run
from dt_station_nodes.discovery import DiscoveryResult, Verdict, discover

STEP_S = 0.02
TIME_S = STEP_S * np.arange(1200)
AXIS = ModelSpec.model_validate(
    {
        "name": "axis",
        "source": "made up",
        "paths": {"position": {"numerator": [2.0], "denominator": [1.0, 23.0, 0.0]}},
    }
)


def found_in(spec: ModelSpec, voltage: np.ndarray, noise_m: float = 1e-5) -> DiscoveryResult:
    """The answer to a run of `spec` (n,) V where the plain axis is known."""
    position = PathSimulator(Channel.POSITION, STEP_S, voltage, np.zeros(0), 0.0, 0.0).simulate(
        spec.paths[Channel.POSITION]
    )
    noise = noise_m * np.random.default_rng(3).standard_normal(voltage.size)
    return discover(Run(STEP_S, {"servo_voltage_v": voltage, "position_m": position + noise}), AXIS, jobs=2)


@pytest.mark.parametrize("knee", [0.2, 0.5])
def test_a_limit_that_the_run_only_comes_near_shows_by_its_bend(knee: float) -> None:
    voltage = 5.5 * signal.sawtooth(2.0 * np.pi * 0.4 * TIME_S, 0.5)
    limited = AXIS.with_effect(Channel.POSITION, "saturation", {"upper_v": 6.0, "lower_v": -6.0, "knee": knee})
    result = found_in(limited, voltage)
    assert [effect.name for effect in result.effects] == ["saturation"]
    assert result.effects[0].parameters["knee"].value == pytest.approx(knee, rel=0.3)


def test_a_linear_path_that_fits_to_a_hundredth_lacks_nothing_with_a_name() -> None:
    """An oscillator read a twentieth of a sample early: no path of its order can lead, and nothing is missing."""
    fine, n = 20, 3000
    drive = np.repeat(np.random.default_rng(8).standard_normal(n // 5), 5)
    b, a = signal.butter(2, 6.0 * 2.0 * STEP_S, fs=2.0)
    mode = signal.cont2discrete(([180.0], [1.0, 2.0, 180.0]), STEP_S / fine, "zoh")
    answer = signal.lfilter(np.ravel(mode[0]), mode[1], np.repeat(signal.lfilter(b, a, drive), fine))
    early = answer[1::fine]
    run = Run(STEP_S, {"servo_voltage_v": signal.lfilter(b, a, drive)[: early.size], "position_m": early})
    model = {"name": "m", "paths": {"position": {"numerator": [140.0], "denominator": [1.0, 2.5, 200.0]}}}
    result = discover(run, ModelSpec.model_validate(model), jobs=2)
    assert result.verdict is Verdict.PARAMETERS_ONLY
