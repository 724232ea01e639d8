"""The free numbers of a fit: effects' parameters and nominal ones, their bounds, scales and priors."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..core.models import EffectSpec, PathSpec

Array = NDArray[np.float64]

FEW_POLES = 3
AWAY = "disturbance_"  # begins the names of the disturbance path's numbers
_STEP = 1e-4  # of the finite differences, in searched variables


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
    grain: float = 0.0  # least change in x that shows; 0: any does

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
class Hypothesis:
    """A path with effects and the terms of it that are free."""

    path: PathSpec
    terms: tuple[Term, ...]

    @property
    def bounds(self) -> Array:
        """Lower and upper bounds of the searched variables, shape (p, 2)."""
        return np.array([term.bounds for term in self.terms]).reshape(-1, 2)

    @property
    def steps(self) -> Array:
        """Lengths (p,) of the finite differences in the searched variables."""
        least = (_STEP if term.logarithmic or term.prior else 10.0 * _STEP for term in self.terms)
        return np.array([max(step, term.grain) for step, term in zip(least, self.terms, strict=True)])

    def path_at(self, x: Array) -> PathSpec:
        """The path with the free numbers set from the searched variables (p,)."""
        nominal: dict[str, float] = {}
        away: dict[str, float] = {}
        coefficients: dict[str, list[float]] = {}
        moved: dict[int, dict[str, float]] = {}
        for term, value in zip(self.terms, x, strict=True):
            number = term.to_value(float(value))
            if term.effect >= 0:
                if term.effect not in moved:
                    moved[term.effect] = dict(self.path.effects[term.effect].parameters)
                moved[term.effect][term.name] = number
            elif term.name.startswith(AWAY):
                away[term.name.removeprefix(AWAY)] = number
            elif term.name.startswith(("numerator_", "denominator_")):
                side, place = term.name.split("_")
                coefficients.setdefault(side, list(getattr(self.path, side)))[int(place)] = number
            else:
                nominal[term.name] = number
        changes: dict[str, object] = {**nominal, **{side: tuple(values) for side, values in coefficients.items()}}
        changes["effects"] = tuple(
            EffectSpec.model_construct(name=old.name, at=old.at, parameters=moved[index]) if index in moved else old
            for index, old in enumerate(self.path.effects)
        )
        if away and self.path.disturbance is not None:
            changes["disturbance"] = self.path.disturbance.model_copy(update=away)
        return self.path.model_copy(update=changes)

    def scaled(self, x: Array, factor: float) -> Array:
        """Searched variables (p,) with the effects' numbers, times apart, `factor` times as large."""
        acts = np.array([term.effect >= 0 and not term.logarithmic for term in self.terms])
        return np.where(acts, factor * x, x)

    def start(self) -> Array:
        """Searched variables (p,) of the path as it stands."""
        values = []
        for term in self.terms:
            if term.effect >= 0:
                value = self.path.effects[term.effect].parameters[term.name]
            elif term.name.startswith(("numerator_", "denominator_")):
                side, place = term.name.split("_")
                value = getattr(self.path, side)[int(place)]
            elif term.name.startswith(AWAY):
                value = getattr(self.path.disturbance, term.name.removeprefix(AWAY))
            else:
                value = getattr(self.path, term.name)
            values.append(term.to_x(value))
        return np.array(values)


def refits_all(path: PathSpec) -> bool:
    """Whether all coefficients of a path may be refitted: few, static, so that nothing else can hide in them.

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


def _shape_terms(path: PathSpec) -> list[Term]:
    """The denominator's coefficients between its ends, where these are few: the damping that no time scale mends."""
    poles = np.trim_zeros(path.denominator, "b")
    if len(poles) - 1 > FEW_POLES:
        return []
    inner = [(place, poles[place]) for place in range(1, len(poles) - 1) if poles[place] > 0.0]
    return [Term(-1, f"denominator_{place}", 0.05 * v, 20.0 * v, 1.0, True, 0.1) for place, v in inner]


def nominal_terms(path: PathSpec, swing: float = 1.0, whole: bool = False) -> tuple[Term, ...]:
    """Gain, time scale, damping and the disturbance path's gain and time; priors say how far off they tend to be.

    `whole`: all coefficients and the rest value (`swing`: the output's standard deviation).
    """
    if whole:
        return _coefficient_terms(path, swing)
    terms = [
        Term(-1, "gain", path.gain * 0.05, path.gain * 20.0, 1.0, True, 0.025),
        Term(-1, "time_scale", path.time_scale * 0.05, path.time_scale * 20.0, 1.0, True, 0.045),
    ]
    terms += _shape_terms(path)
    if path.gain <= 0.0:
        terms[0] = Term(-1, "gain", path.gain * 20.0, path.gain * 0.05, abs(path.gain) or 1.0, False, 0.025)
    if path.disturbance is not None:
        gain = path.disturbance.gain
        size = abs(gain) or 1.0
        terms.append(Term(-1, f"{AWAY}gain", gain - 5.0 * size, gain + 5.0 * size, size, False, 0.1))
        time = path.disturbance.time_scale
        terms.append(Term(-1, f"{AWAY}time_scale", time * 0.05, time * 20.0, 1.0, True, 0.045))
    return tuple(replace(t, centre=x) for t, x in zip(terms, Hypothesis(path, tuple(terms)).start(), strict=True))
