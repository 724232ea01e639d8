"""What was identified, as plain values for JSON, tables and comments."""

from typing import Any

from .estimate import Estimate, Interval
from .inverse_dynamics import AxisParameters
from .noise import CheckResult
from .selection import Candidate
from .static_characteristic import StaticCharacteristic
from .station import IdentifiedPath, Method
from .structure import PathStructure
from .transfer import TransferFunction


def plain(interval: Interval | None, unit: str = "") -> dict[str, Any] | None:
    """A value with its interval."""
    if interval is None:
        return None
    return {"value": interval.value, "ci95": [interval.low, interval.high], "unit": unit}


def named_intervals(path: IdentifiedPath) -> dict[str, Interval]:
    """Every parameter of a path by a readable name: gains, poles, coefficients, delay, bias."""
    fitted = path.estimate
    prefix = path.channel.value
    if path.method is Method.CLOSED_LOOP:
        return {f"{prefix} integrator gain": path.gain}
    named: dict[str, Interval] = {}
    for index, structure in enumerate(fitted.structure.paths):
        label = prefix if index == 0 and path.method is Method.DIRECT else "disturbance"
        named.update(_of_path(fitted, index, structure, label))
    if path.estimate.structure.paths[0].integrators == 0:
        named[f"{prefix} rest (path units)"] = fitted.offset
    if path.bias_v is not None:
        named[f"{prefix} bias V"] = path.bias_v
    return named


def _of_path(fitted: Estimate, index: int, structure: PathStructure, label: str) -> dict[str, Interval]:
    named = {f"{label} {'integrator' if structure.integrators else 'DC'} gain": fitted.gain(index)}
    for i, size in enumerate(fitted.pole_sizes(index)):
        named[f"{label} |pole {i + 1}| rad/s"] = size
    numerator, denominator = fitted.coefficients(index)
    for i, coefficient in enumerate(numerator):
        named[f"{label} numerator s^{len(numerator) - 1 - i}"] = coefficient
    for i, coefficient in enumerate(denominator):
        named[f"{label} denominator s^{structure.poles - 1 - i}"] = coefficient
    if structure.estimate_delay:
        named[f"{label} delay s"] = fitted.delay(index)
    return named


def path_summary(path: IdentifiedPath) -> dict[str, Any]:
    """All there is to say about an identified path."""
    return {
        "channel": path.channel.value,
        "method": path.method.value,
        "candidates": [candidate_summary(c, c is path.selection.chosen) for c in path.selection.candidates],
        "chosen": {
            "transfer": transfer_summary(path.transfer),
            "disturbance": None if path.disturbance is None else transfer_summary(path.disturbance),
            "scale": path.scale,
            "rest": path.rest,
            "fit_percent": path.estimate.fit_percent,
            "held_out_fit_percent": path.selection.chosen.validation_fit_percent,
            "why": path.selection.why,
        },
        "parameters": {name: plain(value) for name, value in named_intervals(path).items()},
        "noise": {
            "std": path.estimate.noise.innovation_std * path.scale,
            "autoregressive_order": path.estimate.noise.order,
            "effective_samples": path.estimate.noise.effective_samples,
        },
        "checks": [check_summary(check) for check in path.estimate.checks],
        "notes": list(path.notes),
    }


def candidate_summary(candidate: Candidate, chosen: bool) -> dict[str, Any]:
    """One row of the table of candidates."""
    fitted = candidate.estimate
    structure = fitted.structure.paths[candidate.path]
    return {
        "poles": structure.poles,
        "zeros": structure.zeros,
        "delay_s": fitted.delay(candidate.path).value,
        "fit_percent": fitted.fit_percent,
        "held_out_fit_percent": candidate.validation_fit_percent,
        "aic": fitted.aic,
        "bic": fitted.bic,
        "chosen": chosen,
        "doubt": candidate.doubt,
    }


def transfer_summary(transfer: TransferFunction) -> dict[str, Any]:
    """Coefficients, poles, zeros and gain of a transfer function."""
    return {
        "numerator": list(transfer.numerator),
        "denominator": list(transfer.denominator),
        "delay_s": transfer.delay_s,
        "gain": transfer.gain(),
        "poles": [[root.real, root.imag] for root in transfer.poles().tolist()],
        "zeros": [[root.real, root.imag] for root in transfer.zeros().tolist()],
    }


def check_summary(check: CheckResult) -> dict[str, Any]:
    """One residual test."""
    return {"name": check.name, "statistic": check.statistic, "limit": check.limit, "passed": check.passed}


def characteristic_summary(shape: StaticCharacteristic) -> dict[str, Any]:
    """A static characteristic."""
    return {
        "channel": shape.channel.value,
        "output": "rate" if shape.integrating else "value",
        "scale": shape.scale,
        "rest": plain(shape.rest),
        "gain": plain(shape.gain, "per V"),
        "hysteresis_half_width": plain(shape.hysteresis_half_width_v, "V"),
        "hysteresis_spread": plain(shape.hysteresis_spread),
        "dead_zone_half_width": plain(shape.dead_zone_half_width_v, "V"),
        "null": plain(shape.null_v, "V"),
        "saturation_upper": plain(shape.saturation_upper_v, "V"),
        "saturation_lower": plain(shape.saturation_lower_v, "V"),
        "fit_percent": shape.fit_percent,
        "branches": {
            name: {"voltage_v": branch.voltage_v.tolist(), "output": branch.output.tolist()}
            for name, branch in (("rising", shape.rising), ("falling", shape.falling))
        },
    }


def axis_summary(axis: AxisParameters, validation_percent: float | None) -> dict[str, Any]:
    """One friction model of a mechanical axis."""
    units = {"mass": "kg", "coulomb": "N", "offset": "N"}
    return {
        "friction": axis.friction.value,
        "parameters": {name: plain(value, units.get(name, "N s/m")) for name, value in axis.values.items()},
        "force_error_percent": axis.force_error_percent,
        "validation_force_error_percent": validation_percent,
        "samples": axis.samples,
    }
