"""A model made ready to simulate: `step(state, input) -> state, output`, and whole runs by the same kernel."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..channels import Channel
from . import kernel
from .compiled import CONTEXT_SIZE
from .prepare import prepare, standing, substeps
from .spec import ModelError, ModelSpec

Array = NDArray[np.float64]

_EMPTY = np.zeros(0)
# Sample count and the outputs above rest come before the paths' states.
_FIRST_STATE = 3


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
        self.substeps = substeps(spec.paths.values(), sample_time_s)
        step_s = sample_time_s / self.substeps
        self._pressure = prepare(spec.paths.get(Channel.PRESSURE), Channel.PRESSURE, step_s, _FIRST_STATE)
        after = _FIRST_STATE + self._pressure.size
        self._position = prepare(spec.paths.get(Channel.POSITION), Channel.POSITION, step_s, after)

    def initial_state(self, position_m: float | None = None, pressure_pa: float | None = None) -> ModelState:
        """At rest, or standing at a position and a pressure (SI) where the model can stand there."""
        values = np.zeros(_FIRST_STATE + self._pressure.size + self._position.size)
        for output_at, path, wanted in ((1, self._pressure, pressure_pa), (2, self._position, position_m)):
            if wanted is not None and path.linear.b.size:
                values[output_at] = wanted - path.rest
                states = standing(path, wanted - path.rest)
                values[path.state_at : path.state_at + states.size] = states
        return ModelState(_frozen(values))

    def output(self, state: ModelState) -> ModelOutput:
        """What the sensors say at a state; the same as `step` says, without a step."""
        return ModelOutput(float(state.values[1]) + self._pressure.rest, float(state.values[2]) + self._position.rest)

    def step(self, state: ModelState, given: ModelInput) -> tuple[ModelState, ModelOutput]:
        """One sample: the output at it and the state at the next, after `given` acted for one sample time."""
        measured = _EMPTY if given.pressure_pa is None else np.array([given.pressure_pa], dtype=np.float64)
        voltages = np.array([[given.load_voltage_v, given.servo_voltage_v]], dtype=np.float64)
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
            self._pressure.numbers,
            self._pressure.places,
            self._position.numbers,
            self._position.places,
            timing,
            values,
            voltages,
            measured,
            np.zeros(2 * CONTEXT_SIZE),
            np.empty_like(values),
            outputs,
            (0, len(outputs)),
        )
        return _frozen(values), outputs


def _frozen(values: Array) -> Array:
    values.setflags(write=False)
    return values
