"""The static characteristic from a slow triangle: gain, dead zone, saturation and hysteresis width, both branches."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

import numpy as np
from numba import njit
from scipy.optimize import least_squares

from ..core.channels import Channel
from ..core.run import Array, Run
from .errors import IdentificationError
from .estimate import Interval, fit_percent
from .excitation import check_excitation, check_response, signal_of
from .noise import Z95, noise_colour
from .station import output_scale

BRANCH_BINS = 60
MOST_RESIDUALS = 3000


@dataclass(frozen=True)
class Branch:
    """Mean output over voltage on one way of the loop; arrays of shape (n,), output as in `StaticCharacteristic`."""

    voltage_v: Array
    output: Array


@dataclass(frozen=True)
class StaticCharacteristic:
    """What a slow triangle shows. Outputs are in units of `scale` (of an integrating path: per second).

    `hysteresis_half_width_v`, `dead_zone_half_width_v` and the saturation limits (V behind the dead zone, as the effect
    of that name has them) are None where the run shows none of it.
    """

    channel: Channel
    integrating: bool
    scale: float
    rest: Interval
    gain: Interval
    hysteresis_half_width_v: Interval | None
    dead_zone_half_width_v: Interval | None
    dead_zone_centre_v: Interval | None
    saturation_upper_v: Interval | None
    saturation_lower_v: Interval | None
    rising: Branch
    falling: Branch
    fit_percent: float
    measured_range_v: tuple[float, float]


@njit(cache=True)
def play(signal: Array, half_width: float) -> Array:
    """Play operator: follows the signal at a distance of half_width, from its first value."""
    out = np.empty_like(signal)
    value = signal[0]
    for k in range(signal.size):
        value = min(max(value, signal[k] - half_width), signal[k] + half_width)
        out[k] = value
    return out


def shaped(voltage: Array, parameters: Array) -> Array:
    """Effective voltage behind hysteresis, dead zone and saturation: (half width, half width, centre, upper, lower)."""
    width, dead, centre, upper, lower = parameters
    inner = play(voltage, width) - centre
    excess = np.sign(inner) * np.maximum(np.abs(inner) - dead, 0.0)
    return np.asarray(np.clip(centre + excess, lower, upper))


def static_characteristic(run: Run, channel: Channel, lag_s: float = 0.0) -> StaticCharacteristic:
    """Fit the characteristic to a slow run; `lag_s` is the linear path's lag, which otherwise widens the loop.

    On the pressure path the output is the pressure itself, on the position path its rate. Raises
    IdentificationError where the voltage does not move or moves too fast to be called slow.
    """
    check_excitation(run, channel.voltage_signal)
    check_response(run, channel)
    integrating = channel is Channel.POSITION
    scale = output_scale(run, channel)
    voltage = signal_of(run, channel.voltage_signal)
    output = signal_of(run, channel.signal) / scale
    shift = round(lag_s / run.sample_time_s)
    if shift:
        voltage, output = voltage[:-shift], output[shift:]
    swing = float(np.ptp(voltage))
    if _reversals(voltage, 0.5 * swing) < 2:
        raise IdentificationError(
            f"{run.source or 'The run'}: {channel.voltage_signal} does not go up and down; "
            "run a slow triangle over at least one whole period."
        )
    stride = max(1, len(output) // MOST_RESIDUALS)
    window = max(stride, len(output) // 300) if integrating else 1
    target = _observed(output, integrating, window, stride, run.sample_time_s)
    low, high = float(voltage.min()), float(voltage.max())

    # a run on one side of zero says nothing about the dead zone's middle
    free = np.ones(7, dtype=bool)
    free[2] = low < 0.0 < high

    def model(theta: Array) -> Array:
        effective = shaped(voltage, theta[:5])
        if integrating:
            effective = np.concatenate(([0.0], np.cumsum(effective[:-1]) * run.sample_time_s))
        return theta[5] + theta[6] * _observed(effective, integrating, window, stride, run.sample_time_s)

    def widened(partial: Array) -> Array:
        theta = np.zeros(7)
        theta[free] = partial
        return theta

    limits = (
        np.array([0.0, 0.0, -0.5 * swing, low - swing, low - swing, -np.inf, -np.inf])[free],
        np.array([0.5 * swing, 0.5 * swing, 0.5 * swing, high + swing, high + swing, np.inf, np.inf])[free],
    )
    best = None
    for width, dead, reach in product((0.0, 0.05), (0.0, 0.1), (1.0, 0.8)):
        start = _start(voltage, model, target, width * swing, dead * swing, reach)
        x_scale = np.array([0.1, 0.1, 0.1, 0.3, 0.3, 0.0, 0.0]) * swing
        x_scale[5:] = np.maximum(np.abs(start[5:]), 1e-3 * np.ptp(target))
        found = least_squares(
            lambda partial: model(widened(partial)) - target,
            start[free],
            bounds=limits,
            x_scale=x_scale[free],
            diff_step=1e-4,
            max_nfev=60,
        )
        if best is None or found.cost < best.cost:
            best = found
    assert best is not None
    theta = widened(best.x)
    jacobian = np.zeros((target.size, 7))
    jacobian[:, free] = best.jac
    return _read_off(run, channel, theta, jacobian, target, model(theta), voltage, output)


def _start(
    voltage: Array, model: Callable[[Array], Array], target: Array, width: float, dead: float, reach: float
) -> Array:
    middle, half = 0.5 * (voltage.max() + voltage.min()), 0.5 * float(np.ptp(voltage))
    theta = np.array([width, dead, 0.0, middle + reach * half, middle - reach * half, 0.0, 1.0])
    shape = model(theta)
    columns = np.column_stack([np.ones_like(shape), shape])
    theta[5:] = np.linalg.lstsq(columns, target, rcond=None)[0]
    return theta


def _observed(output: Array, integrating: bool, window: int, stride: int, sample_time_s: float) -> Array:
    """The output, or the mean rate over a window of an integrating path, every stride samples."""
    if not integrating:
        return output[::stride]
    return ((output[window:] - output[:-window]) / (window * sample_time_s))[::stride]


def _reversals(signal: Array, least: float) -> int:
    """Number of times the signal turns by at least that much."""
    turns, direction, extreme = 0, 0, float(signal[0])
    for value in signal:
        if direction == 0:
            if abs(value - signal[0]) >= least:
                direction, extreme, turns = (1 if value > signal[0] else -1), float(value), 1
        elif direction * (value - extreme) > 0.0:
            extreme = float(value)
        elif abs(value - extreme) >= least:
            direction, extreme, turns = -direction, float(value), turns + 1
    return turns


def _read_off(
    run: Run,
    channel: Channel,
    theta: Array,
    jacobian: Array,
    target: Array,
    fitted: Array,
    voltage: Array,
    output: Array,
) -> StaticCharacteristic:
    active = np.linalg.norm(jacobian, axis=0) > 0.0
    noise = noise_colour(target - fitted, int(active.sum()))
    half = np.full(theta.size, np.inf)
    half[active] = Z95 * np.sqrt(np.maximum(np.diag(noise.covariance(jacobian[:, active])), 0.0))
    intervals = [Interval(float(v), float(v - h), float(v + h)) for v, h in zip(theta, half, strict=True)]
    integrating = channel is Channel.POSITION
    low, high = float(voltage.min()), float(voltage.max())
    reached = shaped(voltage, np.array([theta[0], theta[1], theta[2], np.inf, -np.inf]))
    reach = 0.01 * (high - low)
    width, dead = intervals[0], intervals[1]
    two_sided = low < 0.0 < high
    dead_seen = dead.low > 0.0 and dead.value > 0.002 * (high - low)
    return StaticCharacteristic(
        channel,
        integrating,
        output_scale(run, channel),
        intervals[5],
        intervals[6],
        width if width.low > 0.0 and width.value > 0.002 * (high - low) else None,
        dead if dead_seen else None,
        intervals[2] if dead_seen and two_sided else None,
        intervals[3] if active[3] and theta[3] < reached.max() - reach else None,
        intervals[4] if active[4] and theta[4] > reached.min() + reach else None,
        *_branches(voltage, output, run.sample_time_s, integrating),
        fit_percent(target, fitted),
        (low, high),
    )


def _branches(voltage: Array, output: Array, sample_time_s: float, integrating: bool) -> tuple[Branch, Branch]:
    """Mean output in bins of voltage, apart for rising and falling voltage."""
    lag = max(2, voltage.size // 300)
    middle = slice(lag, voltage.size - lag)
    direction = voltage[2 * lag :] - voltage[: -2 * lag]
    level = (output[2 * lag :] - output[: -2 * lag]) / (2 * lag * sample_time_s) if integrating else output[middle]
    edges = np.linspace(voltage.min(), voltage.max(), BRANCH_BINS + 1)
    where = np.clip(np.digitize(voltage[middle], edges) - 1, 0, BRANCH_BINS - 1)
    branches = []
    for sign in (1.0, -1.0):
        chosen = sign * direction > 0.0
        counts = np.bincount(where[chosen], minlength=BRANCH_BINS)
        sums = np.bincount(where[chosen], weights=level[chosen], minlength=BRANCH_BINS)
        volts = np.bincount(where[chosen], weights=voltage[middle][chosen], minlength=BRANCH_BINS)
        full = counts > 0
        branches.append(Branch(volts[full] / counts[full], sums[full] / counts[full]))
    return branches[0], branches[1]
