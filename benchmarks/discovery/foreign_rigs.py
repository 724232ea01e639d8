"""What made-up rigs have in common: the run and crude model of one, and signals to drive it with."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from dt_station_nodes.core.channels import Channel

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


def noisy(rng: np.random.Generator, y: Array, decibel: float = 50.0) -> Array:
    """With white noise so many decibel below its standard deviation."""
    return np.asarray(y + np.std(y) * 10 ** (-decibel / 20.0) * rng.standard_normal(len(y)))


def band(rng: np.random.Generator, n: int, sample_s: float, to_hz: float) -> Array:
    """Band-limited noise of unit standard deviation, shape (n,)."""
    b, a = signal.butter(3, min(2.0 * to_hz * sample_s, 0.9))
    made = signal.lfilter(b, a, rng.standard_normal(n + 500))[500:]
    return np.asarray(made / np.std(made))


def names(*each: str) -> frozenset[str]:
    """A set of names that is right."""
    return frozenset(each)


def linear(numerator: Sequence[float], denominator: Sequence[float], u: Array, sample_s: float) -> Array:
    """The answer (n,) of a linear path to held inputs, from rest."""
    b, a, *_ = signal.cont2discrete((list(numerator), list(denominator)), sample_s, "zoh")
    return np.asarray(signal.lfilter(np.ravel(b), a, u))


def mode(frequency_hz: float, damping: float) -> list[float]:
    """Denominator of a mode of unit gain at rest times its squared angular frequency."""
    w = 2.0 * np.pi * frequency_hz
    return [1.0, 2.0 * damping * w, w * w]
