"""Where a mode begins: about the peaks of what is left, as large as that says."""

from itertools import product

import numpy as np

from ..core.models import PathSpec
from .candidates import Candidate, add_effect
from .problem import Problem
from .spectrum import spectral_peaks

_MODE = "resonance"
_SIZES = ("share", "riding")
_SMALL = 0.01  # so little of a mode moves the output in proportion
_DAMPING = (0.01, 0.03, 0.1)
_LINES = (-1.0, -0.5, 0.0, 0.5, 1.0)  # about a peak, a line being a turn in the run


def mode_starts(problem: Problem, path: PathSpec, candidate: Candidate) -> list[PathSpec]:
    """The path with a mode about each peak of what it leaves, share and riding by least squares; no other effect's.

    A narrow mode has its phase from both: begun with one of them, or a turn beside its frequency, no fit finds it.
    """
    if candidate.name != _MODE or candidate.apart:
        return []
    found: list[PathSpec] = []
    lowest = candidate.effect.parameter("frequency_hz").lower
    none = {"frequency_hz": lowest, "damping": 1.0, **dict.fromkeys(_SIZES, 0.0)}
    residual = problem.residual(add_effect(path, candidate, none))
    for peak, line, damping in product(spectral_peaks(residual, problem.simulator.sample_time_s), _LINES, _DAMPING):
        frequency_hz = peak + line / problem.length_s
        if frequency_hz < lowest:
            continue
        mode = {**none, "frequency_hz": frequency_hz, "damping": damping}
        moved = (add_effect(path, candidate, {**mode, name: _SMALL}) for name in _SIZES)
        slopes = np.column_stack([(residual - problem.residual(one)) / _SMALL for one in moved])
        size = np.linalg.lstsq(slopes, residual, rcond=None)[0]
        found.append(add_effect(path, candidate, {**mode, **dict(zip(_SIZES, map(float, size), strict=True))}))
    return found
