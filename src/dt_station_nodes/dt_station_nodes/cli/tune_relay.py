"""Where `dt-station tune --method relay` runs its relay: on the model, on the virtual rig, or in the live graph."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from ..core.channels import Channel
from ..core.closed_loop import ModelPlant
from ..core.control import LoopConfig, LoopController
from ..core.models import ModelSpec, PlantModel
from ..identification.tuning import (
    RelayConfig,
    RelayExperiment,
    RelayExperimentState,
    RelayTuner,
    UltimatePoint,
    run_relay,
    usual_relay,
)
from .common import Failure, UserError, progress

if TYPE_CHECKING:
    from ..nodes.scenario import Scenario

READERS = 1
OTHER_SETPOINT = {Channel.PRESSURE: 0.0, Channel.POSITION: 2.5e6}
TOPICS = {Channel.PRESSURE: "load/command", Channel.POSITION: "position/command"}


@dataclass(frozen=True, slots=True)
class Wish:
    """What the user asked of the relay; None leaves the usual."""

    on: str
    rig: str
    backend: str
    backend_options: str
    pace: str
    amplitude_v: float | None
    bias_v: float | None
    lowest: float | None
    highest: float | None


def relay_point(
    model: ModelSpec, channel: Channel, other: LoopConfig, sample_time_s: float, error_scale: float, wish: Wish
) -> UltimatePoint:
    """The ultimate point a relay finds. Raises Failure where it left its limits or never settled."""
    config = _config(model, channel, wish)
    experiment = RelayExperiment(
        channel,
        RelayTuner(config, sample_time_s),
        config.setpoint,
        LoopController(other, sample_time_s),
        OTHER_SETPOINT[channel],
    )
    samples = round(config.timeout_s / sample_time_s)
    if wish.on == "model":
        state = run_relay(ModelPlant(PlantModel(model, sample_time_s)), experiment)
    elif wish.on == "rig":
        state = _on_rig(experiment, wish, sample_time_s, samples)
    else:
        state = _in_graph(experiment, wish, sample_time_s, samples)
    try:
        return experiment.tuner.result(state.relay, error_scale)
    except ValueError as error:
        raise Failure(str(error)) from None


def _config(model: ModelSpec, channel: Channel, wish: Wish) -> RelayConfig:
    given = {
        "amplitude_v": wish.amplitude_v,
        "bias_v": wish.bias_v,
        "lowest": wish.lowest,
        "highest": wish.highest,
    }
    changes = {key: value for key, value in given.items() if value is not None}
    try:
        return RelayConfig.model_validate({**usual_relay(model, channel).model_dump(), **changes})
    except ValidationError as error:
        raise UserError(f"the relay cannot run so: {error.errors()[0]['msg'].removeprefix('Value error, ')}.") from None


def _options(wish: Wish) -> str:
    return wish.backend_options or (f"{{rig: {wish.rig}}}" if wish.backend == "virtual" else "{}")


def _on_rig(experiment: RelayExperiment, wish: Wish, sample_time_s: float, samples: int) -> RelayExperimentState:
    from ..nodes.backends import backend_from

    device = backend_from("virtual", f"{{rig: {wish.rig}}}", sample_time_s)
    device.open()
    try:
        with progress("Relay on the virtual rig", samples) as advance:
            return run_relay(device, experiment, advance)
    finally:
        device.close()


class _Pilot:
    """Answers every sample of the bridge, from a node that somebody else spins."""

    def __init__(self, node: Any, experiment: RelayExperiment) -> None:
        from dt_station_msgs.msg import PlantState, ValveCommand

        from ..nodes.qos import STREAM

        self.experiment = experiment
        self.state = experiment.initial_state()
        self._node, self._state_type, self._qos = node, PlantState, STREAM
        self._publishers = {c: node.create_publisher(ValveCommand, topic, STREAM) for c, topic in TOPICS.items()}
        self._listening = False

    def prepare(self) -> None:
        """Listen to the bridge once it hears our commands: it starts when it has its reader."""
        if not self._listening and all(p.get_subscription_count() >= 1 for p in self._publishers.values()):
            self._listening = True
            self._node.create_subscription(self._state_type, "object/state", self._on_state, self._qos, raw=True)

    def _on_state(self, data: bytes) -> None:
        from ..core.samples import ControlMode, ValveCommand
        from ..nodes import convert

        sample = convert.state_from_bytes(data)
        self.state, output = self.experiment.step(self.state, sample.pressure_pa, sample.position_m)
        for channel, publisher in self._publishers.items():
            voltage, setpoint = output.voltage_v[channel], output.setpoint[channel]
            command = ValveCommand(sample.sequence, sample.stamp_ns, voltage, setpoint, ControlMode.MANUAL, False)
            publisher.publish(convert.command_to_bytes(command))


def _scenario(wish: Wish, sample_time_s: float, samples: int) -> "Scenario":
    from ..nodes.scenario import NodeSpec, Scenario

    bridge = {
        "backend": wish.backend,
        "backend_options": _options(wish),
        "expect": ["load", "position"],
        "wait_for_readers": [f"object/state:{READERS}"],
    }
    return Scenario(
        name="relay",
        sample_time_s=sample_time_s,
        pace="realtime" if wish.pace == "realtime" else "lockstep",
        duration_s=(samples + 1) * sample_time_s,
        nodes={"daq_bridge": NodeSpec(parameters=bridge)},
    )


def _in_graph(experiment: RelayExperiment, wish: Wish, sample_time_s: float, samples: int) -> RelayExperimentState:
    from ..nodes.backends import backend_from
    from ..nodes.supervisor import RunError, Supervisor

    if wish.pace not in ("lockstep", "realtime"):
        raise UserError(f"--pace {wish.pace}: choose lockstep or realtime.")
    backend_from(wish.backend, _options(wish), sample_time_s)
    try:
        with (
            Supervisor(_scenario(wish, sample_time_s, samples), restart=False) as graph,
            progress("Relay on the station", samples) as advance,
        ):
            pilot = _Pilot(graph.watch.node, experiment)
            done, ended = 0, False
            while not ended and not experiment.finished(pilot.state):
                pilot.prepare()
                ended = graph.step()
                advance(pilot.state.sequence - done)
                done = pilot.state.sequence
            # The bias must reach the valve before everything stops.
            graph.watch.spin(2.0 * sample_time_s)
            graph.stop()
    except RunError as error:
        raise Failure(str(error)) from None
    return pilot.state
