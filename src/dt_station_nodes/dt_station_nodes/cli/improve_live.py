"""The live part of `dt-station improve`: one running station, experiments, discovery, a new model for its twin."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..core.channels import Channel
from ..core.run import Run
from ..core.samples import PlantSample
from ..discovery import DiscoveryResult, DiscoverySettings, Verdict
from ..discovery import discover as search
from ..nodes import convert
from ..nodes.qos import STREAM
from ..nodes.remote import Remote
from ..nodes.scenario import NodeSpec, Scenario
from ..nodes.supervisor import RunError, Supervisor
from ..records import write_csv
from .common import Failure, find_config, load_model
from .discover_job import Task, write

Say = Callable[[str], None]

# Set-points that move both paths through their range, used where discovery proposes nothing of its own.
_RICH = (
    {"shape": "triangle", "amplitude": 1.8e6, "offset": 3.0e6, "frequency_hz": 0.13},
    {"shape": "sine", "amplitude": 1.5e6, "offset": 3.0e6, "frequency_hz": 0.4},
    {"shape": "sawtooth", "amplitude": 1.8e6, "offset": 3.0e6, "frequency_hz": 0.2},
)
_WAIT_S = 60.0


class Listener:
    """Collects samples and residuals from a node that the supervisor spins."""

    def __init__(self, node: Any) -> None:
        from dt_station_msgs.msg import PlantState, Residual

        self.samples: list[PlantSample] = []
        self.residuals: list[convert.ResidualSample] = []
        node.create_subscription(PlantState, "object/state", self._on_state, STREAM, raw=True)
        node.create_subscription(Residual, "shadow/residual", self._on_residual, STREAM, raw=True)

    def _on_state(self, data: bytes) -> None:
        self.samples.append(convert.state_from_bytes(data))

    def _on_residual(self, data: bytes) -> None:
        self.residuals.append(convert.residual_from_bytes(data))

    def forget(self) -> None:
        """Begin anew."""
        self.samples.clear()
        self.residuals.clear()

    def unbroken(self) -> list[PlantSample]:
        """The latest samples without a gap in their numbers."""
        start = 0
        for k in range(1, len(self.samples)):
            if self.samples[k].sequence != self.samples[k - 1].sequence + 1:
                start = k
        return self.samples[start:]


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


def _scenario(name: str, model: str, rig: str, pace: str) -> Scenario:
    given = Scenario.load(name)
    nodes = {key: spec for key, spec in given.nodes.items() if (spec.executable or key) != "recorder"}
    for key, spec in given.nodes.items():
        kind = spec.executable or key
        changes: dict[str, Any] = {}
        if kind == "twin_simulator":
            changes = {"model": str(find_config("models", model).resolve()), "feed": "commands"}
        elif kind == "daq_bridge" and rig:
            changes = {"backend": "virtual", "backend_options": {"rig": str(find_config("rigs", rig).resolve())}}
        if changes:
            nodes[key] = NodeSpec(
                executable=spec.executable, parameters={**spec.parameters, **changes}, required=spec.required
            )
    return given.model_copy(update={"nodes": nodes, "pace": pace, "duration_s": 0.0})


def _collect(graph: Supervisor, listener: Listener, samples: int) -> list[PlantSample]:
    import time

    listener.forget()
    end = time.monotonic() + _WAIT_S + 4.0 * samples * graph.scenario.sample_time_s
    while len(listener.unbroken()) <= samples:
        if graph.step(0.05):
            raise Failure("the station ended before the experiment did")
        if time.monotonic() > end:
            raise Failure(f"only {len(listener.samples)} of {samples} samples came from the station")
    return listener.unbroken()[: samples + 1]


def _settled(result: DiscoveryResult) -> bool:
    if result.verdict is Verdict.NAMED:
        return not any(effect.alternatives for effect in result.effects)
    return result.verdict is not Verdict.UNEXPLAINED


def _play(station: Remote, result: DiscoveryResult, number: int) -> str:
    """Change the load's set-point for the next round; what was played."""
    wanted: dict[str, Any] = dict(_RICH[number % len(_RICH)])
    proposal = result.next_experiment
    if proposal is not None and proposal.channel is Channel.PRESSURE:
        wanted |= {"shape": proposal.shape, "frequency_hz": max(proposal.frequency_hz, 0.05)}
    playing = station.set_waveform("load", wanted)
    return f"{playing['shape']} of {playing['amplitude']:.3g} Pa at {playing['frequency_hz']:.3g} Hz"


def _live(graph: Supervisor, listener: Listener, samples: int) -> dict[Channel, float]:
    """RMS of the running twin's gap over as many samples."""
    listener.forget()
    while len(listener.residuals) < samples:
        if graph.step(0.05):
            raise Failure("the station ended while its live gap was watched")
    latest = listener.residuals[-samples:]
    gaps = {Channel.PRESSURE: [r.pressure[0] for r in latest], Channel.POSITION: [r.position[0] for r in latest]}
    return {channel: float(np.sqrt(np.mean(np.square(values)))) for channel, values in gaps.items()}


def improve_live(
    scenario: str, model: str, rig: str, budget: int, seconds: float, pace: str, jobs: int, folder: Path, say: Say
) -> dict[str, Any]:
    """Run it all; the outcome as plain values. Raises Failure and StationError."""
    spec, text = load_model(model)
    station = _scenario(scenario, model, rig, pace)
    step = station.sample_time_s
    samples = round(seconds / step)
    rounds: list[dict[str, Any]] = []
    earlier: Run | None = None
    try:
        with Supervisor(station) as graph, Remote() as remote:
            listener = Listener(graph.watch.node)
            for number in range(budget):
                run = as_run(_collect(graph, listener, samples), step, f"{scenario} round {number + 1}")
                path = folder / f"run-{number + 1}.csv"
                write_csv(run, path)
                result = search(run, spec, earlier, DiscoverySettings(max_effects=2, jobs=jobs))
                rounds.append({"round": number + 1, "run": path, **result.to_json(), "sentence": result.sentence})
                say(f"round {number + 1}: {result.sentence}")
                if _settled(result) or number + 1 == budget:
                    break
                earlier = run
                say(f"next: {_play(remote, result, number)}")
            before = _live(graph, listener, samples // 2)
            remote.set_parameters("twin_simulator", {"model_yaml": result.model.to_yaml()})
            _live(graph, listener, samples // 4)
            after = _live(graph, listener, samples // 2)
    except RunError as error:
        raise Failure(str(error)) from None
    task = Task(path, None, model, text, rounds[-2]["run"] if len(rounds) > 1 else None, None, 0.0, jobs)
    write(task, replace(result, run=replace(result.run, source=str(path))), folder)
    live = {c.value: {"before": before[c], "after": after[c], "unit": c.unit} for c in Channel}
    files = {"report": folder / "report.html", "model": folder / "model.yaml", "answer": folder / "discovery.json"}
    return {"rounds": rounds, "live": live, "verdict": result.verdict.value, "files": files}
