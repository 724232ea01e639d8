"""What is estimated from what: data, orders, and the layout of the parameter vector."""

import math
from dataclasses import dataclass, field, replace
from enum import Enum

import numpy as np

from ..core.run import Array
from .errors import IdentificationError


class Hold(str, Enum):
    """How an input behaves between its samples."""

    HELD = "held"
    SMOOTH = "smooth"


@dataclass(frozen=True, slots=True)
class PathStructure:
    """Orders of one path; `integrators` of its `poles` are fixed at s = 0.

    The delay is `delay_s`, or, where `estimate_delay`, a parameter that starts there.
    """

    poles: int
    zeros: int
    integrators: int = 0
    hold: Hold = Hold.HELD
    delay_s: float = 0.0
    estimate_delay: bool = False

    def __post_init__(self) -> None:
        if self.poles < 1 or not 0 <= self.integrators <= self.poles:
            raise IdentificationError(
                f"A path needs a pole and no more integrators than poles, got {self.poles} and {self.integrators}."
            )
        if not (math.isfinite(self.delay_s) and self.delay_s >= 0.0):
            raise IdentificationError(f"A delay is a number of seconds from 0 on, not {self.delay_s:g}.")
        if not 0 <= self.zeros < self.poles:
            raise IdentificationError(
                f"A model with {self.zeros} zeros and {self.poles} poles is improper; ask for fewer zeros than poles."
            )

    @property
    def free_poles(self) -> int:
        """Poles that are estimated."""
        return self.poles - self.integrators

    @property
    def size(self) -> int:
        """Number of dynamic parameters."""
        return self.zeros + 1 + self.free_poles + int(self.estimate_delay)


@dataclass(frozen=True, slots=True)
class Structure:
    """A sum of paths plus offset, and optionally unknown initial states and a drift (an integrator's biased input)."""

    paths: tuple[PathStructure, ...]
    initial_states: bool = True
    drift: bool = False

    @property
    def size(self) -> int:
        """Number of all parameters."""
        states = sum(p.free_poles for p in self.paths) if self.initial_states else 0
        return sum(p.size for p in self.paths) + states + 1 + int(self.drift)

    def with_path(self, index: int, path: PathStructure) -> "Structure":
        """The same with one path replaced."""
        return replace(self, paths=(*self.paths[:index], path, *self.paths[index + 1 :]))


@dataclass(frozen=True, slots=True)
class Data:
    """Inputs and output of one experiment on an even grid, arrays of shape (n,); row k's held inputs act from k on."""

    sample_time_s: float
    inputs: tuple[Array, ...]
    output: Array
    input_names: tuple[str, ...] = field(default=())
    output_name: str = "output"

    def __len__(self) -> int:
        return len(self.output)

    def window(self, start: int, stop: int) -> "Data":
        """Rows start to stop (exclusive)."""
        return replace(self, inputs=tuple(u[start:stop] for u in self.inputs), output=self.output[start:stop])

    def name(self, index: int) -> str:
        """Name of an input."""
        return self.input_names[index] if index < len(self.input_names) else f"input {index + 1}"


@dataclass(frozen=True, slots=True)
class PathParameters:
    """One path's parameters in normalised time: numerator and free denominator (highest power first), delay, states."""

    numerator: Array
    denominator: Array
    delay_s: float
    initial: Array


def unpack(structure: Structure, theta: Array) -> tuple[tuple[PathParameters, ...], Array]:
    """Paths' parameters and (offset[, drift]) of a parameter vector."""
    paths = []
    at = 0
    for path in structure.paths:
        numerator = theta[at : at + path.zeros + 1]
        at += path.zeros + 1
        denominator = np.concatenate(([1.0], theta[at : at + path.free_poles]))
        at += path.free_poles
        delay = path.delay_s
        if path.estimate_delay:
            delay = float(theta[at])
            at += 1
        states = path.free_poles if structure.initial_states else 0
        paths.append(PathParameters(numerator, denominator, delay, theta[at : at + states]))
        at += states
    return tuple(paths), theta[at:]


def slices(structure: Structure) -> tuple[tuple[slice, slice, slice, slice], ...]:
    """Positions of (numerator, denominator, delay, initial states) of each path in the parameter vector."""
    found = []
    at = 0
    for path in structure.paths:
        ends = [at := at + size for size in (path.zeros + 1, path.free_poles, int(path.estimate_delay))]
        states = path.free_poles if structure.initial_states else 0
        start = ends[0] - path.zeros - 1
        found.append((slice(start, ends[0]), slice(ends[0], ends[1]), slice(ends[1], ends[2]), slice(at, at + states)))
        at += states
    return tuple(found)


def time_weights(structure: Structure, rate_rad_s: float) -> Array:
    """Factors that turn parameters in time normalised by rate into physical ones, shape (size,)."""
    weights = np.ones(structure.size)
    for path, (numerator, denominator, _, initial) in zip(structure.paths, slices(structure), strict=True):
        powers = path.poles - np.arange(path.zeros, -1, -1)
        weights[numerator] = rate_rad_s**powers
        weights[denominator] = rate_rad_s ** np.arange(1, path.free_poles + 1)
        if initial.stop > initial.start:
            weights[initial] = rate_rad_s ** np.arange(0, path.free_poles)
    if structure.drift:
        weights[-1] = rate_rad_s
    return weights
