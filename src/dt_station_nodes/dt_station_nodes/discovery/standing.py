"""Whether a reading that stays the same is one of something that stands."""

import numpy as np

from ..core.models import PathSpec
from .problem import Problem

STANDS = 2.0  # times what counts as nothing: RMS of what is left


def stands(problem: Problem, path: PathSpec) -> bool:
    """Whether a path explains the samples left out because they repeat: free of noise, a loop makes some too."""
    left_out = problem.weights == 0.0
    gap = problem.windows.project(problem.measured - problem.simulate(path))[left_out]
    return bool(np.sqrt(np.mean(np.square(gap))) < STANDS * problem.sigma)
