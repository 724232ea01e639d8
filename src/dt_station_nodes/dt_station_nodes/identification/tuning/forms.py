"""Continuous and discrete forms of the controllers, as in the paper's Table 1.

The paper's discrete PI is MATLAB's `c2d` with its default, the zero-order hold: the integrator becomes the
forward rectangle Ki Ts/(z - 1), so that (Kr s + Ki)/s turns into (Kr z - (Kr - Ki Ts))/(z - 1). Tustin or a backward
rectangle would have changed the first coefficient, which Table 1 prints unchanged.
"""

import control
import numpy as np
from numpy.typing import NDArray

from ...core.control import FuzzyConfig, LoopConfig, PiConfig, PidConfig, surface
from ...core.samples import ControlMode
from .errors import TuningError


def printed(value: float) -> str:
    """A coefficient as the paper prints it: four significant digits, trailing zeros dropped."""
    return f"{value:.4g}"


def continuous_pi(config: PiConfig) -> tuple[float, float]:
    """Kr and Ki of (Kr s + Ki)/s."""
    return config.gain, config.gain / config.integral_time_s


def discrete_pi(config: PiConfig, sample_time_s: float) -> tuple[float, float]:
    """The a and b of (a z - b)/(z - 1), by python-control's zero-order hold of the continuous form."""
    sampled = control.c2d(control.tf(list(continuous_pi(config)), [1.0, 0.0]), sample_time_s, "zoh")
    numerator, denominator = sampled.num[0][0], sampled.den[0][0]
    a, minus_b = numerator / denominator[0]
    return float(a), float(-minus_b)


def texts(config: LoopConfig, sample_time_s: float) -> tuple[str, str]:
    """Continuous and discrete form of the loop's active controller, printed as in Table 1."""
    if config.mode is ControlMode.PI and config.pi is not None:
        kr, ki = continuous_pi(config.pi)
        a, b = discrete_pi(config.pi, sample_time_s)
        return f"({printed(kr)} s + {printed(ki)})/s", f"({printed(a)} z {_signed(-b)})/(z - 1)"
    if config.mode is ControlMode.PID and config.pid is not None:
        pid = config.pid
        lag = f"/({printed(pid.derivative_filter_s)} s + 1)" if pid.derivative_filter_s else ""
        continuous = f"{pid.p:.5g} {_signed(pid.i)}/s {_signed(pid.d)} s{lag}"
        numerator, denominator = _coefficients(_pid(pid, sample_time_s))
        return continuous, f"({_polynomial(numerator)})/({_polynomial(denominator)})"
    if config.mode is ControlMode.FUZZY and config.fuzzy is not None:
        low, high = fuzzy_slopes(config.fuzzy)
        text = f"surface, {printed(low)} to {printed(high)} V per {config.fuzzy.error.unit} at no error"
        return text, text
    raise TuningError(f"controller {config.name} is in manual mode: there is no form to print")


def fuzzy_slopes(config: FuzzyConfig) -> tuple[float, float]:
    """Least and greatest slope at no error over the loads of its range (V per unit of error), gains included."""
    slopes = _slopes(config)
    middle = int(np.argmin(np.abs(surface(config).error)))
    near = slopes[middle - 1 : middle + 1]
    return float(near.min()), float(near.max())


def fuzzy_steepest(config: FuzzyConfig) -> float:
    """Steepest slope anywhere on the surface over the loads of its range (V per unit of error), gains included."""
    return float(_slopes(config).max())


def _slopes(config: FuzzyConfig) -> NDArray[np.float64]:
    table = surface(config)
    place = np.clip(config.load_gain * table.load, *config.load.range)
    j = np.clip(np.searchsorted(table.load, place, side="right") - 1, 0, len(table.load) - 2)
    share = (place - table.load[j]) / (table.load[j + 1] - table.load[j])
    values = table.values[:, j] * (1.0 - share) + table.values[:, j + 1] * share
    return np.diff(values, axis=0) / np.diff(table.error)[:, None] * (config.error_gain * config.output_gain)


def linear(config: LoopConfig, sample_time_s: float, fuzzy_slope: float | None = None) -> control.TransferFunction:
    """The active controller as a discrete transfer function, error (in its unit) to V; limits left out.

    A fuzzy one is taken as its slope at no error, the greatest over all loads unless `fuzzy_slope` is given.
    """
    if config.mode is ControlMode.PI and config.pi is not None:
        a, b = config.pi.coefficients(sample_time_s)
        return control.tf([a, -b], [1.0, -1.0], sample_time_s)
    if config.mode is ControlMode.PID and config.pid is not None:
        return _pid(config.pid, sample_time_s)
    if config.mode is ControlMode.FUZZY and config.fuzzy is not None:
        fuzzy = config.fuzzy
        slope = fuzzy_slopes(fuzzy)[1] if fuzzy_slope is None else fuzzy_slope
        return _parallel(slope, fuzzy.integral_gain, slope * fuzzy.error_lead_s, 0.0, sample_time_s)
    raise TuningError(f"controller {config.name} is in manual mode: there is no loop to judge")


def error_scale(config: LoopConfig) -> float:
    """Error units per SI unit of the active controller."""
    section = {ControlMode.PI: config.pi, ControlMode.PID: config.pid, ControlMode.FUZZY: config.fuzzy}[config.mode]
    if section is None:
        raise TuningError(f"controller {config.name} has no settings for its mode")
    return section.error_scale


def _pid(config: PidConfig, sample_time_s: float) -> control.TransferFunction:
    return _parallel(config.p, config.i, config.d, config.derivative_filter_s, sample_time_s)


def _parallel(p: float, i: float, d: float, lag_s: float, sample_time_s: float) -> control.TransferFunction:
    """P + I Ts/(z-1) + D/(Tf + Ts) (z-1)/(z - Tf/(Tf + Ts)), on one denominator without needless poles."""
    decay = lag_s / (lag_s + sample_time_s)
    numerator, denominator = np.array([p]), np.array([1.0])
    if i != 0.0:
        numerator = np.polyadd(np.polymul(numerator, [1.0, -1.0]), [i * sample_time_s])
        denominator = np.array([1.0, -1.0])
    if d != 0.0:
        slope = np.polymul([d / (lag_s + sample_time_s)], np.polymul([1.0, -1.0], denominator))
        numerator = np.polyadd(np.polymul(numerator, [1.0, -decay]), slope)
        denominator = np.polymul(denominator, [1.0, -decay])
    return control.tf(numerator, denominator, sample_time_s)


def _coefficients(system: control.TransferFunction) -> tuple[list[float], list[float]]:
    return [float(v) for v in system.num[0][0]], [float(v) for v in system.den[0][0]]


def _signed(value: float) -> str:
    return f"{'-' if value < 0 else '+'} {printed(abs(value))}"


def _polynomial(coefficients: list[float]) -> str:
    order = len(coefficients) - 1
    parts: list[str] = []
    for k, value in enumerate(coefficients):
        if value == 0.0:
            continue
        power = order - k
        variable = "" if power == 0 else "z" if power == 1 else f"z^{power}"
        size = "" if abs(value) == 1.0 and variable else printed(abs(value))
        body = f"{size} {variable}".strip()
        sign = "-" if value < 0 else "+"
        parts.append(f"{sign} {body}" if parts else (f"-{body}" if value < 0 else body))
    return " ".join(parts) or "0"
