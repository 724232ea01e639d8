"""Whether a dead zone is the overlap of a valve, and not a limit, a kink or a bias under its name."""

import numpy as np

from ..core.channels import Channel
from ..core.models import PathSpec
from .problem import Problem

REACHED = 0.02  # of the run: less beyond a kink does not show it
BLUNTEST_BAND = 4.0  # rounding, times the half-width of a band about a working voltage: more is a curve
WORKING = 0.5  # a valve that works about a voltage more than about 0 V
MOST_LEAKY = 0.3  # share that passes within a band, of which one edge is out of reach: more is a kink


def laps(path: PathSpec, problem: Problem) -> bool:
    """Whether a dead zone is an overlap: a band about 0 V, corners included, or about where its valve works.

    One that no voltage goes into, beside a bias, is a part of that.
    """
    band = path.effect("dead_zone").parameters
    width = band["half_width_v"]
    voltage, low, high = problem.simulator.voltage_v, band["centre_v"] - width, band["centre_v"] + width
    biases = [effect.parameters["bias_v"] for effect in path.effects if effect.name == "bias"]
    shifted = (voltage + offset for offset in (0.0, *biases))
    if biases and not any(np.any((low < volts) & (volts < high)) for volts in shifted):
        return False
    if band["leak"] > MOST_LEAKY and min(np.mean(voltage < low), np.mean(voltage > high)) < REACHED:
        return False
    if problem.channel is Channel.PRESSURE and band["working"] > WORKING:
        # One that no voltage comes out of again is a limit, one that none goes into a bias.
        beyond = float(np.mean(voltage > high))
        return band["rounding_v"] <= BLUNTEST_BAND * width and REACHED <= beyond <= 1.0 - REACHED
    return abs(band["centre_v"]) <= width + 2.0 * band["rounding_v"]
