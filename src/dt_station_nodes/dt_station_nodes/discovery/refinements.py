"""Refined forms of an effect: its optional parameters and where their fits begin."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product

import numpy as np
from numpy.typing import NDArray

from ..core.channels import Channel
from ..core.models import PathSpec
from ..core.models.effects import Attachment, Quantity
from .beginnings import BEGINS, beginnings, has_begin
from .candidates import BY_ITSELF, Candidate, add_effect, grid
from .problem import Problem
from .settling import SETTLING, heated_drift, settling_drift
from .start_groups import drawn
from .terms import Term, refits_all
from .timing import DRIFT, seen_timing, softer

Array = NDArray[np.float64]

_MOST_COMBINATIONS = 64
# A cylinder has no store before its own, and a piston's stop is no relief valve.
_NO_PISTONS = tuple(("overflow", name) for name in ("inlet_limit", "spill", "opening_s", "reseat"))
# Only of a linear path of few poles, all of which may be refitted, is it known which lags it has.
_OF_FEW_LAGS = (("saturation", "behind_s"),)
# Forms so near to a plainer one that rough data tell the two apart by accident.
_FINE = (
    ("saturation", "straight"),
    ("saturation", "centre_v"),
    ("saturation", "behind_s"),
    ("asymmetric_gain", "of_slope"),
    ("friction", "damping_s"),
)
# So free that beside dry friction a loop takes its stick and slip on itself.
_FREE = (("hysteresis", "bend_per_v"), ("hysteresis", "steepness"))
# A contact that grips more at rest: neither number acts alone, and its jumps are so sharp that no fit gets far.
GRIP = ("static_excess_v", "stribeck_velocity")
# A spring that answers late: a quick one's fit takes that for a centre elsewhere, from where no step leads to it.
ANSWER = "answer_s"
# What bends a curve softly and what goes on beyond the bend, or differs between its sides, come together.
_TOGETHER = (
    ("rounding", "override"),
    ("rounding_v", "passing"),
    ("centre_v", "leak"),
    ("centre_v", "rounding_v"),
    ("rounding_v", "of_slope"),
    ("knee", "centre_v"),
    ("straight", "centre_v"),
    ("inlet_curvature", "empty"),
    ("closing", "past_zero"),
    ("second_s", "straight"),
    ("spread", "closes_v"),
    ("spread", "density_slope"),
    ("way_back", "uneven"),
    ("bouc_wen", "depth", "way_back"),
    ("closes_v", "open_at_v"),
    ("spread", "depth", "bend_per_v", "steepness"),
    ("bend_per_v", "open_at_v"),
    ("presliding", "damping_s"),
    ("stiffness", "cushion_s"),
    ("lead_s", "stiffening"),
    (ANSWER, "stiffening"),
    ("saturation", "in_air"),
    ("lag_s", "changes"),
    ("stretch_per_v", "stretch_levels_v"),
)
_SAG, _SAG_BEND = "sag_per_s", "sag_bend"
_BEGIN = (-1.0, 0.0, 1.0)  # places in a loop or a gap
_COULOMB = np.arange(0.5, 1.06, 0.05)  # of what the plain form took for all of it,
_EXCESS = (0.1, 0.2, 0.35, 0.5, 0.7, 1.0)  # of that,
_PACES = (0.4, 1.0, 2.0, 4.0, 6.0, 12.0)  # times the velocity's start


@dataclass(frozen=True, slots=True)
class Refinements:
    """Starts of a candidate's optional parameters, by name; those of its `timing` make sense together only.

    Those `together` are tried two at a time as well. `rates`: at what rate a drift begins, by how it settles; `heat`:
    how a drift heats, instead. `begins`: where a loop may begin, which is no form of it and comes beside any. Those
    `alone` make a form with no other.
    """

    candidate: Candidate
    grids: Mapping[str, list[float]]
    timing: Mapping[str, float]
    rates: Mapping[float, float]
    heat: Mapping[str, float]
    begins: list[float]
    together: tuple[tuple[str, ...], ...] = ()
    alone: Mapping[str, list[float]] = field(default_factory=dict)

    @property
    def names(self) -> tuple[str, ...]:
        """Parameters worth a try: those that the effect, or the run, has a start for."""
        return (*self.grids, *self.timing)

    @property
    def steps(self) -> tuple[tuple[str, ...], ...]:
        """Names that are tried at a time where one refinement is."""
        grips = [GRIP] if all(name in self.grids for name in GRIP) else []
        alone = [(name,) for name in (*self.grids, *self.alone) if not (grips and name in GRIP)]
        sought = [tuple(numbers) for numbers in (self.timing, self.heat) if numbers]
        return (*alone, *self.together, *grips, *sought)

    def neutral(self, name: str) -> float:
        """Value at which a parameter changes nothing."""
        return self.candidate.effect.parameter(name).neutral

    def timings(self) -> list[dict[str, float]]:
        """Without its timing, and with it."""
        if not self.timing:
            return [{}]
        return [{name: self.neutral(name) for name in self.timing}, dict(self.timing), *softer(self.timing)]


def refinements(
    problem: Problem,
    path: PathSpec,
    candidate: Candidate,
    residual: Array,
    timed: bool = True,
    nominal: Sequence[Term] = (),
    alone: bool = True,
) -> Refinements:
    """What may refine a candidate's plain form fitted on `path`, where the base left `residual` (n,).

    Not `timed`, nothing is sought that comes and goes, nor a fine difference, nor two refinements at a time: in rough
    data anything seems to. Not `alone`, nor are forms so free that they mend what stands beside them.
    """
    timing = seen_timing(problem, path, candidate.name, nominal) if timed else {}
    own = list(candidate.refining(problem.channel))
    if not timed:
        own = [name for name in own if (candidate.name, name) not in _FINE]
    if not alone:
        own = [name for name in own if (candidate.name, name) not in _FREE]
    if problem.windows.anchored:
        own = [name for name in own if (candidate.name, name) not in _NO_PISTONS]
    if not refits_all(path):
        own = [name for name in own if (candidate.name, name) not in _OF_FEW_LAGS]
    if problem.channel is Channel.POSITION and not problem.loaded:
        # What grows with a load that does not move is one with its size.
        own = [name for name in own if candidate.effect.parameter(name).quantity is not Quantity.PER_LOAD]
    together = tuple(pair for pair in _TOGETHER if timed and all(name in own for name in pair))
    grids = {name: grid(problem, path, candidate, name, residual) for name in own}
    rates: dict[float, float] = {}
    heat: Mapping[str, float] = {}
    if candidate.name == DRIFT and timed and SETTLING in grids:
        settling_s, rate = settling_drift(problem, path)
        grids[SETTLING], rates, heat = [settling_s], {settling_s: rate}, heated_drift(problem, path)
    begins = beginnings(problem, path, candidate.name, _BEGIN) if timed and has_begin(candidate.name) else []
    effect, number = BY_ITSELF
    gives = timed and (candidate.name, candidate.place) == (effect, Attachment.INPUT)
    one = {number: grid(problem, path, candidate, number, residual)} if gives else {}
    return Refinements(candidate, grids, timing, rates, heat, begins, together, one)


def step_starts(path: PathSpec, forms: Refinements, names: tuple[str, ...]) -> list[PathSpec]:
    """Paths around a fitted plain form with one step of refinement at its neutral value and at its starts."""
    if names == tuple(forms.timing):
        return _refined(path, forms, forms.timings())
    if names == tuple(forms.heat):
        return _refined(path, forms, [dict(forms.heat)])
    if names == GRIP:
        return _gripping(path, forms)
    if names == (BEGINS,):
        return _refined(path, forms, [{BEGINS: value} for value in forms.begins])
    grids = {**forms.grids, **forms.alone}
    values = [dict.fromkeys(grids[n] if n == ANSWER else [forms.neutral(n), *grids[n]]) for n in names]
    return _refined(path, forms, [dict(zip(names, one, strict=True)) for one in product(*values)])


def _gripping(path: PathSpec, forms: Refinements) -> list[PathSpec]:
    coulomb = path.effect(forms.candidate.name).parameters[forms.candidate.required[0]]
    (pace,) = forms.grids[GRIP[1]]
    found: list[PathSpec] = []
    for size, excess, times in product(_COULOMB, _EXCESS, _PACES):
        numbers = {GRIP[0]: excess * size * coulomb, GRIP[1]: times * pace}
        found += _refined(path, forms, [numbers], float(size))
    return found


def refined_starts(path: PathSpec, forms: Refinements) -> list[PathSpec]:
    """Paths around a fitted plain form with the optional parameters at every combination of neutral and starts."""
    grids = [list(dict.fromkeys([forms.neutral(name), *values])) for name, values in forms.grids.items()]
    if math.prod(len(values) for values in grids) > _MOST_COMBINATIONS:
        grids = list(forms.grids.values())
    combinations = drawn(list(product(*grids)), _MOST_COMBINATIONS)
    named = [{**dict(zip(forms.grids, c, strict=True)), **times} for times in forms.timings() for c in combinations]
    # Another form may need another size: a dead zone that jumps open is wider than one that does not.
    sizes = (1.0, 2.5, 6.0) if len(named) * 3 <= _MOST_COMBINATIONS else (1.0,)
    return [start for size in sizes for start in _refined(path, forms, named, size)]


def _refined(path: PathSpec, forms: Refinements, chosen: list[dict[str, float]], size: float = 1.0) -> list[PathSpec]:
    main = forms.candidate.required[0]
    spec = path.effect(forms.candidate.name)
    sized = {**spec.parameters, main: spec.parameters[main] * size}
    starts = ({**sized, **_along(spec.parameters, forms, numbers), **numbers} for numbers in chosen)
    return [add_effect(path, forms.candidate, numbers) for numbers in starts]


def _along(plain: Mapping[str, float], forms: Refinements, numbers: Mapping[str, float]) -> dict[str, float]:
    """What else of the plain form begins elsewhere with some numbers of a refinement."""
    if numbers.get(SETTLING) in forms.rates:
        return {forms.candidate.required[0]: forms.rates[numbers[SETTLING]]}
    if numbers.get(_SAG_BEND, 0.0) > 0.0:
        # A flow that turns turbulent begins so much steeper, to be what it was where the run goes.
        (lengths,) = forms.candidate.effect.parameter(_SAG_BEND).starts
        return {_SAG: plain[_SAG] * math.sqrt(1.0 + lengths)}
    if numbers.get(ANSWER, 0.0) > 0.0:
        return {"centre": 0.0}
    if numbers.get("way_back", 0.0) > 0.0 and "depth" in numbers:
        # A loop of exponentials is as wide as the plain one was, times its depth.
        width = forms.candidate.required[0]
        return {width: plain[width] * plain["depth"] / numbers["depth"]}
    return {}
