"""A mechanical axis with friction by inverse dynamics: force = M a + Fv v + Fc sign(v) + offset, linear least squares.

The position is filtered without phase shift before it is differentiated, and the regression is decimated, so that noise
neither biases nor pretends to be information: Gautier, Janot and Vandanjon, IEEE Trans. Control Syst. Technol. 21
(2013) 428.
"""

import math
from dataclasses import dataclass
from enum import Enum

import numpy as np
from scipy.signal import butter, filtfilt

from ..core.channels import Channel
from ..core.run import Array, Run
from .errors import IdentificationError
from .estimate import Interval
from .excitation import check_excitation, check_response, signal_of
from .noise import Z95, noise_colour

CUTOFF_SHARE = 0.14
DECIMATION = 10


class FrictionModel(str, Enum):
    """Which friction the axis is given."""

    LINEAR = "linear"
    COULOMB = "coulomb"
    ASYMMETRIC = "asymmetric"

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the parameters, in order."""
        return {
            FrictionModel.LINEAR: ("mass", "viscous"),
            FrictionModel.COULOMB: ("mass", "viscous", "coulomb", "offset"),
            FrictionModel.ASYMMETRIC: ("mass", "viscous_forward", "viscous_backward", "coulomb", "offset"),
        }[self]


@dataclass(frozen=True)
class AxisParameters:
    """Parameters of one friction model, SI (kg, N s/m, N), and the relative error of the force they leave."""

    friction: FrictionModel
    values: dict[str, Interval]
    force_error_percent: float
    samples: int


@dataclass(frozen=True)
class Regression:
    """Filtered and decimated acceleration, velocity (m/s^2, m/s) and force (N), arrays of shape (n,)."""

    acceleration: Array
    velocity: Array
    direction: Array
    force: Array

    def columns(self, friction: FrictionModel) -> Array:
        """Regressors of a friction model, shape (n, parameters)."""
        ones = np.ones_like(self.velocity)
        if friction is FrictionModel.LINEAR:
            return np.column_stack([self.acceleration, self.velocity])
        if friction is FrictionModel.COULOMB:
            return np.column_stack([self.acceleration, self.velocity, self.direction, ones])
        forward, backward = np.maximum(self.velocity, 0.0), np.minimum(self.velocity, 0.0)
        return np.column_stack([self.acceleration, forward, backward, self.direction, ones])


def regression(
    run: Run, force_per_volt: float = 1.0, cutoff_hz: float | None = None, decimation: int = DECIMATION
) -> Regression:
    """Regression data of the position axis driven by the servo voltage, force = force_per_volt * voltage.

    The usual cut-off is a seventh of half the sample rate. Raises IdentificationError for a run that does not
    move or is too short.
    """
    if not (math.isfinite(force_per_volt) and force_per_volt != 0.0):
        raise IdentificationError(f"The force per volt must be a number other than 0 N/V, got {force_per_volt:g}.")
    check_excitation(run, Channel.POSITION.voltage_signal)
    check_response(run, Channel.POSITION)
    position = signal_of(run, Channel.POSITION.signal)
    force = force_per_volt * signal_of(run, Channel.POSITION.voltage_signal)
    step = run.sample_time_s
    share = CUTOFF_SHARE if cutoff_hz is None else cutoff_hz * 2.0 * step
    if not 0.0 < share < 1.0:
        raise IdentificationError(f"The cut-off must lie between 0 and {0.5 / step:g} Hz, got {cutoff_hz:g} Hz.")
    edge = 50
    if len(run) < 2 * edge + 20 * decimation:
        raise IdentificationError(f"{run.source or 'The run'} has {len(run)} samples, too few for inverse dynamics.")
    numerator, denominator = butter(4, share)
    smooth = filtfilt(numerator, denominator, position)
    velocity = np.gradient(smooth, step)
    acceleration = np.gradient(velocity, step)

    def thinned(values: Array) -> Array:
        inner = values[edge:-edge]
        if decimation == 1:
            return inner
        return np.asarray(filtfilt(*butter(4, 0.8 / decimation), inner)[::decimation])

    return Regression(thinned(acceleration), thinned(velocity), thinned(np.sign(velocity)), thinned(force))


def fit_axis(data: Regression, friction: FrictionModel = FrictionModel.COULOMB) -> AxisParameters:
    """Least squares with intervals that take the residual's colour into account."""
    columns = data.columns(friction)
    scale = np.linalg.norm(columns, axis=0)
    if np.any(scale == 0.0) or np.linalg.matrix_rank(columns / scale, tol=1e-8) < columns.shape[1]:
        raise IdentificationError(
            f"The motion does not tell {', '.join(friction.parameters)} apart; move both ways and at several speeds."
        )
    solution = np.linalg.lstsq(columns / scale, data.force, rcond=None)[0] / scale
    residual = data.force - columns @ solution
    half = Z95 * np.sqrt(np.diag(noise_colour(residual, solution.size).covariance(columns)))
    values = {
        name: Interval(float(v), float(v - h), float(v + h))
        for name, v, h in zip(friction.parameters, solution, half, strict=True)
    }
    return AxisParameters(friction, values, force_error_percent(data, friction, values), data.force.size)


def force_error_percent(data: Regression, friction: FrictionModel, values: dict[str, Interval]) -> float:
    """100 |force - model| / |force| of given parameters, on this or another run's regression."""
    modelled = data.columns(friction) @ np.array([values[name].value for name in friction.parameters])
    return float(100.0 * np.linalg.norm(data.force - modelled) / np.linalg.norm(data.force))
