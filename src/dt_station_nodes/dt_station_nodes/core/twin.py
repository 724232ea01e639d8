"""The twin: a model stepped by the object's metronome, driven by applied voltages or by its own loops."""

import math
from dataclasses import dataclass, replace

from .channels import Channel
from .control import ControlInput, LoopController, LoopState
from .models import ModelInput, ModelState, PlantModel
from .samples import PlantSample, SampleFlag


@dataclass(frozen=True, slots=True)
class TwinState:
    """The model at sample `last`; None before the first."""

    model: ModelState | None = None
    last: PlantSample | None = None


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


class _Simulated:
    """What both feeds share: standing where the object stands, and reading the sensors of the model."""

    __slots__ = ("_has", "_model")

    def __init__(self, model: PlantModel) -> None:
        self._model = model
        self._has = {channel: channel in model.spec.paths for channel in Channel}

    def standing(self, sample: PlantSample) -> ModelState:
        """The model at the object's measured position and pressure."""
        return self._model.initial_state(_finite(sample.position_m), _finite(sample.pressure_pa))

    def advance(self, state: ModelState, load_v: float, servo_v: float, pressure_pa: float | None) -> ModelState:
        """One sample time on."""
        after, _ = self._model.step(state, ModelInput(load_v, servo_v, pressure_pa))
        return after

    def sample(self, state: ModelState, stamped: PlantSample, load_v: float, servo_v: float) -> PlantSample:
        """The sensors now, with the object's number, stamp and end; NaN for a channel without a model."""
        _, output = self._model.step(state, ModelInput(load_v, servo_v))
        return replace(
            stamped,
            position_m=output.position_m if self._has[Channel.POSITION] else math.nan,
            pressure_pa=output.pressure_pa if self._has[Channel.PRESSURE] else math.nan,
            load_voltage_v=load_v,
            servo_voltage_v=servo_v,
            flags=stamped.flags & SampleFlag.END,
        )


def _begins(state: TwinState, sample: PlantSample) -> bool:
    return state.model is None or state.last is None or sample.sequence <= state.last.sequence


class CommandTwin:
    """The loop broken: driven by the voltages really applied and, if `measured_pressure`, the pressure measured."""

    __slots__ = ("_measured_pressure", "_simulated")

    def __init__(self, model: PlantModel, measured_pressure: bool = True) -> None:
        self._simulated = _Simulated(model)
        self._measured_pressure = measured_pressure

    def initial_state(self) -> TwinState:
        """Before the first sample; the model will stand where that one finds the object."""
        return TwinState()

    def step(self, state: TwinState, sample: PlantSample) -> tuple[TwinState, PlantSample]:
        """The model's answer to sample k: advanced from k-1 with the voltages applied since, over a gap with the same.

        A sample that does not come after the last one begins a new run.
        """
        load_v, servo_v = sample.load_voltage_v, sample.servo_voltage_v
        if state.model is None or state.last is None or _begins(state, sample):
            model = self._simulated.standing(sample)
        else:
            model = state.model
            pressure = _finite(state.last.pressure_pa) if self._measured_pressure else None
            for _ in range(sample.sequence - state.last.sequence):
                model = self._simulated.advance(model, load_v, servo_v, pressure)
        return TwinState(model, sample), self._simulated.sample(model, sample, load_v, servo_v)


@dataclass(frozen=True, slots=True)
class LoopTwinState:
    """The model at sample `last`, its loops, and the voltages applied until `last`."""

    twin: TwinState
    load: LoopState
    position: LoopState
    load_voltage_v: float = 0.0
    servo_voltage_v: float = 0.0
    load_input: ControlInput | None = None
    position_input: ControlInput | None = None


class SetpointTwin:
    """Loops of its own: simulates controllers and object from the set-points alone."""

    __slots__ = ("_simulated", "load", "position")

    def __init__(self, model: PlantModel, load: LoopController, position: LoopController) -> None:
        self._simulated = _Simulated(model)
        self.load = load
        self.position = position

    def initial_state(self) -> LoopTwinState:
        """Before the first sample; the model will stand where that one finds the object."""
        return LoopTwinState(TwinState(), self.load.initial_state(), self.position.initial_state())

    def step(
        self, state: LoopTwinState, sample: PlantSample, load_setpoint_pa: float, position_setpoint_m: float
    ) -> tuple[LoopTwinState, PlantSample]:
        """Sample k of the simulated loops; the commands computed at it act from it on."""
        if state.twin.model is None or state.twin.last is None or _begins(state.twin, sample):
            state = self.initial_state()
            model = self._simulated.standing(sample)
        else:
            model = state.twin.model
            for _ in range(sample.sequence - state.twin.last.sequence):
                model = self._simulated.advance(model, state.load_voltage_v, state.servo_voltage_v, None)
        simulated = self._simulated.sample(model, sample, state.load_voltage_v, state.servo_voltage_v)
        pressure = simulated.pressure_pa
        load_input = ControlInput(load_setpoint_pa, pressure, pressure)
        position_input = ControlInput(position_setpoint_m, simulated.position_m, pressure)
        load, load_output = self.load.step(state.load, load_input)
        position, position_output = self.position.step(state.position, position_input)
        after = LoopTwinState(
            TwinState(model, sample),
            load,
            position,
            load_output.voltage_v,
            position_output.voltage_v,
            load_input,
            position_input,
        )
        return after, simulated
