"""What another voltage would do to the object, and how far it may drive it in open loop."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..core.models import PathSimulator, PathSpec
from ..core.models.effects import Quantity
from ..core.waveforms import Waveform, WaveformGenerator
from .problem import Problem

Array = NDArray[np.float64]

_TRAVEL = 1.5  # times the travel of the run is what an output that integrates may be asked for
_PASSES = 2  # between its travel and the voltage at which it stays,
_ROUNDS = 3  # of the search for that,
_FIRST_STEP = 0.05  # of the amplitude
_MOST_OFFSET = 0.5  # of the run's highest voltage
_HELPS = 0.5  # times the drift without it is the most that an offset may leave
_STAYS = 0.05  # of the travel: what drifts by less in the whole run is left alone


def drive(waveform: Waveform, samples: int, sample_time_s: float) -> Array:
    """A waveform's voltage (V), shape (samples,)."""
    generator = WaveformGenerator(sample_time_s)
    state = generator.initial_state(waveform)
    values = np.empty(samples)
    for k in range(samples):
        state, values[k] = generator.step(state, None)
    return values


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
    most = _TRAVEL * float(np.ptp(problem.measured))
    for _ in range(_PASSES):
        waveform = _balanced(problem, path, waveform, samples)
        travel = float(np.ptp(_moved(problem, path, waveform, samples)))
        waveform = replace(waveform, amplitude=waveform.amplitude * min(1.0, most / max(travel, 1e-12)))
    return _balanced(problem, path, waveform, samples)


def _moved(problem: Problem, path: PathSpec, waveform: Waveform, samples: int) -> Array:
    return simulated(problem, path, drive(waveform, samples, problem.simulator.sample_time_s))[1]


def _balanced(problem: Problem, path: PathSpec, waveform: Waveform, samples: int) -> Waveform:
    """With the offset at which the output comes back after whole periods: a search by secants."""
    period = 1.0 / (waveform.frequency_hz * problem.simulator.sample_time_s)
    whole = int(samples / period)
    # What moved at first has come to rest by the last of them.
    first, last = (round((whole - 1) * period) - 1, round(whole * period) - 1) if whole > 1 else (0, samples - 1)

    moved = _moved(problem, path, waveform, samples)
    if max(whole, 1) * abs(moved[last] - moved[first]) <= _STAYS * float(np.ptp(moved)):
        return waveform

    def drift(offset: float) -> float:
        moved = _moved(problem, path, replace(waveform, offset=offset), samples)
        return float(moved[last] - moved[first])

    most = _MOST_OFFSET * problem.scales[Quantity.INPUT_PEAK]
    offsets = [waveform.offset, waveform.offset + _FIRST_STEP * waveform.amplitude]
    drifts = [drift(offset) for offset in offsets]
    for _ in range(_ROUNDS):
        change = drifts[-1] - drifts[-2]
        if abs(change) <= 1e-9 * abs(drifts[-1]):
            break
        moves = -drifts[-1] * (offsets[-1] - offsets[-2]) / change
        offsets.append(float(np.clip(offsets[-1] + moves, -most, most)))
        if offsets[-1] == offsets[-2]:
            break
        drifts.append(drift(offsets[-1]))
    best = int(np.argmin(np.abs(drifts)))
    # What comes back by itself is hardly moved by an offset.
    return replace(waveform, offset=offsets[best]) if abs(drifts[best]) < _HELPS * abs(drifts[0]) else waveform
