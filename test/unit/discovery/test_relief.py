"""A relief valve whose flow is missing from what feeds the whole path, simulated here on its own."""

import numpy as np
import pytest
from scipy.signal import tf2ss

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.run import Run
from dt_station_nodes.discovery import DiscoverySettings
from dt_station_nodes.discovery.channel import examine
from dt_station_nodes.discovery.problem import Problem, make_problem
from dt_station_nodes.discovery.result import Verdict

from .valves import BARE, SPEC, TIME_S, WAVES

OPENS_MPA, SUBSTEPS = 1.9, 20


def lost_v(over_mpa: float) -> float:
    """Voltage lost: a square root, straight near nothing."""
    return 0.6 * float(np.sqrt(over_mpa + 0.02) - np.sqrt(0.02))


def relieved(volts: np.ndarray) -> np.ndarray:
    """Pressure above rest (n,), MPa: Runge and Kutta's steps of the path with its loss fed back."""
    a, b, c, _ = tf2ss(BARE.numerator, BARE.denominator)
    h, x, out = 0.02 / SUBSTEPS, np.zeros(len(a)), []

    def rate(x: np.ndarray, u: float) -> np.ndarray:
        return a @ x + b[:, 0] * (u - lost_v(max(float(c[0] @ x) - OPENS_MPA, 0.0)))

    for u in volts:
        out.append(float(c[0] @ x))
        for _ in range(SUBSTEPS):
            first = rate(x, u)
            second = rate(x + 0.5 * h * first, u)
            third = rate(x + 0.5 * h * second, u)
            x = x + h / 6.0 * (first + 2.0 * (second + third) + rate(x + h * third, u))
    return np.array(out)


def problem(wave: int) -> Problem:
    volts = 2.2 + 1.2 * WAVES[wave][:900]
    pressure = 1e6 + 1e6 * relieved(volts)
    pressure += 0.01 * np.std(pressure) * np.random.default_rng(wave).standard_normal(volts.size)
    run = Run(float(TIME_S[1]), {"load_voltage_v": volts, "pressure_pa": pressure})
    return make_problem(run, SPEC, Channel.PRESSURE, DiscoverySettings())


def test_its_name_and_where_it_opens_are_found() -> None:
    found = examine(problem(0), BARE, DiscoverySettings(), check=problem(1))
    assert (found.verdict, found.best.added) == (Verdict.NAMED, ("overflow",))
    valve = found.best.fit.path.effect("overflow").parameters
    assert valve["limit"] == pytest.approx(1e6 * OPENS_MPA, rel=0.02)
    assert 0.5 < valve["weir_exponent"] < 0.8
    assert all(left < 1.1 for left in found.over_noise)
