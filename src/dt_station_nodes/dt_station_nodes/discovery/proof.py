"""Stage 7: the gap before and after, on the run and on another, beside the noise floor."""

import re

import numpy as np
from numpy.typing import NDArray

from ..core.channels import Channel
from ..core.models import ModelSpec, PathSpec
from ..core.models.effects import registry
from .channel import Finding
from .problem import Problem
from .result import Estimate, GapFigures, Trace

Array = NDArray[np.float64]


def gap_figures(problem: Problem, residual: Array) -> GapFigures:
    """ISE (unit^2 s), RMS and fit of a residual (n,) as compared: re-anchored where the path integrates."""
    power = float(residual @ residual)
    freedom = max(float(problem.weights.sum()) - problem.windows.freedoms, 1.0)
    compared = problem.windows.project(problem.measured) if problem.windows.anchored else problem.measured
    swing = float(np.linalg.norm((compared - compared.mean()) * problem.weights))
    fit = 100.0 * (1.0 - power**0.5 / swing) if swing > 0.0 else 0.0
    return GapFigures(power * problem.simulator.sample_time_s, (power / freedom) ** 0.5, fit)


def floor_figures(problem: Problem, sigma: float) -> GapFigures:
    """The same of white noise of standard deviation sigma."""
    freedom = float(problem.weights.sum()) - problem.windows.freedoms
    return GapFigures(sigma**2 * freedom * problem.simulator.sample_time_s, sigma, 100.0)


def trace(problem: Problem, before: PathSpec, after: PathSpec, unit: str) -> Trace:
    """Measured and simulated by both paths, in `unit`; simulated curves are lifted by their windows' offsets."""
    curves = []
    for path in (before, after):
        simulated = problem.simulate(path)
        gap = np.nan_to_num(problem.measured - simulated)
        curves.append(np.asarray(simulated + gap - problem.windows.project(gap), dtype=np.float64))
    n = len(problem.measured)
    return Trace(
        problem.channel,
        unit,
        np.arange(n, dtype=np.float64) * problem.simulator.sample_time_s,
        problem.simulator.voltage_v,
        problem.measured,
        curves[0],
        curves[1],
    )


def _plain(value: float) -> float:
    """Seven significant digits: enough for the twin, short enough to read."""
    return float(f"{value:.7g}")


def patched(spec: ModelSpec, channel: Channel, path: PathSpec) -> ModelSpec:
    """The model with one path replaced, validated, numbers shortened."""
    effects = [
        {"name": e.name, "at": e.at, "parameters": {k: _plain(v) for k, v in e.parameters.items()}}
        for e in path.effects
    ]
    changes = {"gain": _plain(path.gain), "time_scale": _plain(path.time_scale), "effects": effects}
    if path.numerator != spec.paths[channel].numerator or path.denominator != spec.paths[channel].denominator:
        changes["numerator"] = tuple(_plain(v) for v in path.numerator)
        changes["denominator"] = tuple(_plain(v) for v in path.denominator)
    if path.rest != spec.paths[channel].rest:
        changes["rest"] = _plain(path.rest)
    if path.disturbance is not None:
        changes["disturbance"] = path.disturbance.model_copy(
            update={name: _plain(getattr(path.disturbance, name)) for name in ("gain", "time_scale")}
        ).model_dump()
    return spec.with_path(channel, **changes)


def estimates(
    finding: Finding, samples: float, unit: str
) -> tuple[dict[str, Estimate], dict[str, dict[str, Estimate]]]:
    """Nominal parameters and each effect's, with 95 % intervals from the fit's curvature.

    `unit`: the measured signal's own; foreign data may have another than the channel's.
    """
    explanation = finding.best
    fit = explanation.fit
    covariance = fit.fitted.covariance(samples, len(finding.problem.measured))
    nominal: dict[str, Estimate] = {}
    effects: dict[str, dict[str, Estimate]] = {name: {} for name in explanation.added}
    for index, term in enumerate(fit.hypothesis.terms):
        x = float(fit.fitted.x[index])
        reach = min(1.96 * float(covariance[index, index]) ** 0.5, abs(term.bounds[1] - term.bounds[0]))
        low, high = max(x - reach, term.bounds[0]), min(x + reach, term.bounds[1])
        ends = sorted((term.to_value(low), term.to_value(high)))
        if term.effect < 0:
            nominal[term.name] = Estimate(term.to_value(x), ends[0], ends[1], "1")
            continue
        spec = fit.path.effects[term.effect]
        if spec.name in effects:
            entry = registry()[spec.name]
            usual = entry.parameter(term.name).unit(finding.problem.channel, spec.place)
            own = re.sub(rf"\b{finding.problem.channel.unit}\b", unit, usual)
            effects[spec.name][term.name] = Estimate(term.to_value(x), ends[0], ends[1], own)
    return nominal, effects
