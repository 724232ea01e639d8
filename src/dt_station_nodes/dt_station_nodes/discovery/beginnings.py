"""Where a loop or a gap may be when a run begins: no one knows, and it tells until the voltage has passed it once."""

import numpy as np
from numpy.typing import NDArray

from ..core.models import EffectSpec, PathSpec
from ..core.models.effects import Attachment
from .problem import Problem
from .timing import with_numbers

Array = NDArray[np.float64]

BEGINS = "begins"
_WIDTHS = {"backlash": "half_width", "hysteresis": "half_width_v"}
# Of the half width: where in it a run may find it, from end to end,
_PLACES = (-1.0, -0.5, 0.0, 0.5, 1.0)
# and times the noise: what the ends have to differ by to be told.
_TOLD = 0.5


def beginnings(problem: Problem, path: PathSpec, name: str, places: tuple[float, ...]) -> list[float]:
    """How far from rest a loop was last in its middle, for `places` in it (-1..1) when the run begins."""
    spec = next((effect for effect in path.effects if effect.name == name), None)
    half_width = 0.0 if spec is None else spec.parameters[_WIDTHS[name]]
    on_voltage = spec is None or spec.place is Attachment.INPUT
    first = float(problem.simulator.voltage_v[0]) - problem.simulator.remembered_v(path) if on_voltage else 0.0
    return [first + place * half_width for place in places]


def has_begin(name: str) -> bool:
    """Whether an effect is a loop or a gap."""
    return name in _WIDTHS


def loop_of(path: PathSpec) -> EffectSpec | None:
    """The loop or gap of a path, if it has one that is open."""
    loops = (e for e in path.effects if e.name in _WIDTHS and e.parameters[_WIDTHS[e.name]] > 0.0)
    return next(loops, None)


def begun_anywhere(check: Problem, path: PathSpec, spec: EffectSpec) -> tuple[PathSpec, Array]:
    """The path with a loop begun where another run shows it to have been, and what it leaves of that run (n,)."""

    def at(begins: float) -> tuple[PathSpec, Array]:
        moved = with_numbers(path, spec, {BEGINS: begins})
        return moved, check.residual(moved)

    given, low, high = at(0.0), *map(at, beginnings(check, path, spec.name, (-1.0, 1.0)))
    if float(np.max(np.abs(high[1] - low[1]))) < _TOLD * check.noise:
        return given
    inner = [at(value) for value in beginnings(check, path, spec.name, _PLACES[1:-1])]
    tried = [low, *inner, high]
    best = min(range(len(tried)), key=lambda i: _power(tried[i]))
    # Between two places what is left goes nearly along a line.
    finer = []
    for side in (best - 1, best + 1):
        if 0 <= side < len(tried):
            way = tried[side][1] - tried[best][1]
            share = -float(way @ tried[best][1]) / max(float(way @ way), 1e-300)
            place = _PLACES[best] + min(max(share, 0.0), 1.0) * (_PLACES[side] - _PLACES[best])
            finer += [at(value) for value in beginnings(check, path, spec.name, (place,))]
    return min((given, tried[best], *finer), key=_power)


def _power(one: tuple[PathSpec, Array]) -> float:
    return float(np.sum(np.square(one[1])))
