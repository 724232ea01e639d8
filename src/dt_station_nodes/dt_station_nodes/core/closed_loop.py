"""Both loops closed around an object, sample by sample, in one process: read, compute, write."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from .control import ControlInput, LoopController
from .errors import StationError
from .models import ModelInput, ModelState, PlantModel
from .run import Run

Array = NDArray[np.float64]


class Sensors(Protocol):
    """What is read at a sample (SI)."""

    @property
    def position_m(self) -> float:
        """Piston position, m."""
        ...

    @property
    def pressure_pa(self) -> float:
        """Load pressure, Pa."""
        ...


class Voltages(Protocol):
    """What the object really gets (V)."""

    @property
    def load_voltage_v(self) -> float:
        """Relief valve, V."""
        ...

    @property
    def servo_voltage_v(self) -> float:
        """Servo valve, V."""
        ...


class Plant(Protocol):
    """Anything that is read and written once a sample; every backend is one."""

    @property
    def sample_time_s(self) -> float:
        """Time between two reads, s."""
        ...

    def read(self) -> Sensors:
        """The sensors at this sample."""
        ...

    def write(self, load_voltage_v: float, servo_voltage_v: float) -> Voltages:
        """Apply voltages (V) from this sample until the next; what was really applied."""
        ...


class ModelPlant:
    """A model in the place of an object; remembers where it is."""

    __slots__ = ("model", "state")

    def __init__(self, model: PlantModel, state: ModelState | None = None) -> None:
        self.model = model
        self.state = model.initial_state() if state is None else state

    @property
    def sample_time_s(self) -> float:
        """Time between two reads, s."""
        return self.model.sample_time_s

    def read(self) -> Sensors:
        """The model's outputs."""
        return self.model.output(self.state)

    def write(self, load_voltage_v: float, servo_voltage_v: float) -> Voltages:
        """Advance the model by one sample."""
        given = ModelInput(load_voltage_v, servo_voltage_v)
        self.state, _ = self.model.step(self.state, given)
        return given


def run_loops(
    plant: Plant,
    load: LoopController,
    position: LoopController,
    load_setpoint_pa: Array,
    position_setpoint_m: Array,
    source: str = "closed loop",
) -> Run:
    """Run both loops over set-points of shape (n,); a command computed at a sample acts from that sample on."""
    n = len(load_setpoint_pa)
    if n == 0 or len(position_setpoint_m) != n:
        raise StationError("both set-points of a closed loop need one and the same number of samples, at least one")
    table = np.empty((n, 4))
    load_state, position_state = load.initial_state(), position.initial_state()
    set_points = zip(load_setpoint_pa.tolist(), position_setpoint_m.tolist(), strict=True)
    for k, (load_setpoint, position_setpoint) in enumerate(set_points):
        seen = plant.read()
        pressure, place = seen.pressure_pa, seen.position_m
        load_state, load_out = load.step(load_state, ControlInput(load_setpoint, pressure, pressure))
        position_state, position_out = position.step(position_state, ControlInput(position_setpoint, place, pressure))
        applied = plant.write(load_out.voltage_v, position_out.voltage_v)
        table[k] = applied.load_voltage_v, applied.servo_voltage_v, pressure, place
    signals = {
        "pressure_setpoint_pa": np.array(load_setpoint_pa, dtype=np.float64),
        "position_setpoint_m": np.array(position_setpoint_m, dtype=np.float64),
        "load_voltage_v": table[:, 0].copy(),
        "servo_voltage_v": table[:, 1].copy(),
        "pressure_pa": table[:, 2].copy(),
        "position_m": table[:, 3].copy(),
    }
    return Run(plant.sample_time_s, signals, source=source)
