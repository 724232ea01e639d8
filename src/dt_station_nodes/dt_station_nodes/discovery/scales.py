"""What a run spans: the range of each quantity, by which starts and bounds are scaled, and what drives it."""

import numpy as np
from numpy.typing import NDArray

from ..core.channels import Channel
from ..core.models import PathSpec
from ..core.models.effects import Quantity
from ..core.run import Run
from .condense import slowest_s
from .noise import difference_noise

Array = NDArray[np.float64]

# Noise in a voltage, of its standard deviation, by which a holding loop is told from an open one.
_HELD = 1e-3


# The sample time and the lag of the rigs that the library's times are written for; how much slower a rig may be, or a
# run may last (s), before they no longer stand as they are written.
SAMPLE_S = 0.02
_LAG_S = 0.25
_PACE = (0.25, 5.0)
_RUN_S = (10.0, 120.0)


def _beyond(value: float, low: float, high: float) -> float:
    """How far a value is out of a range, as a factor; 1 within."""
    return value / min(max(value, low), high)


def scales(run: Run, channel: Channel, path: PathSpec, load: Array) -> dict[Quantity, float]:
    """The run's range of each quantity; `load` (n,) Pa, empty where none is measured."""
    voltage = run.signals[channel.voltage_signal]
    above = run.signals[channel.signal] - path.rest
    high = max(float(np.quantile(np.abs(voltage), 0.98)), 1e-9)
    changes = np.abs(np.diff(voltage))
    output = max(float(np.abs(above).max()), 1e-12)
    travel = max(float(np.abs(above - above.mean()).max()), 1e-12)
    velocity = np.abs(np.diff(above)) / run.sample_time_s
    speed = max(float(np.quantile(velocity, 0.9)), 1e-12)
    loading = load if len(load) else above
    load_swing = max(float(np.quantile(np.abs(loading - loading.mean()), 0.9)), 1e-12)
    lost = speed / load_swing
    if channel is Channel.PRESSURE and len(path.denominator) > 1 and path.denominator[-1] and path.denominator[-2]:
        # A leak of so much per second loses as much as the path holds.
        lost = path.denominator[-1] / path.denominator[-2] / path.time_scale
    pace = _beyond(max(run.sample_time_s / SAMPLE_S, slowest_s(path) / _LAG_S), *_PACE)
    length = _beyond(len(run) * run.sample_time_s, *_RUN_S)
    return {
        Quantity.RATIO: 1.0,
        Quantity.INPUT: high,
        Quantity.INPUT_PEAK: max(float(np.abs(voltage).max()), 1e-9),
        Quantity.INPUT_RATE: max(float(changes.max()), 1e-3 * high) / run.sample_time_s,
        Quantity.OUTPUT: output,
        Quantity.SIGNAL: output,
        Quantity.PER_SIGNAL: 1.0 / output,
        Quantity.PER_SIGNAL_SQUARED: 1.0 / output**2,
        Quantity.PER_OUTPUT: 1.0 / output,
        Quantity.PER_OUTPUT_SQUARED: 1.0 / output**2,
        Quantity.PER_OUTPUT_CUBED: 1.0 / output**3,
        Quantity.VELOCITY: speed,
        Quantity.ACCELERATION: speed / pace,
        Quantity.TIME: pace,
        Quantity.RUN_TIME: length,
        Quantity.RATE: 1.0 / pace,
        Quantity.RUN_RATE: 1.0 / length,
        Quantity.FREQUENCY: 1.0 / pace,
        Quantity.ANGLE: 1.0,
        Quantity.PER_LOAD: 1.0 / load_swing,
        Quantity.VELOCITY_PER_LOAD: lost,
        Quantity.INPUT_PER_OUTPUT: high / travel,
        Quantity.INPUT_PER_VELOCITY_SQUARED: high / speed**2,
        Quantity.INPUT_PER_OUTPUT_CUBED: high / travel**3,
    }


def _beside(power: Array, peak: int) -> float:
    """How far beside its highest sample, in samples, a smooth peak lies: the parabola through three logarithms."""
    if not 0 < peak < len(power) - 1:
        return 0.0
    left, middle, right = np.log(np.maximum(power[peak - 1 : peak + 2], 1e-9 * power[peak]))
    return float(0.5 * (left - right) / (left - 2.0 * middle + right))


def excitations_hz(run: Run) -> tuple[float, ...]:
    """Fundamental frequencies (Hz) of the set-points that move, of voltages where there is no set-point."""
    found = []
    for channel in Channel:
        values = run.get(channel.setpoint_signal)
        if values is None or not np.isfinite(values).all() or not np.ptp(values) > 0.0:
            values = run.get(channel.voltage_signal)
            # A loop that holds its place answers what disturbs it, its sensor's noise too; that excites nothing.
            if values is None or difference_noise(values) > _HELD * float(np.std(values)):
                continue
        if not np.ptp(values) > 0.0:
            continue
        n = len(values)
        power = np.abs(np.fft.rfft((values - values.mean()) * np.hanning(n), 4 * n)) ** 2
        frequencies = np.fft.rfftfreq(4 * n, run.sample_time_s)
        power[frequencies < 1.5 / (n * run.sample_time_s)] = 0.0
        peak = int(np.argmax(power))
        near = np.abs(frequencies - frequencies[peak]) < 3.0 / (n * run.sample_time_s)
        if power[near].sum() > 0.4 * power.sum():
            found.append(float(frequencies[peak] + _beside(power, peak) * frequencies[1]))
    return tuple(found)
