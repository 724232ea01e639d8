"""The hypotheses: each effect of the library at each of its places, with the starts its fit begins from."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from ..core.channels import Channel
from ..core.models import EffectSpec, PathSpec
from ..core.models.effects import Attachment, Effect, Parameter, Quantity, registry
from .effect_terms import effect_term, unit_of
from .further_forms import BY_LOAD, FURTHER, PLACES, further_starts
from .place_starts import lags_s, limit_starts, spring_starts, stop_starts, store_starts, wear_starts
from .problem import Problem
from .spectrum import spectral_peaks
from .start_groups import drawn
from .stick_slip import breakaways_v
from .terms import Hypothesis, Term
from .valve_curve import flattest_v, kinks_v

Array = NDArray[np.float64]
Freed = Mapping[str, tuple[str, ...]]

# A cylinder stands still at 0 V: its valve works about no other voltage; no slow store feeds what leaks past its
# piston. A pressure has no two ends.
_ONE_FORM = (
    *((name, Channel.POSITION) for name in ("dead_zone", "friction", "leakage")),
    ("overflow", Channel.PRESSURE),
)
# Places of effects where a form of its own begins instead. A spool that slips no further than where it slides is a play
# operator: only its form apart is friction. Begun as an orifice behind the path, a leak through a gap ends astray.
_NOT_PLAIN = {("friction", Channel.PRESSURE): (None,), ("leakage", Channel.PRESSURE): (Attachment.OUTPUT,)}
# What limits a pressure from behind and gives a little is a relief valve.
_NOT_BEHIND = (("saturation", "rounding_v"), ("saturation", "passing"))
# Where the load stands, what it makes of a motion either way is friction.
_BY_LOAD = ("leakage", "against")
# Beside softer contacts and more joints a linkage that gives could be any loop.
BY_ITSELF = ("backlash", "give")
_MOST_PAIRS = 150
_STOPS = ("limit", "lower_limit", "standing")
_WORN = ("worn_at", "worn_bend")
_STORES = ("curvature", "reference", "inlet_curvature")
_FINE_STARTS = 16
_SLIPS = (0.12, 0.15, 0.18, 0.22, 0.26, *(0.3 + 0.035 * k for k in range(20)))
_JUMPS = 0.1  # of the voltage's highest, its median, where it jumps
_ONE_LINE = 1.5  # turns in a run, by which two peaks of a spectrum are one


@dataclass(frozen=True, slots=True)
class Candidate:
    """An effect at a place (None: its usual one), in its plain form or in one `apart` from it.

    `first`: before the effects that a path has already, not behind them; `also`: optional parameters that its plain
    form has too.
    """

    name: str
    at: Attachment | None = None
    apart: bool = False
    first: bool = False
    also: tuple[str, ...] = ()

    @property
    def effect(self) -> Effect:
        """Library entry."""
        return registry()[self.name]

    @property
    def place(self) -> Attachment:
        """Where it is tried: `at`, or the effect's usual place."""
        return self.at or self.effect.attachment

    @property
    def plain(self) -> bool:
        """Whether it is neither a form apart nor a further one, which stand beside it."""
        return not (self.apart or any((self.name, self.also) == (name, form) for name, _, form in FURTHER))

    @property
    def required(self) -> tuple[str, ...]:
        """Parameters of the form."""
        return tuple(p.name for p in self._here if self._needs(p))

    @property
    def optional(self) -> tuple[str, ...]:
        """Parameters that refine it."""
        elsewhere = self.effect.apart_at not in (None, self.at)
        return tuple(p.name for p in self._here if not self._needs(p) and not (p.apart and elsewhere))

    @property
    def _here(self) -> tuple[Parameter, ...]:
        """Parameters that mean something at its place."""
        return tuple(p for p in self.effect.parameters if p.at in (None, self.place))

    def refining(self, channel: Channel) -> tuple[str, ...]:
        """Those that mean something on a channel and have starts."""
        known = {name: self.effect.parameter(name) for name in self.optional}
        left_out = (BY_ITSELF, *_NOT_BEHIND) if self.at is Attachment.OUTPUT else (BY_ITSELF,)
        there = (name for name in known if (self.name, name) not in left_out)
        return tuple(name for name in there if known[name].starts and channel in known[name].channels)

    def _needs(self, parameter: Parameter) -> bool:
        plain = parameter.tried_first or parameter.name in self.also
        return not parameter.optional or (parameter.apart if self.apart else plain)


def library(channel: Channel, apart: bool = True, loaded: bool = False) -> tuple[Candidate, ...]:
    """Every effect that can act on a channel, at every place it may have; with their forms apart if so wanted.

    `loaded`: a load that moves is measured.
    """
    found = []
    for name, effect in registry().items():
        if channel in effect.channels:
            elsewhere = _NOT_PLAIN.get((name, channel), ())
            places = (at for at in (None, *effect.places(channel)[1:]) if at not in elsewhere)
            first = (p for p in effect.parameters if apart and channel in p.first_on)
            also = tuple(p.name for p in first if loaded or (name, p.name) != _BY_LOAD)
            found += [Candidate(name, at, also=also) for at in places]
            formed = any(p.apart and not p.tried_first for p in effect.parameters) and (name, channel) not in _ONE_FORM
            found += [Candidate(name, effect.apart_at, apart=True)] * (apart and formed)
            further = (form for *of, form in FURTHER if of == [name, channel] and (loaded or form not in BY_LOAD))
            found += [Candidate(name, PLACES.get(form), also=form) for form in further if apart]
    return tuple(found)


def in_vocabulary(name: str) -> bool:
    """Whether an effect may be named."""
    return registry()[name].vocabulary


def grid(
    problem: Problem, path: PathSpec, candidate: Candidate, name: str, residual: Array, fine: bool = False
) -> list[float]:
    """Values that a parameter's fit begins from, on a path whose `residual` (n,) it shall explain.

    `fine`: many of a parameter with a grain, from which no fit gets far; but in rough data, whose minima are shallow.
    """
    parameter = candidate.effect.parameter(name)
    if parameter.quantity is Quantity.FREQUENCY:
        peaks = _peaks(problem, residual)
        # A mode rings where it is, but what drives it colours the residual more.
        return peaks if candidate.name == "periodic_disturbance" else [*parameter.starts, *peaks[:2]]
    unit = unit_of(problem, parameter, candidate.place)
    further = further_starts(problem, candidate.also, parameter, unit)
    if further is not None:
        return further
    if candidate.name == "cubic_stiffness" and parameter.name in ("centre", "coefficient"):
        return spring_starts(problem, path, parameter, unit)
    if candidate.apart and name == "centre_v":
        bent = candidate.name == "asymmetric_gain"
        return [0.0, *kinks_v(problem, path, residual)] if bent else flattest_v(problem, path, residual, 2)
    if candidate.apart and name == "working":
        return [1.0]
    # In rough data all coefficients move, and with them what no voltage would do.
    if (name == "through_zero" and problem.rough) or (candidate.name, name) == _BY_LOAD:
        return [0.0, 1.0]
    if candidate.name == "saturation" and parameter.quantity is Quantity.INPUT_PEAK:
        return limit_starts(problem, parameter, unit, "centre_v" in candidate.also)
    if candidate.name == "saturation" and name in ("centre_v", "behind_s"):
        return [float(np.mean(problem.simulator.voltage_v))] if name == "centre_v" else lags_s(path)
    if candidate.name == "overflow" and name in _STOPS:
        return stop_starts(problem, path, parameter, unit)
    if candidate.name == "leakage" and name in _WORN:
        return wear_starts(problem, path, parameter)
    if candidate.name == "square_root_outflow" and name in _STORES and not problem.windows.anchored:
        return store_starts(problem, path, parameter)
    if fine and candidate.name == "friction" and parameter.grain_on(problem.channel) > 0.0:
        return list(_SLIPS) if name == "slip" else breakaways_v(problem, path, residual)
    if fine and parameter.grain_on(problem.channel) > 0.0 and not problem.rough:
        return list(unit * np.geomspace(min(parameter.starts), 1.5 * max(parameter.starts), _FINE_STARTS))
    if candidate.name == "friction" and name == "coulomb_v":
        mostly = float(np.median(np.abs(problem.simulator.voltage_v)))
        # Where jumps set the voltage's scale, what holds on in between is small beside it.
        sizes = (unit, mostly) if mostly < _JUMPS * unit else (unit,)
        return [start * size for size in sizes for start in parameter.starts]
    return [start * unit for start in parameter.starts]


def _peaks(problem: Problem, residual: Array) -> list[float]:
    """Frequencies that a residual (n,) holds most of; of one that drifts, what it holds beside the drift too."""
    step_s = problem.simulator.sample_time_s
    peaks = spectral_peaks(residual, step_s)
    if not problem.windows.anchored:
        return peaks
    beside = spectral_peaks(replace(problem.windows, trend=True).project(residual), step_s, 1)
    return peaks + [hz for hz in beside if all(abs(hz - peak) * problem.length_s > _ONE_LINE for peak in peaks)]


def add_effect(path: PathSpec, candidate: Candidate, parameters: Mapping[str, float]) -> PathSpec:
    """The path with one more effect; one of the same name is replaced where it stands."""
    complete = candidate.effect.complete(dict(parameters))
    new = EffectSpec.model_construct(name=candidate.name, at=candidate.at, parameters=complete)
    effects = tuple(new if effect.name == candidate.name else effect for effect in path.effects)
    if all(effect is not new for effect in effects):
        effects = (new, *effects) if candidate.first else (*effects, new)
    return path.model_copy(update={"effects": effects})


def hypothesis(problem: Problem, path: PathSpec, nominal: tuple[Term, ...], freed: Freed) -> Hypothesis:
    """A hypothesis on a path: the nominal terms and the freed parameters of its effects."""
    terms = list(nominal)
    for index, spec in enumerate(path.effects):
        effect = registry()[spec.name]
        terms += [effect_term(problem, index, effect.parameter(p), spec.place) for p in freed.get(spec.name, ())]
    return Hypothesis(path, tuple(terms))


def plain_starts(
    problem: Problem, path: PathSpec, candidate: Candidate, residual: Array, fine: bool = False
) -> list[PathSpec]:
    """Paths with the candidate in its plain form at every combination of its starts, `fine` ones if so wanted."""
    grids = [grid(problem, path, candidate, p, residual, fine) for p in candidate.required]
    return [add_effect(path, candidate, dict(zip(candidate.required, c, strict=True))) for c in product(*grids)]


def pair_starts(
    problem: Problem, path: PathSpec, former: str, candidate: Candidate, residual: Array, like: Hypothesis
) -> list[Array]:
    """Starts of the effect that a path has been given together with a candidate, as if neither had been fitted.

    Alone the former had to do the work of both. The nominal parameters begin from their centres; `like` is the
    hypothesis to start.
    """
    old = path.effect(former)
    kept = tuple(e for e in path.effects if e.name not in (old.name, candidate.name))
    bare = path.model_copy(update={"effects": kept})
    home = [term.centre for term in like.terms if term.effect < 0]
    found: list[Array] = []
    for one in plain_starts(problem, bare, Candidate(old.name, old.at), residual):
        for both in plain_starts(problem, one, candidate, residual):
            by_name = {effect.name: effect for effect in both.effects}
            ordered = both.model_copy(update={"effects": tuple(by_name[e.name] for e in like.path.effects)})
            x = Hypothesis(ordered, like.terms).start()
            x[: len(home)] = home
            found.append(x)
    return drawn(found, _MOST_PAIRS)


def all_starts(problem: Problem, path: PathSpec, candidate: Candidate, residual: Array) -> list[PathSpec]:
    """Paths with the candidate at combinations of the starts of all its parameters, evenly drawn from where many."""
    names = candidate.required + candidate.refining(problem.channel)
    grids = []
    for name in names:
        starts = grid(problem, path, candidate, name, residual)
        neutral = [candidate.effect.parameter(name).neutral] if name in candidate.optional else []
        grids.append(list(dict.fromkeys([*neutral, *starts])))
    combinations = drawn(list(product(*grids)), _MOST_PAIRS)
    return [add_effect(path, candidate, dict(zip(names, c, strict=True))) for c in combinations]
