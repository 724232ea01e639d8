"""What another voltage would do to the object, and how far it may drive it in open loop."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..core.models import PathSimulator, PathSpec
from ..core.models.effects import Quantity
from ..core.waveforms import Waveform, waveform_samples
from .problem import Problem

Array = NDArray[np.float64]

_TRAVEL = 1.5  # times the travel of the run is what an output that integrates may be asked for
_PASSES = 2  # between its travel and the voltage at which it stays,
_ROUNDS = 3  # of the search for that,
_FIRST_STEP = 0.05  # of the amplitude
_MOST_OFFSET = 0.5  # of the run's highest voltage
_HELPS = 0.5  # times the drift without it is the most that an offset may leave
_STAYS = 0.05  # of the travel: what drifts by less in the whole run is left alone


def simulated(problem: Problem, path: PathSpec, voltage: Array) -> tuple[PathSimulator, Array]:
    """The run's object under another voltage (n,), its load going on as measured, and what it would give (n,)."""
    simulator = problem.simulator
    load = np.resize(simulator.load_pa, len(voltage)) if len(simulator.load_pa) else simulator.load_pa
    made = PathSimulator(simulator.channel, simulator.sample_time_s, voltage, load, simulator.rest_pa, simulator.first)
    return made, made.simulate(path)


def within_reach(problem: Problem, path: PathSpec, waveform: Waveform, samples: int) -> Waveform:
    """The waveform about the voltage at which an output that integrates stays, no further than the run went.

    In open loop a valve off its null would drive a piston out of its stroke.
    """
    if not problem.windows.anchored:
        return waveform
    shape = waveform_samples(replace(waveform, amplitude=1.0, offset=0.0), problem.simulator.sample_time_s, samples)
    most = _TRAVEL * float(np.ptp(problem.measured))
    for _ in range(_PASSES):
        waveform = _balanced(problem, path, waveform, shape)
        travel = float(np.ptp(_moved(problem, path, waveform, shape)))
        waveform = replace(waveform, amplitude=waveform.amplitude * min(1.0, most / max(travel, 1e-12)))
    return _balanced(problem, path, waveform, shape)


def _moved(problem: Problem, path: PathSpec, waveform: Waveform, shape: Array) -> Array:
    """Where a waveform drives the output, `shape` (n,) being it at amplitude 1 about 0."""
    return simulated(problem, path, waveform.offset + waveform.amplitude * shape)[1]


def _balanced(problem: Problem, path: PathSpec, waveform: Waveform, shape: Array) -> Waveform:
    """With the offset at which the output comes back after whole periods: a search by secants."""
    samples = len(shape)
    period = 1.0 / (waveform.frequency_hz * problem.simulator.sample_time_s)
    whole = int(samples / period)
    # What moved at first has come to rest by the last of them.
    first, last = (round((whole - 1) * period) - 1, round(whole * period) - 1) if whole > 1 else (0, samples - 1)

    def drift(moved: Array) -> float:
        return float(moved[last] - moved[first])

    def at(offset: float) -> tuple[float, float]:
        return drift(_moved(problem, path, replace(waveform, offset=offset), shape)), offset

    moved = _moved(problem, path, waveform, shape)
    alone = drift(moved)
    if max(whole, 1) * abs(alone) <= _STAYS * float(np.ptp(moved)):
        return waveform
    most = _MOST_OFFSET * problem.scales[Quantity.INPUT_PEAK]
    tried = [(alone, waveform.offset), at(waveform.offset + _FIRST_STEP * waveform.amplitude)]
    for _ in range(_ROUNDS):
        (before, back), (now, here) = tried[-2:]
        if abs(now - before) <= 1e-9 * abs(now):
            break
        there = float(np.clip(here - now * (here - back) / (now - before), -most, most))
        if there == here:
            break
        tried.append(at(there))
    left, offset = min(tried, key=lambda one: abs(one[0]))
    # What comes back by itself is hardly moved by an offset.
    return replace(waveform, offset=offset) if abs(left) < _HELPS * abs(alone) else waveform
