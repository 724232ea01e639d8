"""One path alone under given voltages and load: what a fit simulates thousands of times."""

from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..channels import Channel
from . import kernel, path_map
from .brought_back import run_brought_back
from .compiled import CONTEXT_SIZE
from .effects import Attachment, registry
from .linear import LinearPath
from .prepare import MOST_SUBSTEPS, PreparedPath, prepare, standing, substeps
from .spec import DisturbanceSpec, PathSpec

Array = NDArray[np.float64]

_FIRST_STATE = 3
_NONE = np.zeros(0)
_REMEMBERED = 32_000_000  # bytes of answers: a search comes back to where it was, and moves one part of a path alone
_LONG = 8_000  # sub-steps: what else an evaluation takes is as long as half of fewer
_Key = tuple[object, ...]


@lru_cache(maxsize=64)
def _absent(channel: Channel, step_s: float, state_at: int, rest: float) -> PreparedPath:
    """The path that is not simulated: its rest value for ever."""
    nothing = prepare(None, channel, step_s, state_at)
    nothing.numbers[path_map.REST_OUTPUT] = rest
    return nothing


def _on_voltage(path: PathSpec) -> bool:
    """Whether all effects of a path act on its voltage, before anything that the load moves."""
    return all(effect.place is Attachment.INPUT for effect in path.effects)


def at_places(path: PathSpec) -> bool:
    """Whether a path integrates and effects act at places of its output."""
    return path.denominator[-1] == 0.0 and any(registry()[effect.name].between for effect in path.effects)


def _key(path: PathSpec, steps: int, away: DisturbanceSpec | None) -> _Key:
    """All that a path's answer depends on, `away` being what the load moves, in sub-steps of `steps` a sample."""
    return (
        path.numerator,
        path.denominator,
        path.gain,
        path.time_scale,
        path.scale,
        path.rest,
        path.outlet,
        away and (away.numerator, away.denominator, away.gain, away.time_scale, away.input_scale),
        tuple((e.name, e.at, *e.parameters.items()) for e in path.effects),
        steps,
    )


def _free(path: PathSpec, rest: float) -> Array:
    """The places (SI), shape (2,), between which no effect of a path acts because of where its output is."""
    low, high = -np.inf, np.inf
    for effect in path.effects:
        known = registry()[effect.name]
        if known.between:
            lower, upper = (known.complete(effect.parameters)[name] for name in known.between)
            low, high = max(low, rest + lower), min(high, rest + upper)
    return np.array([low, high])


@dataclass(frozen=True, slots=True)
class PathSimulator:
    """Simulates variants of one channel's path over one run by the kernel that runs whole models.

    `voltage_v` (n,), `load_pa` (n,) the pressure that loads a position path (absolute, interpolated within a
    sample) or empty, `rest_pa` the pressure's rest value, `first` the measured output (SI) the run begins at,
    `first_velocity` (SI/s) how fast it then moves; None: it stands. `other_v` (n,): the other path's voltage, which
    only effects look at. `coarsely`: in half the sub-steps.
    """

    channel: Channel
    sample_time_s: float
    voltage_v: Array
    load_pa: Array
    rest_pa: float
    first: float
    first_velocity: float | None = None
    other_v: Array | None = None
    coarsely: bool = False
    _voltages: Array = field(init=False)
    _load: Array = field(init=False)
    _answers: OrderedDict[_Key, Array] = field(init=False, default_factory=OrderedDict, compare=False)

    def __post_init__(self) -> None:
        voltages = np.zeros((len(self.voltage_v), 2))
        own = 0 if self.channel is Channel.PRESSURE else 1
        voltages[:, own] = self.voltage_v
        if self.other_v is not None:
            voltages[:, 1 - own] = self.other_v
        object.__setattr__(self, "_voltages", voltages)
        # A pressure path feels its own pressure only.
        load = self.load_pa if len(self.load_pa) else np.full(len(self.voltage_v), self.rest_pa)
        object.__setattr__(self, "_load", _NONE if self.channel is Channel.PRESSURE else load)

    def __reduce__(self) -> tuple[Callable[..., "PathSimulator"], tuple[object, ...]]:
        # A task is packed by a thread beside the search, which goes on remembering: what it remembers stays here.
        return _unpacked, tuple(getattr(self, f.name) for f in fields(self) if f.init)

    def coarse(self, path: PathSpec) -> "PathSimulator":
        """The same in half the sub-steps; itself where a sample has one or the most, or a run is soon simulated."""
        steps = substeps((path,), self.sample_time_s)
        # The most may be fewer than a path asks for: half of them would tell its slopes wrongly.
        if steps in {1, MOST_SUBSTEPS} or steps * len(self.voltage_v) < _LONG:
            return self
        made = replace(self, coarsely=True)
        # What is remembered tells sub-steps apart.
        object.__setattr__(made, "_answers", self._answers)
        return made

    def _steps(self, path: PathSpec) -> int:
        steps = substeps((path,), self.sample_time_s)
        return -(-steps // 2) if self.coarsely else steps

    def _moving(self, linear: LinearPath, states: Array) -> Array:
        """Least change of the states (n,) that gives the output its first velocity and leaves its value.

        None in a path of one state, whose value settles its velocity.
        """
        if states.size < 2:
            return np.zeros(states.size)
        now = float(linear.velocity @ states) + linear.velocity_direct * float(self.voltage_v[0])
        wanted = np.array([0.0, (self.first_velocity or 0.0) - now])
        return np.asarray(
            np.linalg.lstsq(np.array([linear.c, linear.velocity]), wanted, rcond=None)[0], dtype=np.float64
        )

    def simulate_beside(self, path: PathSpec, measured: Array) -> Array:
        """The same of an integrating path kept about where it was `measured` (n,), SI, steps back left out.

        Where a piston meets its stops its place counts, which in open loop drifts.
        """
        return self._simulate(path, self._steps(path), measured)

    def simulate(self, path: PathSpec) -> Array:
        """Output of the path (SI), shape (n,), standing at `first` at the start."""
        steps = self._steps(path)
        away = path.disturbance
        if away is None or not _on_voltage(path):
            return self._answer(path, steps).copy()
        # What the load does is then the same whatever the effects do.
        held = all(registry()[effect.name].held(effect.parameters) for effect in path.effects)
        alone = self._answer(path, 1 if held else steps, loaded=False)
        return alone + away.gain * self._load_part(path, away, steps)

    def _load_part(self, path: PathSpec, away: DisturbanceSpec, steps: int) -> Array:
        """What the load adds to the output (SI), shape (n,), with a gain of 1."""
        key = (away.numerator, away.denominator, away.time_scale, away.input_scale, path.scale, steps)
        if key not in self._answers:
            # All but the load is silent.
            silent = {"numerator": (0.0,), "denominator": (1.0,), "gain": 1.0, "time_scale": 1.0, "rest": 0.0}
            unit = {"effects": (), "disturbance": away.model_copy(update={"gain": 1.0})}
            self._remember(key, self._simulate(path.model_copy(update={**silent, **unit}), steps))
        return self._answers[key]

    def _answer(self, path: PathSpec, steps: int, loaded: bool = True) -> Array:
        """Output of a path (SI), shape (n,), `loaded` or not; remembered, so it is not to be written to."""
        key = _key(path, steps, path.disturbance if loaded else None)
        if key not in self._answers:
            moved = path if loaded else path.model_copy(update={"disturbance": None})
            self._remember(key, self._simulate(moved, steps))
        return self._answers[key]

    def _remember(self, key: _Key, answer: Array) -> None:
        """Keep an answer, in place of the oldest where there are many."""
        if len(self._answers) * len(self.voltage_v) * 8 >= _REMEMBERED:
            self._answers.popitem(last=False)
        answer.flags.writeable = False
        self._answers[key] = answer

    def _simulate(self, path: PathSpec, steps: int, beside: Array | None = None) -> Array:
        step_s = self.sample_time_s / steps
        column = 0 if self.channel is Channel.PRESSURE else 1

        def laid_out(channel: Channel, at: int) -> PreparedPath:
            if channel is self.channel:
                return prepare(path, channel, step_s, at)
            return _absent(channel, step_s, at, self.rest_pa if column else 0.0)

        pressure = laid_out(Channel.PRESSURE, _FIRST_STATE)
        position = laid_out(Channel.POSITION, _FIRST_STATE + pressure.size)
        own = position if column else pressure
        state = np.zeros(_FIRST_STATE + pressure.size + position.size)
        if own.linear.b.size:
            above = self.first - own.rest
            state[1 + column] = above
            states = standing(own, above)
            if self.first_velocity is not None:
                states = states + self._moving(own.linear, states)
            state[own.state_at : own.state_at + states.size] = states
        timing = np.array([self.sample_time_s, float(steps), 1.0])
        given = (pressure.numbers, pressure.places, position.numbers, position.places, timing, state)

        def run(voltages: Array, load: Array) -> Array:
            outputs, scratch, context = np.empty_like(voltages), np.empty_like(state), np.zeros(2 * CONTEXT_SIZE)
            kernel.run(*given, voltages, load, context, scratch, outputs, (0, len(voltages)))
            return outputs[:, column].copy()

        remembers = own.size > own.linear.b.size + int(own.places[path_map.AWAY_STATES])
        if remembers and self.first_velocity is None:
            # Lags, delays and loops remember the voltage that held the path standing, not its first of the run.
            before = state.copy()
            held = np.where(np.arange(2) == column, self.remembered_v(path), self._voltages[:1])
            run(held, self._load[:1])
            memory_at = own.state_at + own.linear.b.size + int(own.places[path_map.AWAY_STATES])
            state[:memory_at] = before[:memory_at]
        if beside is None:
            return run(self._voltages, self._load)
        shift = np.zeros_like(state)
        shift[1 + column] = 1.0
        shift[own.state_at : own.state_at + own.linear.b.size] = standing(own, 1.0)
        outputs = np.empty_like(self._voltages)
        run_brought_back(*given, self._voltages, self._load, outputs, beside, shift, _free(path, own.rest))
        return outputs[:, column].copy()

    def remembered_v(self, path: PathSpec) -> float:
        """Voltage (V) before the run: at which the path stands at `first`; the run's own where it moves already."""
        if self.first_velocity is not None:
            return float(self.voltage_v[0])
        if path.denominator[-1] == 0.0 or path.numerator[-1] == 0.0:
            return 0.0
        static = path.scale * path.gain * path.numerator[-1] / path.denominator[-1]
        return (self.first - path.rest) / static if static else 0.0


_UNPACKED: dict[_Key, PathSimulator] = {}
_MOST_UNPACKED = 4  # both channels of a run and of the one it is checked on


def _unpacked(*given: Any) -> PathSimulator:
    """A simulator as it was packed; a process that is sent one again and again goes on with what it remembers."""
    key = tuple(each.tobytes() if isinstance(each, np.ndarray) else each for each in given)
    if key not in _UNPACKED:
        if len(_UNPACKED) >= _MOST_UNPACKED:
            del _UNPACKED[next(iter(_UNPACKED))]
        _UNPACKED[key] = PathSimulator(*given)
    return _UNPACKED[key]
