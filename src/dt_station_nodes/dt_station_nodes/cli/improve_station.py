"""The running station of `dt-station improve`: experiments on it, set-points and models changed as it runs."""

import hashlib
import time
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np

from ..core.channels import Channel
from ..core.run import Run
from ..core.samples import PlantSample
from ..nodes import convert
from ..nodes.qos import LATCHED, STREAM
from ..nodes.remote import Remote
from ..nodes.scenario import NodeSpec, Scenario
from ..nodes.supervisor import Supervisor
from .common import Failure, find_config

_WAIT_S = 60.0
# Samples more than a gap needs: the twin's first ones may lack a residual.
_SPARE = 50
LOOP = {Channel.PRESSURE: "load", Channel.POSITION: "position"}


class Listener:
    """Samples from a number on, residuals from a time on, and since when the twin simulates which model."""

    def __init__(self) -> None:
        self.samples: list[PlantSample] = []
        self.residuals: list[convert.ResidualSample] = []
        self.models: dict[str, int] = {}
        self._first, self._after_ns = 0, -1
        self._subscriptions: list[Any] = []

    def subscribe(self, node: Any) -> None:
        """Listen through a node that someone else spins."""
        from dt_station_msgs.msg import PlantState, Residual, TwinModel

        self._subscriptions = [
            node.create_subscription(PlantState, "object/state", self.on_state, STREAM, raw=True),
            node.create_subscription(Residual, "shadow/residual", self.on_residual, STREAM, raw=True),
            node.create_subscription(TwinModel, "twin/model", self._on_model, LATCHED),
        ]

    def connected(self) -> bool:
        """Whether everything that is listened to is written by somebody."""
        return all(each.get_publisher_count() for each in self._subscriptions)

    def on_state(self, data: bytes) -> None:
        """Keep a sample; a missing one ends what was kept before it."""
        if convert.sequence_of(data) < self._first:
            return
        sample = convert.state_from_bytes(data)
        if self.samples and sample.sequence != self.samples[-1].sequence + 1:
            self.samples.clear()
        self.samples.append(sample)

    def on_residual(self, data: bytes) -> None:
        """Keep a residual."""
        residual = convert.residual_from_bytes(data)
        if residual.stamp_ns > self._after_ns:
            self.residuals.append(residual)

    def _on_model(self, message: Any) -> None:
        stamp = message.header.stamp
        self.models[message.sha256] = 1_000_000_000 * stamp.sec + stamp.nanosec

    def samples_from(self, sequence: int) -> None:
        """Forget all samples, and take none before this number: what piled up meanwhile is older."""
        self._first = sequence
        self.samples.clear()

    def residuals_after(self, stamp_ns: int) -> None:
        """Forget all residuals, and take none until after this time."""
        self._after_ns = stamp_ns
        self.residuals.clear()


class RunningStation:
    """`with RunningStation(scenario) as station: station.experiment(1200)`. All methods raise Failure, RunError."""

    def __init__(self, scenario: Scenario) -> None:
        self._graph, self._open = Supervisor(scenario), ExitStack()
        self._sample_time_s, self._name = scenario.sample_time_s, scenario.name
        # A station without a clock would run on, and take the machine from the discovery that it waits for.
        self._waits = scenario.pace == "lockstep"
        self._listener = Listener()
        self._next = self._held_from = 0

    def __enter__(self) -> "RunningStation":
        with ExitStack() as opened:
            opened.enter_context(self._graph)
            # after the graph: its processes are forks, which must not find DDS running here
            self._remote = opened.enter_context(Remote())
            self._listener.subscribe(self._graph.watch.node)
            # the first experiment begins with sample 0, which nobody says twice
            self._listen(self._listener.connected, self._listener.models)
            self._open = opened.pop_all()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._open.__exit__(kind, error, trace)

    def experiment(self, samples: int) -> Run:
        """As many samples in a row, none of them from before the last change."""
        heard = self._listener.samples

        def complete() -> bool:
            # the row after the last says which voltage was applied; a sample lost on the way starts the row anew
            self._advance((heard[0].sequence if heard else self._next) + samples + 1)
            return len(heard) > samples

        self._listen(complete, heard)
        run = as_run(heard[: samples + 1], self._sample_time_s, self._name)
        self._listener.residuals_after(heard[samples].stamp_ns)
        self._begin(heard[samples].sequence + 1)
        return run

    def play(self, channel: Channel, changes: Mapping[str, Any]) -> dict[str, Any]:
        """Change a channel's set-point; what plays then."""
        played, since = self._remote.play(LOOP[channel], changes)
        self._begin(since)
        return played

    def take_model(self, text: str) -> None:
        """Give the running twin another model; residuals are those of this model from then on."""
        self._remote.set_parameters("twin_simulator", {"model_yaml": text})
        digest = hashlib.sha256(text.encode()).hexdigest()
        self._listen(lambda: digest in self._listener.models, self._listener.models)
        self._listener.residuals_after(self._listener.models[digest])

    def gap(self, samples: int, skipped: int = 0) -> dict[Channel, float]:
        """RMS of the running twin's gap over as many samples since the last change, the first ones skipped."""
        heard = self._listener.residuals
        self._advance(self._held_from + skipped + samples + _SPARE)
        self._listen(lambda: len(heard) >= skipped + samples, heard)
        latest = heard[skipped : skipped + samples]
        gaps = {Channel.PRESSURE: [r.pressure[0] for r in latest], Channel.POSITION: [r.position[0] for r in latest]}
        return {channel: float(np.sqrt(np.mean(np.square(values)))) for channel, values in gaps.items()}

    def _begin(self, sequence: int) -> None:
        self._next = sequence
        self._listener.samples_from(sequence)

    def _advance(self, held_from: int) -> None:
        """Let lockstep take samples up to this number: where it stops must not depend on how busy the machine is."""
        bridge = self._graph.bridge
        if self._waits and bridge is not None and held_from > self._held_from:
            self._remote.set_parameters(bridge, {"held_from": held_from})
            self._held_from = held_from

    def _listen(self, done: Callable[[], bool], heard: Any) -> None:
        had, end = len(heard), time.monotonic() + _WAIT_S
        while not done():
            if self._graph.step(0.05):
                raise Failure("the station ended before the experiment did")
            if len(heard) != had:
                had, end = len(heard), time.monotonic() + _WAIT_S
            if time.monotonic() > end:
                raise Failure(f"nothing came from the station for {_WAIT_S:g} s")


def as_run(samples: list[PlantSample], sample_time_s: float, source: str) -> Run:
    """The run table; a row's voltages are those that the next sample says were applied until it."""
    rows, following = samples[:-1], samples[1:]
    signals = {
        "load_voltage_v": [s.load_voltage_v for s in following],
        "servo_voltage_v": [s.servo_voltage_v for s in following],
        "pressure_pa": [s.pressure_pa for s in rows],
        "position_m": [s.position_m for s in rows],
    }
    return Run(sample_time_s, {name: np.asarray(values) for name, values in signals.items()}, source=source)


def shadowed(name: str, model: str, rig: str, pace: str) -> Scenario:
    """A scenario, without its recorder and without end, whose twin is fed the voltages applied."""
    given = Scenario.load(name)
    nodes = {key: spec for key, spec in given.nodes.items() if (spec.executable or key) != "recorder"}
    for key, spec in given.nodes.items():
        kind = spec.executable or key
        changes: dict[str, Any] = {}
        if kind == "twin_simulator":
            changes = {"model": str(_path("models", model)), "feed": "commands"}
        elif kind == "daq_bridge" and rig:
            changes = {"backend": "virtual", "backend_options": {"rig": str(_path("rigs", rig))}}
        if kind == "daq_bridge" and pace == "lockstep":
            changes["held_from"] = 0
        if changes:
            nodes[key] = NodeSpec(
                executable=spec.executable, parameters={**spec.parameters, **changes}, required=spec.required
            )
    return given.model_copy(update={"nodes": nodes, "pace": pace, "duration_s": 0.0})


def _path(kind: str, name: str) -> Path:
    return find_config(kind, name).resolve()
