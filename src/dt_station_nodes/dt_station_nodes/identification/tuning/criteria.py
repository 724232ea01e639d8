"""How good a closed-loop response is: one number a criterion, all in the units of the paper's figures."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class StepFigures:
    """A step from one constant set-point to another.

    `settling_s`: time after which the response stays within the band (None: never within the record);
    `overshoot_percent` of the step, at least 0; `static_error` (unit of the response) over the last tenth;
    `ise` (unit^2 s) and `itae` (unit s^2) of the error; `peak_v` and `travel_v` (sum of |du|) of the voltage.
    """

    settling_s: float | None
    overshoot_percent: float
    static_error: float
    ise: float
    itae: float
    peak_v: float
    travel_v: float


def step_figures(
    start: float, target: float, response: Array, voltage: Array, sample_time_s: float, band: float = 0.02
) -> StepFigures:
    """Figures of a response (n,) to a step at its sample 0; the band is a share of the step."""
    size = target - start
    error = target - response
    outside = np.flatnonzero(np.abs(error) > band * abs(size))
    last = outside[-1] + 1 if outside.size else 0
    time_s = sample_time_s * np.arange(len(response))
    beyond = float(np.max(-error * np.sign(size))) / abs(size)
    return StepFigures(
        settling_s=None if last >= len(response) else float(last * sample_time_s),
        # Below a millionth of the step it is rounding, not overshoot.
        overshoot_percent=100.0 * beyond if beyond > 1e-6 else 0.0,
        static_error=float(np.mean(error[-max(1, len(error) // 10) :])),
        ise=float(np.sum(error**2) * sample_time_s),
        itae=float(np.sum(np.abs(error) * time_s) * sample_time_s),
        peak_v=float(np.max(np.abs(voltage))),
        travel_v=float(np.sum(np.abs(np.diff(voltage)))),
    )


def error_index(setpoint: Array, response: Array) -> float:
    """The paper's index (8): the sum of squared errors over the samples given (unit^2)."""
    return float(np.sum((setpoint - response) ** 2))
