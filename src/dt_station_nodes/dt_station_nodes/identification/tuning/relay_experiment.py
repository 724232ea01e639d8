"""The relay at work on one channel while a controller holds the other; in this process or in the graph."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from ...core.channels import Channel
from ...core.closed_loop import Plant
from ...core.control import ControlInput, LoopController, LoopState
from .relay import RelayOutcome, RelayState, RelayTuner


@dataclass(frozen=True, slots=True)
class RelayExperimentState:
    """The relay, the loop beside it, and the samples so far."""

    relay: RelayState
    other: LoopState
    sequence: int = 0


@dataclass(frozen=True, slots=True)
class RelayOutput:
    """Set-point (Pa or m) and voltage (V) of each channel for one sample."""

    setpoint: Mapping[Channel, float]
    voltage_v: Mapping[Channel, float]


class RelayExperiment:
    """step(state, measurements) -> state, voltages; `other` holds the other channel at `other_setpoint` (Pa or m)."""

    __slots__ = ("_channel", "_other", "_other_setpoint", "_setpoint", "tuner")

    def __init__(
        self, channel: Channel, tuner: RelayTuner, setpoint: float, other: LoopController, other_setpoint: float
    ) -> None:
        self._channel = channel
        self.tuner = tuner
        self._setpoint = setpoint
        self._other = other
        self._other_setpoint = other_setpoint

    def initial_state(self) -> RelayExperimentState:
        """Before the first sample."""
        return RelayExperimentState(self.tuner.initial_state(), self._other.initial_state())

    def finished(self, state: RelayExperimentState) -> bool:
        """Whether the relay has come to an end, good or bad."""
        return state.relay.outcome is not RelayOutcome.RUNNING

    def step(
        self, state: RelayExperimentState, pressure_pa: float, position_m: float
    ) -> tuple[RelayExperimentState, RelayOutput]:
        """Voltages for this sample; once finished, the relay's bias."""
        on_pressure = self._channel is Channel.PRESSURE
        own, across = (pressure_pa, position_m) if on_pressure else (position_m, pressure_pa)
        relay, voltage = self.tuner.step(state.relay, own)
        other, answer = self._other.step(state.other, ControlInput(self._other_setpoint, across, pressure_pa))
        beside = Channel.POSITION if on_pressure else Channel.PRESSURE
        return RelayExperimentState(relay, other, state.sequence + 1), RelayOutput(
            {self._channel: self._setpoint, beside: self._other_setpoint},
            {self._channel: voltage, beside: answer.voltage_v},
        )


def run_relay(
    plant: Plant, experiment: RelayExperiment, advance: Callable[[], None] = lambda: None
) -> RelayExperimentState:
    """Run the relay on an object in this process until it ends (its own time-out sees to that)."""
    state = experiment.initial_state()
    while not experiment.finished(state):
        seen = plant.read()
        state, output = experiment.step(state, seen.pressure_pa, seen.position_m)
        plant.write(output.voltage_v[Channel.PRESSURE], output.voltage_v[Channel.POSITION])
        advance()
    return state
