"""Whether an overflow is what its name says: a piston's stop, or a valve that relieves."""

import numpy as np

from ..core.channels import Channel
from ..core.models import PathSpec
from .problem import Problem

_STEEPEST_VALVE = 1.6  # exponent: an opening in proportion, an orifice's root, and a little
_MOST_OVERRIDE = 0.45  # share of what comes on top of a limit that is left,
_WEAKEST_VALVE = 0.8  # and by a weak relief valve
_SHUT = 0.02  # of the run: a valve that is less is always open
_ALL_SAID = 1.1  # times the noise,
_TRACE = 0.1  # where there is any, and of what no one would call a gap
_HEARD = 3.0  # times the noise: a stop that is pressed against is not overrun
_OFTEN = 0.5  # of the run beyond a stop: what gives way so much is a leak


def all_said(path: PathSpec, problem: Problem) -> bool:
    """Whether a path leaves nothing but noise, and a trace of form error where there is none."""
    nothing = np.hypot(problem.noise, _TRACE * problem.negligible)
    return bool(np.std(problem.residual(path)) < _ALL_SAID * nothing)


def limits(path: PathSpec, problem: Problem) -> bool:
    """Whether an overflow is a piston's stop, seldom overrun and opening for nothing, or a valve that relieves.

    A valve that is never shut or opens more than in proportion is a bend in a curve. So is what leaves most of what
    comes on top, but for a relief valve that leaves nothing else to be said.
    """
    stop = path.effect("overflow").parameters
    relieves = stop["override"] <= _MOST_OVERRIDE
    if problem.windows.anchored:
        beyond = float(np.mean(problem.measured - path.rest > stop["limit"] + _HEARD * problem.noise))
        return relieves and stop["opening_s"] == 0.0 and stop["reseat"] == 0.0 and beyond <= _OFTEN
    shut = float(np.mean(problem.measured - path.rest < stop["limit"]))
    valve = shut >= _SHUT and stop["weir_exponent"] <= _STEEPEST_VALVE
    weak = stop["override"] <= _WEAKEST_VALVE and all_said(path, problem)
    return (relieves or weak) and (problem.channel is not Channel.PRESSURE or valve)
