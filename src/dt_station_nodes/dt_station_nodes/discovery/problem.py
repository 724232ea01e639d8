"""One channel of one run as a fitting problem: which parameters, which residual."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..core.channels import Channel
from ..core.models import EffectSpec, ModelSpec, PathSimulator, PathSpec
from ..core.models.effects import Attachment, Parameter, Quantity
from ..core.run import Run
from .noise import difference_noise
from .settings import DiscoverySettings
from .windows import Windows, make_windows

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Term:
    """One free number: of an effect (effect index and parameter name), or nominal (index -1).

    It is searched as `start + unit_step * x` or, if `logarithmic`, as exp(x).
    """

    effect: int
    name: str
    lower: float
    upper: float
    scale: float
    logarithmic: bool = False
    prior: float = 0.0  # half-width of the nominal parameter's prior in x, 0 for none
    centre: float = 0.0  # where that prior sits, in x

    def to_x(self, value: float) -> float:
        """Searched variable of a value."""
        return float(np.log(max(value, 1e-300))) if self.logarithmic else value / self.scale

    def to_value(self, x: float) -> float:
        """Value of the searched variable."""
        return float(np.exp(x)) if self.logarithmic else x * self.scale

    @property
    def bounds(self) -> tuple[float, float]:
        """Bounds of the searched variable."""
        low, high = self.to_x(self.lower), self.to_x(self.upper)
        return (low, high) if low <= high else (high, low)


@dataclass(frozen=True, slots=True)
class Problem:
    """Everything fixed about fitting one channel of one run.

    `weights` (n,) are 0 where a sample says nothing (start-up, frozen sensor), else 1; `signal` is the
    standard deviation of the compared part of the measured signal; `scales` the run's range of each quantity.
    """

    channel: Channel
    simulator: PathSimulator
    measured: Array
    windows: Windows
    weights: Array
    noise: float
    signal: float
    scales: Mapping[Quantity, float]

    @property
    def sigma(self) -> float:
        """Size of a residual that counts as nothing: noise and a trace of form error."""
        return float(np.hypot(self.noise, 0.002 * self.signal))

    def residual(self, path: PathSpec) -> Array:
        """Measured minus simulated, offsets of anchored windows taken out, shape (n,)."""
        return self.compare(self.simulator.simulate(path))

    def compare(self, simulated: Array) -> Array:
        """The residual of a simulated output (n,)."""
        limit = 1e3 * (float(np.abs(self.measured).max()) + self.signal)
        gap = np.clip(np.nan_to_num(self.measured - simulated, nan=limit), -limit, limit)
        return self.windows.project(gap) * self.weights


def integrates(path: PathSpec) -> bool:
    """Whether the path has a pole at zero."""
    return path.denominator[-1] == 0.0


def _scales(run: Run, channel: Channel, path: PathSpec, load: Array) -> dict[Quantity, float]:
    voltage = run.signals[channel.voltage_signal]
    above = run.signals[channel.signal] - path.rest
    high = max(float(np.quantile(np.abs(voltage), 0.98)), 1e-9)
    changes = np.abs(np.diff(voltage))
    output = max(float(np.abs(above).max()), 1e-12)
    velocity = np.abs(np.diff(above)) / run.sample_time_s
    speed = max(float(np.quantile(velocity, 0.9)), 1e-12)
    loading = load if len(load) else above
    load_swing = max(float(np.quantile(np.abs(loading - loading.mean()), 0.9)), 1e-12)
    return {
        Quantity.RATIO: 1.0,
        Quantity.INPUT: high,
        Quantity.INPUT_RATE: max(float(np.quantile(changes, 0.98)), 1e-3 * high) / run.sample_time_s,
        Quantity.OUTPUT: output,
        Quantity.SIGNAL: output,
        Quantity.PER_OUTPUT: 1.0 / output,
        Quantity.PER_OUTPUT_SQUARED: 1.0 / output**2,
        Quantity.PER_OUTPUT_CUBED: 1.0 / output**3,
        Quantity.VELOCITY: speed,
        Quantity.TIME: 1.0,
        Quantity.RATE: 1.0,
        Quantity.FREQUENCY: 1.0,
        Quantity.ANGLE: 1.0,
        Quantity.PER_LOAD: 1.0 / load_swing,
        Quantity.VELOCITY_PER_LOAD: speed / load_swing,
        Quantity.INPUT_PER_OUTPUT_CUBED: high / output**3,
    }


def _first_velocity(measured: Array, sample_time_s: float, path: PathSpec, samples: int = 12) -> float | None:
    """How fast the output moves at the start, where the path is slow enough to tell and it clearly moves."""
    poles = np.roots(path.denominator)
    fastest = float(np.abs(poles).max()) / path.time_scale
    if samples * sample_time_s * fastest > 1.1:
        return None
    time = np.arange(samples) * sample_time_s
    coefficients, covariance = np.polyfit(time, measured[:samples], 2, cov=True)
    slope = float(coefficients[1])
    return slope if abs(slope) > 4.0 * float(covariance[1, 1]) ** 0.5 else None


def make_problem(
    run: Run, spec: ModelSpec, channel: Channel, settings: DiscoverySettings, frozen: NDArray[np.bool_] | None = None
) -> Problem:
    """The fitting problem of a channel of a run."""
    path = spec.paths[channel]
    measured = np.ascontiguousarray(run.signals[channel.signal], dtype=np.float64)
    voltage = np.ascontiguousarray(run.signals[channel.voltage_signal], dtype=np.float64)
    pressure_path = spec.paths.get(Channel.PRESSURE)
    rest = 0.0 if pressure_path is None else pressure_path.rest
    pressure = run.get(Channel.PRESSURE.signal)
    load = np.zeros(0) if channel is Channel.PRESSURE or pressure is None else np.ascontiguousarray(pressure)
    windows = make_windows(len(run), run.sample_time_s, settings.window_s, integrates(path))
    weights = np.ones(len(run))
    noise = difference_noise(measured)
    anchored = integrates(path)
    standing = path.rest + 0.0
    first = float(measured[0])
    if not anchored and abs(first - standing) <= 5.0 * noise + 1e-3 * float(np.ptp(measured)):
        first = standing
    elif not anchored:
        weights[: max(1, round(0.4 / run.sample_time_s))] = 0.0
    if frozen is not None:
        weights[frozen] = 0.0
    compared = windows.project(measured) if anchored else measured - measured.mean()
    velocity = _first_velocity(measured, run.sample_time_s, path)
    simulator = PathSimulator(channel, run.sample_time_s, voltage, load, rest, first, velocity)
    return Problem(
        channel,
        simulator,
        measured,
        windows,
        weights,
        noise,
        float(np.std(compared)),
        _scales(run, channel, path, load),
    )


@dataclass(frozen=True, slots=True)
class Hypothesis:
    """A path with effects and the terms of it that are free."""

    path: PathSpec
    terms: tuple[Term, ...]

    def path_at(self, x: Array) -> PathSpec:
        """The path with the free numbers set from the searched variables (p,)."""
        nominal: dict[str, float] = {}
        away: dict[str, float] = {}
        coefficients: dict[str, list[float]] = {}
        effects = [dict(effect.parameters) for effect in self.path.effects]
        for term, value in zip(self.terms, x, strict=True):
            number = term.to_value(float(value))
            if term.effect >= 0:
                effects[term.effect][term.name] = number
            elif term.name == "disturbance_gain":
                away["gain"] = number
            elif term.name.startswith(("numerator_", "denominator_")):
                side, place = term.name.split("_")
                coefficients.setdefault(side, list(getattr(self.path, side)))[int(place)] = number
            else:
                nominal[term.name] = number
        changes: dict[str, object] = {**nominal, **{side: tuple(values) for side, values in coefficients.items()}}
        changes["effects"] = tuple(
            EffectSpec.model_construct(name=old.name, at=old.at, parameters=new)
            for old, new in zip(self.path.effects, effects, strict=True)
        )
        if away and self.path.disturbance is not None:
            changes["disturbance"] = self.path.disturbance.model_copy(update=away)
        return self.path.model_copy(update=changes)

    def start(self) -> Array:
        """Searched variables (p,) of the path as it stands."""
        values = []
        for term in self.terms:
            if term.effect >= 0:
                value = self.path.effects[term.effect].parameters[term.name]
            elif term.name.startswith(("numerator_", "denominator_")):
                side, place = term.name.split("_")
                value = getattr(self.path, side)[int(place)]
            elif term.name == "disturbance_gain":
                value = self.path.disturbance.gain if self.path.disturbance else 1.0
            else:
                value = getattr(self.path, term.name)
            values.append(term.to_x(value))
        return np.array(values)


FEW_POLES = 3


def refits_all(path: PathSpec) -> bool:
    """Whether all coefficients of a path are refitted: few, static in the end, so that nothing else can hide in them.

    A linear model of nonlinear data is off in all of them; gain and time scale alone would not undo that.
    """
    return path.denominator[-1] != 0.0 and 2 <= len(path.denominator) - 1 <= FEW_POLES


def _coefficient_terms(path: PathSpec, swing: float) -> tuple[Term, ...]:
    """Every coefficient but the denominator's first, and the rest value."""
    terms = []
    for side in ("numerator", "denominator"):
        values = getattr(path, side)
        for place in range(1 if side == "denominator" else 0, len(values)):
            size = abs(values[place]) or 1e-3 * max(abs(v) for v in values)
            reach = 20.0 * size
            low = 0.02 * values[place] if side == "denominator" and values[place] > 0.0 else values[place] - reach
            terms.append(
                Term(-1, f"{side}_{place}", low, values[place] + reach, size, False, 2.0, values[place] / size)
            )
    rest = Term(-1, "rest", path.rest - 5.0 * swing, path.rest + 5.0 * swing, swing, False, 1.0, path.rest / swing)
    return (*terms, rest)


def nominal_terms(path: PathSpec, swing: float = 1.0) -> tuple[Term, ...]:
    """Gain and time scale, and the disturbance path's gain where there is one; priors say how far off they tend to be.

    Small paths of foreign data: all coefficients and the rest value (`swing`: the output's standard deviation).
    """
    if refits_all(path):
        return _coefficient_terms(path, swing)
    terms = [
        Term(-1, "gain", path.gain * 0.05, path.gain * 20.0, 1.0, True, 0.025),
        Term(-1, "time_scale", path.time_scale * 0.05, path.time_scale * 20.0, 1.0, True, 0.045),
    ]
    if path.gain <= 0.0:
        terms[0] = Term(-1, "gain", path.gain * 20.0, path.gain * 0.05, abs(path.gain) or 1.0, False, 0.025)
    if path.disturbance is not None:
        gain = path.disturbance.gain
        size = abs(gain) or 1.0
        terms.append(Term(-1, "disturbance_gain", gain - 5.0 * size, gain + 5.0 * size, size, False, 0.1))
    values = [path.gain, path.time_scale, path.disturbance.gain if path.disturbance else 1.0]
    return tuple(replace(term, centre=term.to_x(value)) for term, value in zip(terms, values, strict=False))


def unit_of(problem: Problem, parameter: Parameter, at: Attachment | None) -> float:
    """The run's range of what a parameter measures, for an effect at a place."""
    if parameter.quantity is Quantity.SIGNAL and at is Attachment.INPUT:
        return problem.scales[Quantity.INPUT]
    return problem.scales[parameter.quantity]


def effect_term(problem: Problem, index: int, parameter: Parameter, at: Attachment | None) -> Term:
    """The term of one effect parameter, bounds scaled by the run."""
    unit = unit_of(problem, parameter, at)
    logarithmic = parameter.quantity in (Quantity.INPUT_RATE, Quantity.FREQUENCY)
    lower = parameter.lower * unit
    if logarithmic:
        lower = max(lower, 1e-3 * parameter.upper * unit)
    return Term(index, parameter.name, lower, parameter.upper * unit, unit, logarithmic)
