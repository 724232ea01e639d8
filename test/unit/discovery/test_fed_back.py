"""What is fed back inside a pressure path, simulated here on its own: a relief valve's flow, the spring of a spool."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy.signal import tf2ss

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.run import Run
from dt_station_nodes.discovery import DiscoverySettings
from dt_station_nodes.discovery.channel import examine
from dt_station_nodes.discovery.problem import Problem, make_problem
from dt_station_nodes.discovery.result import Verdict
from dt_station_nodes.discovery.search import scan
from dt_station_nodes.discovery.selection import Bench, fit_null
from dt_station_nodes.discovery.terms import nominal_terms

from .valves import BARE, SPEC, TIME_S, WAVES

OPENS_MPA, SUBSTEPS, SAMPLES, NOISE = 1.9, 20, 900, 0.01
HARDENING = 0.015  # V per cube of the spool's way, itself in V
Rate = Callable[[np.ndarray, float], np.ndarray]


def lost_v(over_mpa: float) -> float:
    """Voltage lost: a square root, straight near nothing."""
    return 0.6 * float(np.sqrt(over_mpa + 0.02) - np.sqrt(0.02))


def advanced(x: np.ndarray, u: float, rate: Rate) -> np.ndarray:
    """One sample later, by Runge and Kutta's steps."""
    h = 0.02 / SUBSTEPS
    for _ in range(SUBSTEPS):
        first = rate(x, u)
        second = rate(x + 0.5 * h * first, u)
        third = rate(x + 0.5 * h * second, u)
        x = x + h / 6.0 * (first + 2.0 * (second + third) + rate(x + h * third, u))
    return x


def relieved(volts: np.ndarray) -> np.ndarray:
    """Pressure above rest (n,), MPa, of the path with what a valve lets off fed back."""
    a, b, c, _ = tf2ss(BARE.numerator, BARE.denominator)
    x, out = np.zeros(len(a)), []

    def rate(x: np.ndarray, u: float) -> np.ndarray:
        return np.asarray(a @ x + b[:, 0] * (u - lost_v(max(float(c[0] @ x) - OPENS_MPA, 0.0))))

    for u in volts:
        out.append(float(c[0] @ x))
        x = advanced(x, u, rate)
    return np.array(out)


def hardened(volts: np.ndarray) -> np.ndarray:
    """Pressure above rest (n,), MPa, where the spring of the spool, whose slowest poles the path has, hardens."""
    poles = np.roots(BARE.denominator)
    spool = sorted(poles, key=lambda pole: abs(pole.imag))[:2]
    square = float(np.prod(spool).real)
    rest = np.poly([pole for pole in poles if pole not in spool]).real
    a, b, c, d = tf2ss(np.array(BARE.numerator) / square, rest)
    damping = -float(np.sum(spool).real)
    x, out = np.zeros(2 + len(a)), []

    def rate(x: np.ndarray, u: float) -> np.ndarray:
        way, speed = x[0], x[1]
        pulled = square * (u - way - HARDENING * way**3) - damping * speed
        return np.concatenate([[speed, pulled], a @ x[2:] + b[:, 0] * way])

    for u in volts:
        out.append(float(c[0] @ x[2:] + d[0, 0] * x[0]))
        x = advanced(x, u, rate)
    return np.array(out)


def problem(wave: int, answer: Callable[[np.ndarray], np.ndarray]) -> Problem:
    volts = 2.2 + 1.2 * WAVES[wave][:SAMPLES]
    pressure = 1e6 + 1e6 * answer(volts)
    pressure += NOISE * np.std(pressure) * np.random.default_rng(wave).standard_normal(volts.size)
    run = Run(float(TIME_S[1]), {"load_voltage_v": volts, "pressure_pa": pressure})
    return make_problem(run, SPEC, Channel.PRESSURE, DiscoverySettings())


def test_a_relief_valve_and_where_it_opens_are_found() -> None:
    found = examine(problem(0, relieved), BARE, DiscoverySettings(), check=problem(1, relieved))
    assert (found.verdict, found.best.added) == (Verdict.NAMED, ("overflow",))
    valve = found.best.fit.path.effect("overflow").parameters
    assert valve["limit"] == pytest.approx(1e6 * OPENS_MPA, rel=0.02)
    assert 0.5 < valve["weir_exponent"] < 0.8
    assert all(left < 1.1 for left in found.over_noise)


def test_the_spring_of_a_spool_is_ahead_of_the_pressure() -> None:
    run = problem(1, hardened)
    bench = Bench(run, nominal_terms(BARE, run.signal))
    best = scan(bench, [fit_null(bench, BARE)], 6, 3)[0]
    assert best.added == ("cubic_stiffness",)
    assert 0.01 < best.fit.path.effect("cubic_stiffness").parameters["lead_s"] < 0.05
    assert float(np.std(best.fit.residual)) < 1.05 * NOISE * float(np.std(run.measured))
