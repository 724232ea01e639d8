"""Oscillators that are not ours, made up."""

import numpy as np
from numba import njit

from dt_station_nodes.core.channels import Channel

from .foreign_rigs import FINE, Array, Rig, band, linear, mode, names, noisy


@njit(cache=True)
def _spring(u: Array, h: float, c: float, k: float, cubic: float, quadratic: float) -> Array:
    y = np.zeros(len(u))
    x = v = 0.0
    for i in range(len(u)):
        y[i] = x
        for _ in range(FINE):
            x += 0.5 * h * v
            v += h * (u[i] - k * x - cubic * x**3 - quadratic * x * abs(x) - c * v) / (1.0 + 0.5 * h * c)
            x += 0.5 * h * v
    return y


@njit(cache=True)
def _bouc_wen(u: Array, h: float) -> Array:
    """An oscillator whose restoring force has a loop, with the numbers of Noël and Schoukens' benchmark (2016)."""
    y = np.zeros(len(u))
    x = v = z = 0.0
    for i in range(len(u)):
        y[i] = x
        for _ in range(FINE):
            v += h * (u[i] - 10.0 * v - 5e4 * x - z) / 2.0
            z += h * (5e4 * v - 1e3 * (0.8 * abs(v) * z - 1.1 * v * abs(z)))
            x += h * v
    return y


def oscillators() -> list[Rig]:
    """All of them."""
    rng = np.random.default_rng(5)
    made = []
    step = 1.0 / 610.0
    n = 20000
    u = band(rng, n, step, 120.0) * np.linspace(0.02, 0.5, n)
    for name, cubic, quadratic, right, unknown in (
        ("oscillator, cubic spring (610 Hz)", 6e5, 0.0, "cubic_stiffness", False),
        ("oscillator, linear", 0.0, 0.0, "", False),
        ("oscillator, x|x| spring", 0.0, 1e5, "cubic_stiffness", True),
    ):
        y = _spring(u * 1e4, step / FINE, 20.0, 1.9e5, cubic, quadratic)
        y = noisy(rng, y)
        expected = names(right) - {""}
        made.append(Rig(name, Channel.POSITION, step, u, y, (0.9e4,), (1.0, 26.0, 2.05e5), 0.0, (expected,), unknown))
    step, n = 1.0 / 750.0, 8192
    u = np.tile(band(rng, n // 2, step, 150.0), 2)
    y = noisy(rng, _bouc_wen(50.0 * u, step / FINE))
    made.append(
        Rig(
            "oscillator, Bouc-Wen spring (750 Hz)",
            Channel.POSITION,
            step,
            u,
            y,
            (25.0,),
            (1.0, 7.0, 5e4),
            0.0,
            (names("hysteresis"),),
            True,
        )
    )
    step, n = 0.005, 4000
    u = band(rng, n, step, 6.0)
    y = linear([mode(3.0, 0.1)[2]], mode(3.0, 0.1), u, step)
    late = noisy(rng, np.concatenate([np.zeros(8), y[:-8]]), 45.0)
    right = (names("delay"),)
    made.append(
        Rig("oscillator, 40 ms late (5 ms)", Channel.POSITION, step, u, late, (300.0,), (1.0, 5.0, 320.0), 0.0, right)
    )
    return made
