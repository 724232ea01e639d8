"""Stage 8: the waveform that separates two explanations best, found by simulating both."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..core.channels import Channel
from ..core.models import PathSimulator
from ..core.waveforms import Shape, Waveform, WaveformGenerator
from .channel import Finding
from .hypothesis_fit import fit_hypothesis
from .problem import Problem
from .result import NextExperiment
from .selection import Explanation
from .windows import make_windows

Array = NDArray[np.float64]

_SHAPES = (Shape.SQUARE, Shape.SINE, Shape.TRIANGLE)
_FREQUENCIES_HZ = (0.1, 0.4, 1.5)
_LEVELS = (0.25, 1.0)
_SECONDS = 24.0


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


def _drive(waveform: Waveform, samples: int, sample_time_s: float) -> Array:
    generator = WaveformGenerator(sample_time_s)
    state = generator.initial_state(waveform)
    values = np.empty(samples)
    for k in range(samples):
        state, values[k] = generator.step(state, None)
    return values


def _apart(problem: Problem, one: Explanation, other: Explanation, voltage: Array) -> float:
    """RMS by which the other explanation, refitted to what the first would give, still differs (over sigma)."""
    simulator = problem.simulator
    load = np.resize(simulator.load_pa, len(voltage)) if len(simulator.load_pa) else simulator.load_pa
    made = PathSimulator(simulator.channel, simulator.sample_time_s, voltage, load, simulator.rest_pa, simulator.first)
    target = made.simulate(one.fit.path)
    windows = make_windows(len(voltage), simulator.sample_time_s, 3.0, problem.windows.anchored)
    imagined = replace(
        problem, simulator=made, measured=target, windows=windows, weights=np.ones(len(voltage)), noise=problem.noise
    )
    start = replace(other.fit.hypothesis, path=other.fit.path)
    fit = fit_hypothesis(imagined, start, [other.fit.fitted.x], iterations=3)
    return float((fit.rss / len(voltage)) ** 0.5)


def propose(finding: Finding, rivals: list[Explanation]) -> NextExperiment | None:
    """The best of a table of waveforms (open loop, volts) for telling the best explanation from `rivals`."""
    if not rivals:
        return None
    problem = finding.problem
    step = problem.simulator.sample_time_s
    samples = min(round(_SECONDS / step), 4000)
    scored = []
    for waveform in _proposals(problem):
        voltage = _drive(waveform, samples, step)
        worst = min(_apart(problem, finding.best, rival, voltage) for rival in rivals)
        scored.append((worst, waveform))
    best, waveform = max(scored, key=lambda pair: pair[0])
    if best < 1.0:
        return None
    names = tuple(dict.fromkeys(("+".join(finding.best.added), *("+".join(r.added) for r in rivals))))
    channel: Channel = problem.channel
    why = (
        f"{' and '.join(names)} explain this run equally well; under this voltage they differ by "
        f"{best:.1f} times the noise even after refitting"
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
        names,
    )
