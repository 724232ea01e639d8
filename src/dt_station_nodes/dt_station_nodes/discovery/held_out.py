"""Blocks held out of the fit in turn: what an explanation says of samples that its numbers were not tuned on."""

from dataclasses import replace
from itertools import pairwise

import numpy as np

from .hypothesis_fit import Fit, fit_hypothesis
from .problem import Problem

FOLDS = 5
ITERATIONS = 5


def held_out_power(problem: Problem, fit: Fit) -> float:
    """Sum of squares (unit^2) of a residual whose every block comes from numbers fitted to the other blocks.

    Blocks are contiguous, so that what a slow path remembers cannot carry the answer from one into the next.
    """
    samples = len(problem.measured)
    edges = np.linspace(0, samples, FOLDS + 1).round().astype(np.int64)
    hypothesis = replace(fit.hypothesis, path=fit.path)
    total = 0.0
    for start, stop in pairwise(edges):
        mask = np.ones(samples)
        mask[start:stop] = 0.0
        found = fit_hypothesis(problem, hypothesis, [fit.fitted.x], ITERATIONS, mask=mask)
        part = found.residual[start:stop]
        total += float(part @ part)
    return total
