"""Where no effect earns a name: nothing missing, parameters off, or something that cannot be explained."""

import numpy as np
from numpy.typing import NDArray

from .measure import SEEN, Measure
from .noise import effective_samples, whiteness
from .result import Verdict
from .selection import Bench, Explanation

Array = NDArray[np.float64]

ENOUGH_TO_REFIT = 12.0
ROUGH_FORM = 0.01  # of the signal: a linear path refitted as a whole that misses less has nothing to explain
NOT_WHITE = 4.0  # times the squared autocorrelation of white noise
NOTHING = 0.01  # of the noise power: refitted parameters that leave less leave nothing
AS_NOISE = 0.1  # of the noise power, left by refitted parameters,
AS_GIVEN = 0.005  # where it is so little of what they were off


def fits_roughly(null: Explanation, measure: Measure) -> bool:
    """Whether a linear path refitted to rough data leaves no more than its form: timing within a sample, say."""
    residual, signal = null.fit.residual, measure.bench.problem.signal
    return measure.rough and float(residual @ residual) < len(residual) * (ROUGH_FORM * signal) ** 2


def silent_verdict(bench: Bench, given: Array, null: Explanation, measure: Measure) -> Verdict:
    """The verdict where no effect earns a name."""
    problem = bench.problem
    over = measure.left(null) if measure.seen(null) and not fits_roughly(null, measure) else 0.0
    unlike_noise = whiteness(null.fit.residual) > NOT_WHITE
    if over > 1.0 * measure.noise or (over > 0.25 * measure.noise and unlike_noise):
        return Verdict.UNEXPLAINED
    count = len(problem.measured)
    if float(given @ given) / count - measure.floors[0] < (SEEN * problem.negligible) ** 2:
        return Verdict.NOTHING_MISSING
    negligible = problem.negligible**2
    ratio = (float(given @ given) / count + negligible) / (null.powers[0] / count + negligible)
    worth = effective_samples(null.fit.residual)
    refit = worth * np.log(ratio) - null.fit.freedoms * np.log(worth)
    return Verdict.PARAMETERS_ONLY if refit > ENOUGH_TO_REFIT else Verdict.NOTHING_MISSING


def as_parameters(null: Explanation, given: Array, measure: Measure) -> bool:
    """Whether refitted parameters leave so little of a gap that it is how a rig is off in more than they can say."""
    gap = float(given @ given) / len(given) - measure.floors[0]
    over = measure.left(null) / measure.noise
    return not measure.rough and (over < NOTHING or (over < AS_NOISE and measure.gaps(null)[0] < AS_GIVEN * gap))
