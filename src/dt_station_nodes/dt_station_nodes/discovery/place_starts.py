"""Where effects that belong to a place begin: limits, stops, springs, stores, about where the run moves."""

import numpy as np

from ..core.channels import Channel
from ..core.models import PathSpec, real_poles
from ..core.models.effects import Parameter, Quantity
from .problem import Problem

_INWARDS = (0.02, 0.1, 0.25)  # of the run's way
_HISS = 2.0  # times the noise, by which a run goes beyond a stop that it only just meets
# A run that moves less than this of its way from a spring's place sees a small part of its curve.
_FAR = 0.5
_WORN_AT = (-0.6, -0.3, 0.0, 0.3, 0.6)  # of half the run's way, from its middle,
_WORN_BENDS = (1.0, 2.0, 4.0)  # the inverse of it
_BELOW = (1.2, 2.0, 4.0)  # times the way from the run's mean down to its lowest level: where a store is empty
_OUT_OF_REACH = 2.0  # times the highest voltage
_CUT_OFF = (0.05, 0.15, 0.3, 0.5)  # of the voltage's range
_OUTSIDE = (0.4, 0.6, 1.0, 1.8)  # the same from the working voltage on


def lags_s(path: PathSpec) -> list[float]:
    """Time constants (s) of a path's own lags, the shortest first: one may come before what limits it."""
    sizes = {round(float(size), 12) for size in np.abs(np.roots(path.denominator)) if size > 0.0}
    return [path.time_scale / size for size in sorted(sizes, reverse=True)]


def limit_starts(problem: Problem, parameter: Parameter, unit: float, about: bool = False) -> list[float]:
    """Where the voltages that still count begin.

    The limit on the side of zero that a run about a working voltage does not go to may cut off a part of its range.
    `about`: where the answer bends from that voltage on, its limits may lie well outside.
    """
    voltage = problem.simulator.voltage_v
    low, high = (float(end) for end in np.quantile(voltage, (0.02, 0.98)))
    range_v = high - low
    if about:
        way = range_v if parameter.name == "upper_v" else -range_v
        return [float(np.mean(voltage)) + share * way for share in _OUTSIDE]
    if parameter.name == "lower_v" and low > 0.0:
        return [-_OUT_OF_REACH * unit, *(low + share * range_v for share in _CUT_OFF)]
    if parameter.name == "upper_v" and high < 0.0:
        return [_OUT_OF_REACH * unit, *(high - share * range_v for share in _CUT_OFF)]
    return [start * unit for start in parameter.starts]


def _ends(problem: Problem, path: PathSpec) -> tuple[float, float]:
    """Where the run's way ends, from where the path rests."""
    return float(np.min(problem.measured)) - path.rest, float(np.max(problem.measured)) - path.rest


def stop_starts(problem: Problem, path: PathSpec, parameter: Parameter, unit: float) -> list[float]:
    """Where the stops of a piston, or of a mass on a spring, begin.

    Out of reach, or about the ends of the run's way, which it seldom goes beyond.
    """
    swings = not real_poles(path.denominator)
    if not (problem.windows.anchored or swings):
        return [parameter.neutral] if parameter.name == "standing" else [start * unit for start in parameter.starts]
    if parameter.name == "standing":
        # A pressure has a valve that lets off rather than an end.
        return [1.0] if swings and problem.channel is not Channel.PRESSURE else list(parameter.starts)
    low, high = _ends(problem, path)
    inwards = np.array([_HISS * problem.noise, *((high - low) * share for share in _INWARDS)])
    if parameter.name == "limit":
        return [parameter.upper * unit, *(high - inwards)]
    return [parameter.lower * unit, *(low + inwards)]


def spring_starts(problem: Problem, path: PathSpec, parameter: Parameter, unit: float) -> list[float]:
    """Where a spring's place and its stiffness begin: most often where the run moves about, or else far from there."""
    away = float(np.mean(problem.measured)) - path.rest
    if parameter.name == "centre":
        return [0.0, away]
    scales = problem.scales
    travel = (scales[Quantity.INPUT_PER_OUTPUT] / scales[Quantity.INPUT_PER_OUTPUT_CUBED]) ** 0.5
    nearer = travel / max(abs(away), travel)
    sizes = [*parameter.starts, *(size * nearer**3 for size in parameter.starts if nearer < _FAR)]
    return [size * unit for size in sizes]


def store_starts(problem: Problem, path: PathSpec, parameter: Parameter) -> list[float]:
    """A store's bend begins as of one that is empty somewhat below the run's levels, about their mean.

    There the linear path, refitted to the run, has the outflow's value and slope.
    """
    mean = float(np.mean(problem.measured))
    if parameter.name == "reference":
        return [mean - path.rest]
    down = max(mean - float(np.min(problem.measured)), problem.negligible)
    return [0.5 / (share * down) for share in _BELOW]


def wear_starts(problem: Problem, path: PathSpec, parameter: Parameter) -> list[float]:
    """Where a worn place of the bore, and how soon its wear ends, begin: somewhere along the run's way."""
    low, high = _ends(problem, path)
    half = max(0.5 * (high - low), problem.negligible)
    if parameter.quantity is Quantity.PER_OUTPUT:
        return [bend / half for bend in _WORN_BENDS]
    return [0.5 * (low + high) + share * half for share in _WORN_AT]
