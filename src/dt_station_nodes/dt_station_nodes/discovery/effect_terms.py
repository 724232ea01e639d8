"""The free numbers of an effect: their bounds and steps, by the run's range of what they measure."""

import numpy as np

from ..core.models.effects import Attachment, Parameter, Quantity
from .problem import Problem
from .scales import SAMPLE_S
from .terms import Term

# Slopes over more would lead from one shallow minimum into another.
_ROUGH_GRAIN = 0.005
_OF_SIGNAL = {Quantity.SIGNAL: 1.0, Quantity.PER_SIGNAL: -1.0, Quantity.PER_SIGNAL_SQUARED: -2.0}  # powers of it


def unit_of(problem: Problem, parameter: Parameter, at: Attachment) -> float:
    """The run's range of what a parameter measures, for an effect at a place."""
    if at is Attachment.INPUT and parameter.quantity in _OF_SIGNAL:
        return problem.scales[Quantity.INPUT] ** _OF_SIGNAL[parameter.quantity]
    return problem.scales[parameter.quantity]


def effect_term(problem: Problem, index: int, parameter: Parameter, at: Attachment) -> Term:
    """The term of one effect parameter, bounds scaled by the run."""
    unit = unit_of(problem, parameter, at)
    logarithmic = parameter.quantity in (Quantity.INPUT_RATE, Quantity.FREQUENCY)
    lower, upper = parameter.lower * unit, parameter.upper * unit
    if parameter.quantity is Quantity.FREQUENCY:
        # However slow a path, its run shows what its samples can.
        upper = max(upper, parameter.upper * SAMPLE_S / problem.simulator.sample_time_s)
    if logarithmic and lower <= 0.0:
        lower = 1e-4 * upper
    grain = min(parameter.grain_on(problem.channel), _ROUGH_GRAIN if problem.rough else np.inf)
    return Term(index, parameter.name, lower, upper, unit, logarithmic, grain=grain)
