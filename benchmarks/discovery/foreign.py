"""Other people's rigs, made up: does discovery answer rightly, or say that it does not know, and in what time?

    python -m benchmarks.discovery.foreign

Each is simulated by equations of its own, finely stepped, and given with a crude linear model only: gain and time
constants off by up to a third, units of its own, one path, sample times from 0.1 ms to 4 s, no validation run.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

import numpy as np
import typer
from numba import njit
from numpy.typing import NDArray
from scipy import signal

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import ModelSpec
from dt_station_nodes.core.run import Run
from dt_station_nodes.discovery import DiscoverySettings, Verdict, discover

Array = NDArray[np.float64]
FINE = 20  # steps of the truth within a sample


@dataclass(frozen=True, slots=True)
class Rig:
    """A run, the crude model it comes with, and the answers that are right."""

    name: str
    channel: Channel
    sample_s: float
    voltage: Array
    measured: Array
    numerator: tuple[float, ...]
    denominator: tuple[float, ...]
    rest: float
    right: tuple[frozenset[str], ...]  # sets of names; an empty set: nothing missing, or parameters only
    unknown: bool = False  # whether "unexplained" is right, or acceptable


def _noisy(rng: np.random.Generator, y: Array, decibel: float = 50.0) -> Array:
    return np.asarray(y + np.std(y) * 10 ** (-decibel / 20.0) * rng.standard_normal(len(y)))


def _band(rng: np.random.Generator, n: int, sample_s: float, to_hz: float) -> Array:
    """Band-limited noise of unit standard deviation, shape (n,)."""
    b, a = signal.butter(3, min(2.0 * to_hz * sample_s, 0.9))
    made = signal.lfilter(b, a, rng.standard_normal(n + 500))[500:]
    return np.asarray(made / np.std(made))


@njit(cache=True)
def _spring(u: Array, h: float, c: float, k: float, cubic: float, quadratic: float) -> Array:
    y = np.zeros(len(u))
    x = v = 0.0
    for i in range(len(u)):
        y[i] = x
        for _ in range(FINE):
            v += h * (u[i] - c * v - k * x - cubic * x**3 - quadratic * x * abs(x))
            x += h * v
    return y


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
    measured = np.round(y / counts) * counts if counts else _noisy(rng, y, 60.0)
    crude = (0.75 * gain / (1.3 * lag),), (1.0, 1.0 / (1.3 * lag), 0.0)
    return Rig(name, Channel.POSITION, sample_s, voltage, measured, *crude, 0.0, (right,))


def rigs() -> list[Rig]:
    """All of them."""
    rng = np.random.default_rng(5)
    made = []
    step = 1.0 / 610.0
    n = 20000
    u = _band(rng, n, step, 120.0) * np.linspace(0.02, 0.5, n)
    for name, cubic, quadratic, right, unknown in (
        ("oscillator, cubic spring (610 Hz)", 6e5, 0.0, "cubic_stiffness", False),
        ("oscillator, linear", 0.0, 0.0, "", False),
        ("oscillator, x|x| spring", 0.0, 1e5, "cubic_stiffness", True),
    ):
        y = _spring(u * 1e4, step / FINE, 20.0, 1.9e5, cubic, quadratic)
        y = _noisy(rng, y)
        names = frozenset({right} - {""})
        made.append(Rig(name, Channel.POSITION, step, u, y, (0.9e4,), (1.0, 26.0, 2.05e5), 0.0, (names,), unknown))
    dry = frozenset({"friction"})
    made.append(_axis_rig("DC motor, linear (1 kHz)", 1e-3, 20.0, frozenset()))
    made.append(
        _axis_rig("DC motor, dry friction, encoder (1 kHz)", 1e-3, 20.0, frozenset({"friction"}), 1e-3, dry=0.15)
    )
    made.append(_axis_rig("DC motor, dead zone (2 ms)", 2e-3, 20.0, frozenset({"dead_zone"}), dead=0.15))
    made.append(_axis_rig("ball screw, play (1 kHz)", 1e-3, 20.0, frozenset({"backlash"}), play=0.05))
    made.append(_axis_rig("servo, dry friction (0.1 ms, 10 s)", 1e-4, 10.0, dry, dry=0.15))
    u = 2.5 + 1.2 * _band(rng, 20000, 1e-3, 3.0)
    crude = (1.2 / (0.0196 * 0.016),), (1.0, 1 / 0.0196 + 1 / 0.016, 1 / (0.0196 * 0.016))
    for name, width, top, right in (
        ("valve, hysteresis (1 kHz)", 0.8, 1e9, "hysteresis"),
        ("valve, current limit (1 kHz)", 0.0, 3.5, "saturation"),
    ):
        y = _noisy(rng, 3.0 + 2.0 * _valve(u, 1e-3 / FINE, 0.02, width, 6, top))
        made.append(Rig(name, Channel.PRESSURE, 1e-3, u, y, (2.0 * crude[0][0],), crude[1], 3.0, (frozenset({right}),)))
    u = np.repeat(rng.uniform(0.3, 1.6, 60), 30)
    for name, linear, right in (
        ("two tanks, holes (2 s)", 0.0, "square_root_outflow"),
        ("two tanks, linear (2 s)", 1.0, ""),
    ):
        y = _noisy(rng, _tanks(u, 2.0 / FINE, 10.0, 0.5, linear))
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
                (frozenset({right} - {""}),),
                True,
            )
        )
    u = np.clip(_band(rng, 1500, 4.0, 0.01) * 3.0 + 5.0, 0.0, 10.0)
    y = _noisy(rng, 20.0 + 4.0 * _valve(u, 4.0 / FINE, 60.0, 0.0, 1, 6.5))
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
            (frozenset({"saturation"}),),
            True,
        )
    )
    u = 2.0 + _band(rng, 4000, 0.01, 2.0)
    x = _valve(u, 0.01 / FINE, 0.1, 0.0, 1, 1e9)
    made.append(
        Rig(
            "sensor that bends (square of the output)",
            Channel.POSITION,
            0.01,
            u,
            _noisy(rng, x + 0.15 * x**2),
            (1.5 / 0.004,),
            (1.0, 35.0, 250.0),
            0.0,
            (frozenset(),),
            True,
        )
    )
    return made


def main(
    only: Annotated[str, typer.Option(help="Only rigs with this in their name.")] = "",
    jobs: Annotated[int, typer.Option(help="Workers.")] = 2,
) -> None:
    """One line a rig: what was said, whether that is right, seconds."""
    good = 0
    chosen = [rig for rig in rigs() if only in rig.name]
    for rig in chosen:
        signals = {rig.channel.voltage_signal: rig.voltage, rig.channel.signal: rig.measured}
        spec = ModelSpec.model_validate(
            {
                "name": "crude",
                "paths": {rig.channel: {"numerator": rig.numerator, "denominator": rig.denominator, "rest": rig.rest}},
            }
        )
        begin = time.perf_counter()
        result = discover(Run(rig.sample_s, signals), spec, settings=DiscoverySettings(jobs=jobs))
        seconds = time.perf_counter() - begin
        names = frozenset(effect.name for effect in result.effects) - {"parameter_mismatch"}
        silent = result.verdict is Verdict.UNEXPLAINED
        right = rig.unknown if silent else names in rig.right
        possible = [{effect.name, *effect.alternatives} for effect in result.effects]
        among = bool(possible) and any(
            len(want) == len(possible) and all(want & p for p in possible) for want in rig.right
        )
        among = among and not right
        good += right or among
        verdict = "right" if right else ("among its alternatives" if among else ("silent" if silent else "WRONG"))
        spoken = "+".join(f"{e.name} {e.confidence:.2f}" for e in result.effects) or result.verdict.value
        typer.echo(f"{rig.name:44s} {len(rig.measured):7d} {spoken:50s} {verdict:10s} {seconds:6.1f} s")
    typer.echo(f"{good} of {len(chosen)} right")


if __name__ == "__main__":
    typer.run(main)
