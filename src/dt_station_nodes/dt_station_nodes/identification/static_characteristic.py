"""The static characteristic from a slow triangle: gain, dead zone, saturation and hysteresis width, both branches."""

from dataclasses import dataclass

import numpy as np

from ..core.channels import Channel
from ..core.run import Array, Run
from .errors import IdentificationError
from .estimate import Interval, fit_percent
from .excitation import check_excitation, check_response, signal_of
from .noise import Z95, noise_colour
from .static_shape import (
    CENTRE,
    DEAD,
    GAIN,
    HALF_WIDTH,
    LOWER,
    REST,
    SPREAD,
    UPPER,
    StaticData,
    fit_shape,
    lagged,
    observed,
)
from .station import output_scale

BRANCH_BINS = 60
MOST_RESIDUALS = 3000
LEAST_SHARE = 0.002
"""Features narrower than this share of the voltage's swing are not told from none."""


@dataclass(frozen=True)
class Branch:
    """Mean output over voltage on one way of the loop; arrays of shape (n,), output as in `StaticCharacteristic`."""

    voltage_v: Array
    output: Array


@dataclass(frozen=True)
class StaticCharacteristic:
    """What a slow triangle shows. Outputs are in units of `scale` (of an integrating path: per second).

    `null_v` is the voltage at which an integrating path stands still. `hysteresis_half_width_v` (and its
    `hysteresis_spread`: 0 sharp, 1 smooth), `dead_zone_half_width_v` and the saturation limits (V behind the dead
    zone, as the effect of that name has them) are None where the run shows none of it.
    """

    channel: Channel
    integrating: bool
    scale: float
    rest: Interval
    gain: Interval
    hysteresis_half_width_v: Interval | None
    hysteresis_spread: Interval | None
    dead_zone_half_width_v: Interval | None
    null_v: Interval | None
    saturation_upper_v: Interval | None
    saturation_lower_v: Interval | None
    rising: Branch
    falling: Branch
    fit_percent: float


def static_characteristic(run: Run, channel: Channel, lag_s: float = 0.0) -> StaticCharacteristic:
    """Fit the characteristic to a slow run; the linear path's lag, `lag_s`, otherwise widens and rounds the loop.

    On the pressure path the output is the pressure itself, on the position path its rate. Raises
    IdentificationError where the voltage does not go up and down.
    """
    check_excitation(run, channel.voltage_signal)
    check_response(run, channel)
    if not 0.0 <= lag_s < 0.25 * run.sample_time_s * len(run):
        raise IdentificationError(f"The lag must lie between 0 s and a quarter of the run, got {lag_s:g} s.")
    integrating = channel is Channel.POSITION
    scale = output_scale(run, channel)
    voltage = signal_of(run, channel.voltage_signal)
    output = signal_of(run, channel.signal) / scale
    if _reversals(voltage, 0.5 * float(np.ptp(voltage))) < 2:
        raise IdentificationError(
            f"{run.source or 'The run'}: {channel.voltage_signal} does not go up and down; "
            "run a slow triangle over at least one whole period."
        )
    stride = max(1, len(output) // MOST_RESIDUALS)
    window = max(stride, len(output) // 300) if integrating else 1
    target = observed(output, integrating, window, stride, run.sample_time_s)
    data = StaticData(voltage, target, integrating, window, stride, run.sample_time_s, lag_s)
    fitted = fit_shape(data)
    modelled = data.model(fitted.theta)
    intervals = _intervals(fitted.theta, fitted.jacobian, target - modelled)
    if integrating and data.two_sided:
        null, gain = intervals[CENTRE], float(fitted.theta[GAIN])
        intervals[REST] = Interval(-gain * null.value, -gain * null.high, -gain * null.low)

    def seen(feature: int) -> Interval | None:
        large = feature in (UPPER, LOWER) or fitted.theta[feature] > LEAST_SHARE * np.ptp(voltage)
        return intervals[feature] if fitted.free[feature] and large else None

    width = seen(HALF_WIDTH)
    return StaticCharacteristic(
        channel,
        integrating,
        scale,
        intervals[REST],
        intervals[GAIN],
        width,
        intervals[SPREAD] if width is not None and fitted.free[SPREAD] else None,
        seen(DEAD),
        intervals[CENTRE] if integrating and data.two_sided else None,
        seen(UPPER),
        seen(LOWER),
        *_branches(lagged(voltage, data.lag_s, run.sample_time_s), output, run.sample_time_s, integrating),
        fit_percent(target, modelled),
    )


def _intervals(theta: Array, jacobian: Array, residual: Array) -> list[Interval]:
    """95 % intervals with the residual's colour; a point where a parameter was fixed."""
    active = np.linalg.norm(jacobian, axis=0) > 0.0
    noise = noise_colour(residual, int(active.sum()))
    half = np.zeros(theta.size)
    half[active] = Z95 * np.sqrt(np.maximum(np.diag(noise.covariance(jacobian[:, active])), 0.0))
    return [
        Interval(float(v), float(v - h), float(v + h)) if h > 0.0 else Interval(float(v), float(v), float(v))
        for v, h in zip(theta, half, strict=True)
    ]


def _reversals(signal: Array, least: float) -> int:
    """Number of monotone ways at least that long."""
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
