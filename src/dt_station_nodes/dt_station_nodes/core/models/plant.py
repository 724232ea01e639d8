"""A model made ready to simulate: `step(state, input) -> state, output`, and whole runs by the same kernel."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..channels import Channel
from . import kernel
from .compiled import CONTEXT_SIZE
from .effects import Attachment, registry
from .linear import LinearPath, discretise
from .spec import ModelError, ModelSpec, PathSpec

Array = NDArray[np.float64]

_ORDER = {Attachment.INPUT: kernel.INPUT, Attachment.STATE: kernel.STATE, Attachment.OUTPUT: kernel.OUT}
_EMPTY = np.zeros(0)
# Long enough for speed at 20 ms, short enough that stick, lag and delay are resolved.
LONGEST_SUBSTEP_S = 0.005


@dataclass(frozen=True, slots=True)
class ModelState:
    """Everything the model remembers between samples, as one array of fixed layout (never written to)."""

    values: Array

    @property
    def sequence(self) -> int:
        """Samples advanced so far."""
        return int(self.values[0])


@dataclass(frozen=True, slots=True)
class ModelInput:
    """Voltages applied from this sample on (V); the measured pressure (Pa) where it drives the disturbance path."""

    load_voltage_v: float
    servo_voltage_v: float
    pressure_pa: float | None = None


@dataclass(frozen=True, slots=True)
class ModelOutput:
    """What the sensors would say at this sample (SI)."""

    pressure_pa: float
    position_m: float


@dataclass(frozen=True, slots=True)
class Simulation:
    """A simulated run: arrays of shape (n,) in SI and the state after its last sample."""

    pressure_pa: Array
    position_m: Array
    state: ModelState


class PlantModel:
    """A `ModelSpec` at one sample time; ModelError if it cannot be simulated at it."""

    def __init__(self, spec: ModelSpec, sample_time_s: float) -> None:
        """Discretise the paths exactly and lay out the state."""
        if not (math.isfinite(sample_time_s) and sample_time_s > 0.0):
            raise ModelError(f"the sample time must be a positive number of seconds, not {sample_time_s}")
        self.spec = spec
        self.sample_time_s = sample_time_s
        self.substeps = _substeps(spec, sample_time_s)
        step_s = sample_time_s / self.substeps
        self._pressure, pressure_sizes = _prepare(spec.paths.get(Channel.PRESSURE), step_s)
        self._position, position_sizes = _prepare(spec.paths.get(Channel.POSITION), step_s)
        bounds = np.cumsum([3, *pressure_sizes, *position_sizes])
        self._layout = bounds.astype(np.int64)
        self._context = np.zeros(CONTEXT_SIZE)

    def initial_state(self, position_m: float | None = None, pressure_pa: float | None = None) -> ModelState:
        """At rest, or standing at a position and a pressure (SI) where the model can stand there."""
        values = np.zeros(int(self._layout[-1]))
        for at, arrays, wanted in ((0, self._pressure, pressure_pa), (3, self._position, position_m)):
            path = Channel.PRESSURE if at == 0 else Channel.POSITION
            if wanted is None or path not in self.spec.paths:
                continue
            above = wanted - float(arrays.direct[2])
            values[1 if at == 0 else 2] = above
            values[self._layout[at] : self._layout[at + 1]] = _standing(arrays, above)
        return ModelState(_frozen(values))

    def step(self, state: ModelState, given: ModelInput) -> tuple[ModelState, ModelOutput]:
        """One sample: the output at it and the state at the next, after `given` acted for one sample time."""
        measured = _EMPTY if given.pressure_pa is None else np.array([given.pressure_pa])
        voltages = np.array([[given.load_voltage_v, given.servo_voltage_v]])
        values, outputs = self._run(state, voltages, measured, interpolate=False)
        return ModelState(values), ModelOutput(float(outputs[0, 0]), float(outputs[0, 1]))

    def simulate(
        self,
        load_voltage_v: Array,
        servo_voltage_v: Array,
        pressure_pa: Array | None = None,
        state: ModelState | None = None,
        *,
        interpolate_pressure: bool = False,
    ) -> Simulation:
        """A whole run from voltages of shape (n,); `pressure_pa` as in `ModelInput`, held or interpolated."""
        voltages = np.column_stack([load_voltage_v, servo_voltage_v]).astype(np.float64)
        measured = _EMPTY if pressure_pa is None else np.ascontiguousarray(pressure_pa, dtype=np.float64)
        values, outputs = self._run(state or self.initial_state(), voltages, measured, interpolate=interpolate_pressure)
        return Simulation(outputs[:, 0].copy(), outputs[:, 1].copy(), ModelState(values))

    def _run(self, state: ModelState, voltages: Array, measured: Array, *, interpolate: bool) -> tuple[Array, Array]:
        values = state.values.copy()
        outputs = np.empty_like(voltages)
        timing = np.array([self.sample_time_s, float(self.substeps), float(interpolate)])
        kernel.run(
            self._pressure, self._position, timing, values, self._layout, voltages, measured, self._context, outputs
        )
        return _frozen(values), outputs


def _substeps(spec: ModelSpec, sample_time_s: float) -> int:
    effects = [registry()[effect.name] for path in spec.paths.values() for effect in path.effects]
    coupled = any(path.disturbance is not None for path in spec.paths.values())
    if not coupled and not any(effect.sub_stepped for effect in effects):
        return 1
    return max(1, math.ceil(sample_time_s / LONGEST_SUBSTEP_S - 1e-9))


def _prepare(path: PathSpec | None, step_s: float) -> tuple[kernel.PathArrays, tuple[int, int, int]]:
    """Kernel arrays of a path (an absent one gives a constant zero) and its numbers of states."""
    nothing = LinearPath(np.zeros((0, 0)), _EMPTY, _EMPTY, 0.0, _EMPTY, _EMPTY, 0.0)
    linear = nothing if path is None else discretise(path, path.scale, step_s)
    away = nothing
    if path is not None and path.disturbance is not None:
        away = discretise(path.disturbance, path.scale * path.disturbance.input_scale, step_s)
    chosen = [] if path is None else [(registry()[e.name], e.parameters) for e in path.effects]
    chosen.sort(key=lambda pair: _ORDER[pair[0].attachment])
    parameters = [list(effect.complete(given).values()) for effect, given in chosen]
    sizes = [len(values) for values in parameters]
    memory = [effect.state_size for effect, _ in chosen]
    arrays = kernel.PathArrays(
        a=linear.a,
        b=linear.b,
        e=linear.e,
        c=linear.c,
        velocity=linear.velocity,
        direct=np.array([linear.d, linear.velocity_direct, 0.0 if path is None else path.rest]),
        gains=np.array([linear.velocity @ linear.b + linear.velocity_direct, linear.c @ linear.e]),
        da=away.a,
        db=away.b,
        dc=away.c,
        dvelocity=away.velocity,
        ddirect=np.array([away.d, away.velocity_direct]),
        kind=np.array([_ORDER[effect.attachment] for effect, _ in chosen], dtype=np.int64),
        address=np.array([effect.step.address for effect, _ in chosen], dtype=np.int64),
        parameter_at=np.cumsum([0, *sizes], dtype=np.int64)[:-1],
        state_at=np.cumsum([0, *memory], dtype=np.int64)[:-1],
        parameters=np.array([value for values in parameters for value in values], dtype=np.float64),
    )
    return arrays, (linear.b.size, away.b.size, sum(memory))


def _standing(arrays: kernel.PathArrays, above: float) -> Array:
    """Linear states at which the output stands at `above`, with the smallest voltage that holds it there."""
    n = arrays.b.size
    if n == 0:
        return np.zeros(0)
    # Unknown states and held voltage: x = a x + b u, y = above; least norm where an integrator leaves u free.
    system = np.zeros((n + 1, n + 1))
    system[:n, :n] = arrays.a - np.eye(n)
    system[:n, n] = arrays.b
    system[n, :n] = arrays.c
    system[n, n] = arrays.direct[0]
    right = np.zeros(n + 1)
    right[n] = above
    scale = np.abs(system).max(axis=1, keepdims=True)
    solution = np.linalg.lstsq(system / scale, right / scale[:, 0], rcond=None)[0]
    return np.asarray(solution[:n], dtype=np.float64)


def _frozen(values: Array) -> Array:
    values.setflags(write=False)
    return values
