"""An experiment in the graph: bridge and recorder as processes, the plan as the controller of both valves."""

from pathlib import Path
from typing import Any

import numpy as np

from ..core.channels import Channel
from ..core.run import Run
from ..core.samples import ControlMode, PlantSample, SampleFlag, ValveCommand
from ..identification.experiments import DriverState, ExperimentDriver, ExperimentPlan
from ..nodes import convert
from ..nodes.backends import backend_from
from ..nodes.qos import STREAM
from ..nodes.scenario import NodeSpec, Scenario
from ..nodes.supervisor import RunError, Supervisor
from .common import Failure, progress

READERS = 2
TOPICS = {Channel.PRESSURE: "load/command", Channel.POSITION: "position/command"}


def check(backend: str, options: str, sample_time_s: float) -> None:
    """Raise StationError for a backend that cannot be had, before anything is written."""
    backend_from(backend, options, sample_time_s)


class Pilot:
    """Answers every sample of the bridge with the plan's voltages, from a node that somebody else spins."""

    def __init__(self, node: Any, driver: ExperimentDriver) -> None:
        from dt_station_msgs.msg import PlantState
        from dt_station_msgs.msg import ValveCommand as Message

        self.driver = driver
        self.state: DriverState = driver.initial_state()
        self.complaint: Exception | None = None
        self.samples: list[PlantSample] = []
        self.setpoints: list[dict[Channel, float]] = []
        self._node = node
        self._state_type = PlantState
        self._publishers = {c: node.create_publisher(Message, topic, STREAM) for c, topic in TOPICS.items()}
        self._listening = False

    def prepare(self) -> None:
        """Listen to the bridge once bridge and recorder hear our commands: it starts when it has its readers."""
        if not self._listening and all(p.get_subscription_count() >= READERS for p in self._publishers.values()):
            self._listening = True
            self._node.create_subscription(self._state_type, "object/state", self._on_state, STREAM, raw=True)

    def _on_state(self, data: bytes) -> None:
        sample = convert.state_from_bytes(data)
        self.samples.append(sample)
        if sample.flags & SampleFlag.END:
            return
        setpoints, voltages = dict.fromkeys(Channel, 0.0), dict.fromkeys(Channel, 0.0)
        if self.complaint is None:
            try:
                self.state, output = self.driver.step(self.state, sample.pressure_pa, sample.position_m)
                setpoints, voltages = dict(output.setpoint), dict(output.voltage_v)
            except Exception as error:
                # told by the supervising loop; until then the valves rest at 0 V
                self.complaint = error
        self.setpoints.append(setpoints)
        for channel, publisher in self._publishers.items():
            publisher.publish(convert.command_to_bytes(self._command(sample, voltages[channel], setpoints[channel])))

    def run(self, source: str) -> Run:
        """What was measured, as a table: a row's voltages are those that the next sample says were applied until it."""
        rows, following = self.samples[:-1], self.samples[1:]
        columns: dict[str, list[float]] = {
            Channel.PRESSURE.setpoint_signal: [s[Channel.PRESSURE] for s in self.setpoints[: len(rows)]],
            Channel.POSITION.setpoint_signal: [s[Channel.POSITION] for s in self.setpoints[: len(rows)]],
            Channel.PRESSURE.voltage_signal: [s.load_voltage_v for s in following],
            Channel.POSITION.voltage_signal: [s.servo_voltage_v for s in following],
            Channel.PRESSURE.signal: [s.pressure_pa for s in rows],
            Channel.POSITION.signal: [s.position_m for s in rows],
        }
        plan = self.driver.plan
        for channel, drive in ((Channel.PRESSURE, plan.load), (Channel.POSITION, plan.position)):
            if drive.gain_v_per_unit == 0.0:
                del columns[channel.setpoint_signal]
        signals = {name: np.asarray(values) for name, values in columns.items()}
        return Run(self.driver.sample_time_s, signals, source=source)

    @staticmethod
    def _command(sample: PlantSample, voltage_v: float, setpoint: float) -> ValveCommand:
        return ValveCommand(sample.sequence, sample.stamp_ns, voltage_v, setpoint, ControlMode.MANUAL, limited=False)


def run_in_graph(plan: ExperimentPlan, backend: str, options: str, sample_time_s: float, pace: str, bag: Path) -> Run:
    """Run the experiment and return its table. Raises Failure, or the plan's own complaint."""
    scenario = Scenario(
        name=f"experiment {plan.name}",
        sample_time_s=sample_time_s,
        pace="realtime" if pace == "realtime" else "lockstep",
        duration_s=plan.duration_s,
        nodes={
            "recorder": NodeSpec(parameters={"out": str(bag.resolve())}),
            "daq_bridge": NodeSpec(
                parameters={
                    "backend": backend,
                    "backend_options": options,
                    "expect": ["load", "position"],
                    "wait_for_readers": [f"object/state:{READERS}"],
                }
            ),
        },
    )
    driver = ExperimentDriver(plan, sample_time_s)
    try:
        with Supervisor(scenario, restart=False) as graph, progress(plan.name, driver.samples) as advance:
            pilot = Pilot(graph.watch.node, driver)
            done = 0
            ended = False
            while not ended and pilot.complaint is None:
                pilot.prepare()
                ended = graph.step()
                advance(pilot.state.sequence - done)
                done = pilot.state.sequence
            if pilot.complaint is not None:
                graph.watch.spin(2.0 * sample_time_s)
            graph.stop()
    except RunError as error:
        raise Failure(str(error)) from None
    if pilot.complaint is not None:
        raise pilot.complaint
    gaps = [a.sequence for a, b in zip(pilot.samples, pilot.samples[1:], strict=False) if b.sequence != a.sequence + 1]
    if gaps or len(pilot.samples) < 2:
        what = f"sample {gaps[0] + 1} was lost" if gaps else "no sample came"
        raise Failure(f"experiment {plan.name}: {what} on the way from the bridge; the bag is in {bag}")
    return pilot.run(str(bag))
