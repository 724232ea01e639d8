"""Ziegler-Nichols settings from the ultimate gain, and the ultimate gain from a model.

Rules: J. G. Ziegler and N. B. Nichols, Optimum settings for automatic controllers, Trans. ASME 64 (1942) 759-768.
"""

import math
import warnings
from dataclasses import dataclass

import control
import numpy as np

from ...core.channels import Channel
from ...core.control import LoopConfig, PiConfig, PidConfig
from ...core.models import ModelSpec
from ...core.samples import ControlMode
from .errors import TuningError
from .stability import continuous_path, sampled_path


@dataclass(frozen=True, slots=True)
class UltimatePoint:
    """Gain of a pure proportional loop on the verge of oscillation (V per error unit) and the period (s)."""

    gain: float
    period_s: float


def ultimate_point(
    model: ModelSpec, channel: Channel, sample_time_s: float | None, error_scale: float
) -> UltimatePoint:
    """From the model's linear path, sampled with zero-order hold, or continuous where no sample time is given."""
    if sample_time_s is None:
        path = continuous_path(model, channel)
    else:
        path = sampled_path(model, channel, sample_time_s)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        gain, _, omega, _ = control.margin(path * (model.paths[channel].scale * error_scale))
    if not (math.isfinite(gain) and np.isfinite(omega) and omega > 0.0 and gain > 0.0):
        way = "give a sample time" if sample_time_s is None else "use the relay or the optimiser"
        raise TuningError(f"the {channel.value} path of model {model.name} never oscillates under gain alone; {way}")
    return UltimatePoint(float(gain), float(2.0 * math.pi / omega))


def settings(point: UltimatePoint, mode: ControlMode, error_scale: float) -> PiConfig | PidConfig:
    """PI: 0.45 Ku, Tu/1.2. PID: 0.6 Ku, integral Tu/2, derivative Tu/8."""
    if mode is ControlMode.PI:
        return PiConfig(gain=0.45 * point.gain, integral_time_s=point.period_s / 1.2, error_scale=error_scale)
    if mode is ControlMode.PID:
        p = 0.6 * point.gain
        return PidConfig(p=p, i=2.0 * p / point.period_s, d=p * point.period_s / 8.0, error_scale=error_scale)
    raise TuningError("Ziegler and Nichols have rules for pi and pid; use the optimiser for anything else")


def tuned(base: LoopConfig, point: UltimatePoint, mode: ControlMode, error_scale: float) -> LoopConfig:
    """A loop with the Ziegler-Nichols settings, its limits and anti-windup as in `base`."""
    name = mode.name.lower()
    new = settings(point, mode, error_scale)
    old = getattr(base, name)
    if old is not None:
        new = new.model_copy(update={"anti_windup": old.anti_windup})
    rounded = {
        k: float(f"{v:.5g}") for k, v in new.model_dump().items() if k in {"gain", "integral_time_s", "p", "i", "d"}
    }
    return base.changed(mode=mode, **{name: new.model_copy(update=rounded)})
