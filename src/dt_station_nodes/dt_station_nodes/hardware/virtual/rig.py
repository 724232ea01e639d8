"""The virtual rig: physics behind a card, as `step(state, input) -> state, output`."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...core.run import Run
from ...core.samples import SampleFlag
from . import kernel as k
from .config import RigConfig
from .converters import driven, sensed
from .parameters import RigError, parameters, rest_state

Array = NDArray[np.float64]

_PRESSURE_STREAM, _POSITION_STREAM = 1, 2


@dataclass(frozen=True, slots=True)
class RigState:
    """Everything the rig remembers between samples: one read-only array in the kernel's layout."""

    values: Array

    @property
    def sequence(self) -> int:
        """Samples advanced so far."""
        return int(self.values[k.SEQUENCE])


@dataclass(frozen=True, slots=True)
class RigInput:
    """Voltages asked of the card from this sample on, V."""

    load_voltage_v: float
    servo_voltage_v: float


@dataclass(frozen=True, slots=True)
class RigOutput:
    """What the card reads at a sample (SI) and gives from it on (V)."""

    pressure_pa: float
    position_m: float
    load_voltage_v: float
    servo_voltage_v: float
    flags: SampleFlag


@dataclass(frozen=True, slots=True)
class Truth:
    """What no sensor shows; for tests and pictures."""

    position_m: float
    velocity_m_s: float
    cap_pressure_pa: float
    rod_pressure_pa: float
    load_pressure_pa: float
    spool_v: float
    frame_m: float


class VirtualRig:
    """A `RigConfig` at one sample time; RigError if it cannot be simulated at it."""

    def __init__(self, config: RigConfig, sample_time_s: float) -> None:
        """Work out the kernel's parameters and the rest state."""
        if not (math.isfinite(sample_time_s) and sample_time_s > 0.0):
            raise RigError(f"the sample time must be a positive number of seconds, not {sample_time_s}")
        self.config = config
        self.sample_time_s = sample_time_s
        self._parameters = parameters(config, sample_time_s)
        self._rest = rest_state(config, self._parameters)

    def initial_state(self) -> RigState:
        """At rest: 0 V, rest pressure, standing at the start position."""
        return RigState(_frozen(self._rest.copy()))

    def read(self, state: RigState) -> tuple[float, float, SampleFlag]:
        """Pressure (Pa) and position (m) as the card reads them at this sample, with the sensors' flags."""
        config, values = self.config, state.values
        at = (config.seed, _PRESSURE_STREAM, state.sequence)
        pressure, far = sensed(config.pressure_sensor, float(values[k.PRESSURE_SENSOR]), *at)
        at = (config.seed, _POSITION_STREAM, state.sequence)
        position, off = sensed(config.position_sensor, float(values[k.POSITION_SENSOR]), *at)
        return pressure, position, SampleFlag.SENSOR_FAULT if far or off else SampleFlag.OK

    def drive(self, given: RigInput) -> tuple[float, float, SampleFlag]:
        """Load and servo voltage (V) that the card gives for those asked, and which of them its range cut."""
        if not (math.isfinite(given.load_voltage_v) and math.isfinite(given.servo_voltage_v)):
            raise RigError(f"the card needs finite voltages, not {given.load_voltage_v} and {given.servo_voltage_v}")
        load, load_cut = driven(self.config.load_output, given.load_voltage_v)
        servo, servo_cut = driven(self.config.servo_output, given.servo_voltage_v)
        flags = SampleFlag.LOAD_VOLTAGE_LIMITED if load_cut else SampleFlag.OK
        return load, servo, flags | (SampleFlag.SERVO_VOLTAGE_LIMITED if servo_cut else SampleFlag.OK)

    def step(self, state: RigState, given: RigInput) -> tuple[RigState, RigOutput]:
        """One sample: the output at it, and the state one sample time later."""
        pressure, position, sensor_flags = self.read(state)
        load, servo, card_flags = self.drive(given)
        values = state.values.copy()
        k.advance(self._parameters, values, load, servo)
        return RigState(_frozen(values)), RigOutput(pressure, position, load, servo, sensor_flags | card_flags)

    def simulate(self, load_voltage_v: Array, servo_voltage_v: Array, state: RigState | None = None) -> Run:
        """The table of a whole run from voltages of shape (n,); the same numbers as stepping."""
        return self._play(load_voltage_v, servo_voltage_v, state)[0]

    def after(self, load_voltage_v: Array, servo_voltage_v: Array, state: RigState | None = None) -> RigState:
        """The state after voltages of shape (n,) have acted."""
        return self._play(load_voltage_v, servo_voltage_v, state)[1]

    def _play(self, load_voltage_v: Array, servo_voltage_v: Array, state: RigState | None) -> tuple[Run, RigState]:
        now = self.initial_state() if state is None else state
        rows = np.empty((len(load_voltage_v), 4))
        for i, (load, servo) in enumerate(zip(load_voltage_v, servo_voltage_v, strict=True)):
            now, out = self.step(now, RigInput(float(load), float(servo)))
            rows[i] = out.load_voltage_v, out.servo_voltage_v, out.pressure_pa, out.position_m
        names = ("load_voltage_v", "servo_voltage_v", "pressure_pa", "position_m")
        signals = dict(zip(names, rows.T.copy(), strict=True))
        return Run(self.sample_time_s, signals, source=f"rig {self.config.name}"), now

    def truth(self, state: RigState) -> Truth:
        """The physical state behind the sensors."""
        s = state.values
        places = (k.X, k.V, k.CAP, k.ROD, k.LOAD, k.SPOOL, k.FRAME)
        return Truth(*(float(s[place]) for place in places))


def _frozen(values: Array) -> Array:
    values.setflags(write=False)
    return values
