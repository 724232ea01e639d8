"""Valves, tanks and heaters that are not ours, made up."""

import numpy as np
from numba import njit

from dt_station_nodes.core.channels import Channel

from .foreign_rigs import FINE, Array, Rig, band, linear, names, noisy


@njit(cache=True)
def _valve(u: Array, h: float, lag: float, width: float, plays: int, top: float) -> Array:
    """Two lags behind a magnet of several plays, its current limited."""
    y = np.zeros(len(u))
    state = np.zeros(plays)
    a = b = 0.0
    for i in range(len(u)):
        y[i] = b
        mean = 0.0
        for k in range(plays):
            half = width * (k + 0.5) / plays
            state[k] = min(max(state[k], u[i] - half), u[i] + half)
            mean += state[k] / plays
        drive = min(mean, top)
        for _ in range(FINE):
            a += h / lag * (drive - a)
            b += h / (0.4 * lag) * (a - b)
    return y


@njit(cache=True)
def _tanks(u: Array, h: float, area: float, hole: float, linear: float) -> Array:
    y = np.zeros(len(u))
    a = b = 4.0
    for i in range(len(u)):
        y[i] = b
        for _ in range(FINE):
            first = hole * (np.sqrt(max(a, 0.0)) * (1.0 - linear) + linear * a / 4.0)
            second = hole * (np.sqrt(max(b, 0.0)) * (1.0 - linear) + linear * b / 4.0)
            a += h / area * (max(u[i], 0.0) - first)
            b += h / area * (first - second)
    return y


@njit(cache=True)
def _sticking(u: Array, band_v: float, jump_v: float) -> Array:
    """A stem that sticks until the command has moved by a band, then jumps (Choudhury et al. 2005)."""
    y = np.zeros(len(u))
    stem, stuck_at, last, way = u[0], u[0], u[0], 1.0
    stuck = True
    for i in range(len(u)):
        change = u[i] - last
        if change * way < 0.0:
            stuck, stuck_at, way = True, last, -way
        if stuck and abs(u[i] - stuck_at) > band_v:
            stuck = False
        if not stuck:
            stem = u[i] - 0.5 * way * (band_v - jump_v)
        last = u[i]
        y[i] = stem
    return y


def processes() -> list[Rig]:
    """All of them."""
    return [*_valves(), *_tank_pair(), *_heaters(), *_sensors()]


def _valves() -> list[Rig]:
    rng = np.random.default_rng(5)
    made = []
    u = 2.5 + 1.2 * band(rng, 20000, 1e-3, 3.0)
    crude = (1.2 / (0.0196 * 0.016),), (1.0, 1 / 0.0196 + 1 / 0.016, 1 / (0.0196 * 0.016))
    for name, width, top, right in (
        ("valve, hysteresis (1 kHz)", 0.8, 1e9, "hysteresis"),
        ("valve, current limit (1 kHz)", 0.0, 3.5, "saturation"),
    ):
        y = noisy(rng, 3.0 + 2.0 * _valve(u, 1e-3 / FINE, 0.02, width, 6, top))
        made.append(Rig(name, Channel.PRESSURE, 1e-3, u, y, (2.0 * crude[0][0],), crude[1], 3.0, (names(right),)))
    step = 0.002
    u = 1.5 + band(rng, 5000, step, 4.0)
    y = noisy(rng, linear([1.0], [0.03, 1.0], 3.0 * np.tanh(u / 2.0), step), 45.0)
    right = (names("saturation"),)
    made.append(
        Rig(
            "solenoid that saturates softly (2 ms)",
            Channel.POSITION,
            step,
            u,
            y,
            (1.1 / 0.035,),
            (1.0, 1 / 0.035),
            0.0,
            right,
        )
    )
    step = 0.1
    u = 1.5 * band(rng, 4000, step, 0.15)
    y = noisy(rng, 3.0 + linear([2.0], [1.2, 1.0], _sticking(u, 0.6, 0.3), step), 45.0)
    right = (names("hysteresis"), names("backlash"), names("friction"))
    made.append(
        Rig(
            "process valve that sticks (0.1 s)",
            Channel.PRESSURE,
            step,
            u,
            y,
            (1.6 / 1.5,),
            (1.0, 1 / 1.5),
            3.0,
            right,
            True,
        )
    )
    return made


def _tank_pair() -> list[Rig]:
    rng = np.random.default_rng(6)
    made = []
    u = np.repeat(rng.uniform(0.3, 1.6, 60), 30)
    for name, straight, right in (
        ("two tanks, holes (2 s)", 0.0, "square_root_outflow"),
        ("two tanks, linear (2 s)", 1.0, ""),
    ):
        y = noisy(rng, _tanks(u, 2.0 / FINE, 10.0, 0.5, straight))
        rate = 0.5 / 4.0 / 10.0
        fast, slow = 0.8 * rate, 1.3 * rate
        made.append(
            Rig(
                name,
                Channel.POSITION,
                2.0,
                u,
                y,
                (0.1 * fast,),
                (1.0, fast + slow, fast * slow),
                0.0,
                (names(right) - {""},),
                True,
            )
        )
    return made


def _heaters() -> list[Rig]:
    rng = np.random.default_rng(7)
    made = []
    u = np.clip(band(rng, 1500, 4.0, 0.01) * 3.0 + 5.0, 0.0, 10.0)
    y = noisy(rng, 20.0 + 4.0 * _valve(u, 4.0 / FINE, 60.0, 0.0, 1, 6.5))
    made.append(
        Rig(
            "oven, heater limit (4 s)",
            Channel.POSITION,
            4.0,
            u,
            y,
            (3.2 / 70.0,),
            (1.0, 1.0 / 70.0),
            20.0,
            (names("saturation", "extra_lag"),),
            True,
        )
    )
    step = 0.08
    u = np.where(np.repeat(rng.random(200) < 0.5, 5), -0.8, 0.8)
    y = linear([0.9], np.polymul([0.07, 1.0], [0.25, 1.0]), np.concatenate([np.zeros(3), u[:-3]]), step)
    crude = (0.75 / 0.016,), (1.0, 1 / 0.08 + 1 / 0.2, 1 / 0.016)
    made.append(
        Rig(
            "hair dryer, air 0.24 s late (80 ms)",
            Channel.PRESSURE,
            step,
            u,
            5.0 + noisy(rng, y, 35.0),
            *crude,
            5.0,
            (names("delay"),),
        )
    )
    n, step = 3000, 1.0
    u = 2.0 + np.repeat(rng.uniform(-1.5, 1.5, 100), 30)
    crude = (5.0 / 35.0,), (1.0, 1 / 35.0)
    y = 20.0 + linear([6.0], [40.0, 1.0], u * (1.0 - 0.25 * np.arange(n) / n), step)
    made.append(
        Rig(
            "heater that fades (1 s)",
            Channel.PRESSURE,
            step,
            u,
            noisy(rng, y, 45.0),
            *crude,
            20.0,
            (names("gain_drift"),),
        )
    )
    y = 20.0 + linear([6.0], [40.0, 1.0], u, step) + linear([2.0], [20.0, 1.0], rng.standard_normal(n), step)
    made.append(
        Rig("heater, linear, wandering air (1 s)", Channel.PRESSURE, step, u, y, *crude, 20.0, (names(),), True)
    )
    return made


def _sensors() -> list[Rig]:
    rng = np.random.default_rng(8)
    made = []
    u = 2.0 + band(rng, 4000, 0.01, 2.0)
    x = _valve(u, 0.01 / FINE, 0.1, 0.0, 1, 1e9)
    made.append(
        Rig(
            "sensor that bends (square of the output)",
            Channel.POSITION,
            0.01,
            u,
            noisy(rng, x + 0.15 * x**2),
            (1.5 / 0.004,),
            (1.0, 35.0, 250.0),
            0.0,
            (names(),),
            True,
        )
    )
    step = 1e-4
    u = 1.5 * band(rng, 12000, step, 400.0)
    # Nothing holds what passes from one filter to the other over a sample.
    x = linear([1.0], [3e-4, 1.0], np.repeat(u, FINE), step / FINE)
    y = linear([1.0], [2e-4, 1.0], np.where(x > 0.6, 0.6 + 0.12 * (x - 0.6), x), step / FINE)[::FINE]
    lag = 2.4e-4
    right = (names("saturation"), names("asymmetric_gain"))
    made.append(
        Rig(
            "two filters, diode between (0.1 ms)",
            Channel.PRESSURE,
            step,
            u,
            noisy(rng, y, 55.0),
            (0.8 / lag**2,),
            (1.0, 2 / lag, 1 / lag**2),
            0.0,
            right,
            True,
        )
    )
    return made
