"""A large leak that a valve set at rest makes up for there is a leak, however little of it is left to see."""

from pathlib import Path

import numpy as np
from scipy.signal import cont2discrete, tf2ss

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import ModelSpec
from dt_station_nodes.core.run import Run
from dt_station_nodes.discovery import Verdict, discover

PAPER = ModelSpec.from_yaml((Path(__file__).parents[3] / "config" / "models" / "paper.yaml").read_text("utf-8"))
PRESSURE_ONLY = PAPER.model_copy(update={"paths": {Channel.PRESSURE: PAPER.paths[Channel.PRESSURE]}})
STEP_S, FINE = 0.02, 10


def run(volts_per_root: float, hertz: float, seed: int) -> Run:
    """A valve's voltage less what an orifice to the tank takes off it, beyond what it does at the rest pressure."""
    path = PRESSURE_ONLY.paths[Channel.PRESSURE]
    numerator = path.scale * path.gain * np.asarray(path.numerator)
    a, b, c, *_ = cont2discrete(tf2ss(numerator, path.denominator), STEP_S / FINE)
    voltage = np.clip(2.4 + 1.8 * np.sign(np.sin(2.0 * np.pi * hertz * STEP_S * np.arange(900))), 0.0, 5.0)
    voltage += 0.4 * np.sin(2.0 * np.pi * 1.9 * hertz * STEP_S * np.arange(900))
    voltage[0] = 0.0
    pressure, state = np.empty(900), np.zeros((len(path.denominator) - 1, 1))
    above = 0.0
    for k, asked in enumerate(voltage):
        pressure[k] = path.rest + above
        for _ in range(FINE):
            roots = np.sqrt(max(path.rest + above, 0.0) / path.rest) - 1.0
            state = a @ state + b * (asked - volts_per_root * roots)
            above = float((c @ state)[0, 0])
    noise = 0.01 * np.std(pressure) * np.random.default_rng(seed).standard_normal(900)
    return Run(STEP_S, {"load_voltage_v": voltage, "pressure_pa": pressure + noise})


def test_a_large_leak_through_an_orifice_is_named_though_nothing_leaks_at_rest() -> None:
    result = discover(run(1.1, 0.6, 1), PRESSURE_ONLY, validation=run(1.1, 0.23, 2))
    assert result.verdict is Verdict.NAMED
    assert [(e.name, e.channel) for e in result.effects] == [("leakage", Channel.PRESSURE)]
    after, floor = (gaps[Channel.PRESSURE].rms for gaps in (result.gap.after, result.gap.noise_floor))
    assert after < 1.1 * floor
