"""Axes, arms and fins that are not ours, made up."""

from collections.abc import Callable

import numpy as np
from numba import njit
from scipy import signal

from dt_station_nodes.core.channels import Channel

from .foreign_rigs import FINE, Array, Rig, band, linear, mode, names, noisy


@njit(cache=True)
def _axis(u: Array, h: float, gain: float, lag: float, dry: float, dead: float, play: float) -> Array:
    """Motor volts to place: dead zone at the amplifier, regularised dry friction, play behind the motor."""
    y = np.zeros(len(u))
    x = v = out = 0.0
    for i in range(len(u)):
        out = min(max(out, x - play), x + play)
        y[i] = out
        drive = u[i] - dead if u[i] > dead else (u[i] + dead if u[i] < -dead else 0.0)
        for _ in range(FINE):
            free = v + h / lag * (gain * drive - v)
            brake = h / lag * gain * dry
            v = max(free - brake, 0.0) if free > 0.0 else min(free + brake, 0.0)
            x += h * v
            out = min(max(out, x - play), x + play)
    return y


@njit(cache=True)
def _fin(u: Array, h: float, lag: float, rate: float, stop: float, weaker: float) -> Array:
    """A loop that follows its command, its speed and travel limited, one side weaker."""
    y = np.zeros(len(u))
    x = 0.0
    for i in range(len(u)):
        y[i] = x
        wanted = min(max(u[i] * (1.0 - weaker) if u[i] < 0.0 else u[i], -stop), stop)
        for _ in range(FINE):
            x += h * min(max((wanted - x) / lag, -rate), rate)
    return y


@njit(cache=True)
def _cylinder(u: Array, h: float, lag: float, forward: float, back: float) -> Array:
    """A cylinder of two areas: volts to place."""
    y = np.zeros(len(u))
    x = v = 0.0
    for i in range(len(u)):
        y[i] = x
        gain = forward if u[i] > 0.0 else back
        for _ in range(FINE):
            v += h / lag * (gain * u[i] - v)
            x += h * v
    return y


def _loop(n: int, sample_s: float, track: Array, pull: float, make: Callable[[Array], Array]) -> Array:
    """A voltage that keeps an integrating axis within its stroke: that of a reference's speed, plus its error."""
    speed = np.gradient(track, sample_s)
    voltage = pull * speed
    for _ in range(3):
        drift = track - make(voltage)
        b, a = signal.butter(1, min(2.0 * 0.5 * sample_s, 0.9))
        voltage = voltage + pull * np.gradient(signal.filtfilt(b, a, drift), sample_s)
    return np.asarray(voltage)


def _axis_rig(
    name: str, sample_s: float, seconds: float, right: frozenset[str], counts: float = 0.0, **what: float
) -> Rig:
    rng = np.random.default_rng(len(name))
    n = round(seconds / sample_s)
    numbers = {"dry": 0.0, "dead": 0.0, "play": 0.0, **what}
    gain, lag, h = 8.0, 0.08, sample_s / FINE

    def make(u: Array) -> Array:
        return np.asarray(_axis(u, h, gain, lag, numbers["dry"], numbers["dead"], numbers["play"]))

    t = np.arange(n) * sample_s
    track = 1.5 * np.sin(2 * np.pi * 0.4 * t) + 0.8 * np.sin(2 * np.pi * 1.1 * t + 1.0)
    voltage = _loop(n, sample_s, track, 1.0 / gain, make)
    y = make(voltage)
    measured = np.round(y / counts) * counts if counts else noisy(rng, y, 60.0)
    crude = (0.75 * gain / (1.3 * lag),), (1.0, 1.0 / (1.3 * lag), 0.0)
    return Rig(name, Channel.POSITION, sample_s, voltage, measured, *crude, 0.0, (right,))


def axes() -> list[Rig]:
    """All of them."""
    return [*_servos(), *_loops()]


def _servos() -> list[Rig]:
    made = []
    dry = names("friction")
    made.append(_axis_rig("DC motor, linear (1 kHz)", 1e-3, 20.0, names()))
    made.append(_axis_rig("DC motor, dry friction, encoder (1 kHz)", 1e-3, 20.0, dry, 1e-3, dry=0.15))
    made.append(_axis_rig("DC motor, dead zone (2 ms)", 2e-3, 20.0, names("dead_zone"), dead=0.15))
    made.append(_axis_rig("ball screw, play (1 kHz)", 1e-3, 20.0, names("backlash"), play=0.05))
    made.append(_axis_rig("servo, dry friction (0.1 ms, 10 s)", 1e-4, 10.0, dry, dry=0.15))
    step, n = 0.01, 3000
    t = np.arange(n) * step
    track = 0.15 * np.sin(2 * np.pi * 0.2 * t) + 0.05 * np.sin(2 * np.pi * 0.7 * t + 1)

    def make(u: Array) -> Array:
        return np.asarray(_cylinder(u, step / FINE, 0.03, 0.08, 0.11))

    voltage = _loop(n, step, track, 1.0 / 0.095, make)
    y = noisy(np.random.default_rng(11), make(voltage), 55.0)
    right = (names("asymmetric_gain"),)
    made.append(
        Rig("cylinder, two areas (10 ms)", Channel.POSITION, step, voltage, y, (2.5,), (1.0, 25.0, 0.0), 0.0, right)
    )
    return made


def _loops() -> list[Rig]:
    rng = np.random.default_rng(77)
    made = []
    step = 0.005
    u = 4.0 * band(rng, 6000, step, 1.5)
    for name, rate, stop, weaker, right in (
        ("fin, limited speed (5 ms)", 12.0, 1e9, 0.0, (names("rate_limit"),)),
        ("fin, stop (5 ms)", 1e9, 5.0, 0.0, (names("saturation"), names("overflow"))),
        ("fin, one side weaker (5 ms)", 1e9, 1e9, 0.3, (names("asymmetric_gain"),)),
    ):
        y = noisy(rng, _fin(u, step / FINE, 0.05, rate, stop, weaker))
        made.append(Rig(name, Channel.POSITION, step, u, y, (15.0,), (1.0, 1 / 0.06), 0.0, right))
    step = 0.002
    u = band(rng, 2048, step, 60.0)
    y = linear([40.0 * mode(22.0, 0.03)[2]], np.polymul([1.0, 8.0], mode(22.0, 0.03)), u, step)
    right = (names("resonance"),)
    made.append(
        Rig(
            "arm, flexible joint (2 ms)",
            Channel.POSITION,
            step,
            u,
            noisy(rng, y, 45.0),
            (32.0,),
            (1.0, 10.0),
            0.0,
            right,
        )
    )
    step = 0.01
    u = 3.0 * band(rng, 4000, step, 0.8)
    y = linear([20.0], [0.15, 1.0], np.sign(u) * np.maximum(np.abs(u) - 0.8, 0.0), step)
    right = (names("dead_zone"), names("friction"))
    made.append(
        Rig(
            "motor speed, dead zone (10 ms)",
            Channel.POSITION,
            step,
            u,
            noisy(rng, y, 45.0),
            (75.0,),
            (1.0, 5.0),
            0.0,
            right,
        )
    )
    step = 0.004
    u = 2.0 * band(rng, 5000, step, 2.0)
    y = linear([8.0], [0.05, 1.0], u + 0.3 * np.sin(2 * np.pi * 7.3 * np.arange(5000) * step + 0.4), step)
    right = (names("periodic_disturbance"),)
    made.append(
        Rig(
            "spindle, unbalance (4 ms)",
            Channel.POSITION,
            step,
            u,
            noisy(rng, y, 45.0),
            (7 / 0.06,),
            (1.0, 1 / 0.06),
            0.0,
            right,
        )
    )
    step = 0.02
    u = np.repeat(rng.uniform(-3.0, 3.0, 60), 25)
    y = np.abs(linear([1.2 * mode(1.6, 0.25)[2]], np.polymul([1.0, 1.5], mode(1.6, 0.25)), u, step))
    made.append(
        Rig(
            "two drives, |speed| counted (20 ms)",
            Channel.POSITION,
            step,
            u,
            noisy(rng, y),
            (1.0,),
            (1.0, 1.5),
            0.0,
            (names(),),
            True,
        )
    )
    return made
