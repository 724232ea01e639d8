"""Stage 8: the waveform that tells most of the explanations left apart, found by simulating each of them."""

from dataclasses import replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from ..core.channels import Channel
from ..core.waveforms import Shape, Waveform, waveform_samples
from .channel import Finding
from .hypothesis_fit import fit_hypothesis
from .problem import Problem
from .reach import simulated, within_reach
from .result import NextExperiment
from .selection import Explanation
from .windows import make_windows

Array = NDArray[np.float64]

_SHAPES = (Shape.SQUARE, Shape.SINE, Shape.TRIANGLE)
_FREQUENCIES_HZ = (0.1, 0.4, 1.5)
_LEVELS = (0.25, 1.0)
_NO_EFFECT = "other parameters"
_SECONDS = 24.0
_LEAST = 0.15  # times the noise, RMS: over a run's samples several times what names are told apart by


def _proposals(problem: Problem) -> list[Waveform]:
    voltage = problem.simulator.voltage_v
    high = max(float(np.quantile(np.abs(voltage), 0.98)), 1e-6)
    centre = 0.0 if problem.windows.anchored else 0.5 * high
    found = []
    for shape in _SHAPES:
        for frequency in _FREQUENCIES_HZ:
            for level in _LEVELS:
                amplitude = level * high * (1.0 if problem.windows.anchored else 0.5)
                found.append(Waveform(shape, amplitude, centre, frequency))
    return found


def _missed(problem: Problem, truth: Explanation, refitted: Explanation, voltage: Array) -> float:
    """RMS by which an explanation, refitted to what another one would give, still differs (over sigma)."""
    made, target = simulated(problem, truth.fit.path, voltage)
    windows = make_windows(len(voltage), made.sample_time_s, 3.0, problem.windows.anchored)
    imagined = replace(
        problem, simulator=made, measured=target, windows=windows, weights=np.ones(len(voltage)), noise=problem.noise
    )
    start = replace(refitted.fit.hypothesis, path=refitted.fit.path)
    fit = fit_hypothesis(imagined, start, [refitted.fit.fitted.x], iterations=3)
    return float((fit.rss / len(voltage)) ** 0.5)


def _apart(problem: Problem, one: Explanation, other: Explanation, voltage: Array) -> float:
    """How far two explanations differ even after refitting (RMS over sigma).

    Of two of which one holds the other, the smaller is refitted: the larger can always be it.
    """
    if set(one.added) < set(other.added):
        return _missed(problem, other, one, voltage)
    return _missed(problem, one, other, voltage)


def propose(finding: Finding, rivals: list[Explanation]) -> NextExperiment | None:
    """The best of a table of waveforms (open loop, volts) for telling the best explanation from `rivals`."""
    if not rivals:
        return None
    problem = finding.problem
    step = problem.simulator.sample_time_s
    samples = min(round(_SECONDS / step), 4000)
    pairs = list(combinations([finding.best, *rivals], 2))
    scored = []
    for proposal in _proposals(problem):
        waveform = within_reach(problem, finding.best.fit.path, proposal, samples)
        voltage = waveform_samples(waveform, step, samples)
        told = [d for d in (_apart(problem, one, other, voltage) for one, other in pairs) if d >= _LEAST]
        scored.append(((len(told), min(told, default=0.0)), waveform))
    # As many pairs as can be: two names that nothing tells apart are no reason to leave the others open.
    (_, best), waveform = max(scored, key=lambda pair: pair[0])
    if best < _LEAST:
        return None
    names = tuple(dict.fromkeys("+".join(e.added) or _NO_EFFECT for e in (finding.best, *rivals)))
    channel: Channel = problem.channel
    why = (
        f"{' and '.join(names)} explain this run equally well; under this voltage those it tells apart differ "
        f"by at least {best:.1f} times the noise, even after refitting"
    )
    return NextExperiment(
        why,
        channel,
        waveform.shape.name.lower(),
        waveform.amplitude,
        waveform.offset,
        waveform.frequency_hz,
        waveform.duty,
        samples * step,
        "voltage",
    )
