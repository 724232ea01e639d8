"""The live part of `dt-station improve`: one running station, experiments, discovery, a new model for its twin."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..core.channels import Channel
from ..core.models import PathSpec
from ..core.run import Run
from ..core.samples import PlantSample
from ..discovery import DiscoveryResult, DiscoverySettings, NextExperiment, Verdict
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
# Long enough to hear a queue out that filled up while nobody listened.
_CATCH_UP_S = 2.0
# A name surer than this needs no further experiment.
_SURE = 0.6
# What an experiment may ask of the station.
_SLOWEST_HZ = 0.05
_STROKE_M = 0.05
_PRESSURES_PA = (1.2e6, 5.0e6)
_LOOP = {Channel.PRESSURE: "load", Channel.POSITION: "position"}


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

    def clear(self) -> None:
        """Forget what was heard."""
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


def _catch_up(graph: Supervisor, listener: Listener) -> None:
    """Hear what has piled up while nobody listened: what comes after it was made after the last change."""
    import time

    end = time.monotonic() + _CATCH_UP_S
    while time.monotonic() < end:
        if graph.step(0.05):
            raise Failure("the station ended before the experiment did")
    listener.clear()


def _collect(graph: Supervisor, listener: Listener, samples: int) -> list[PlantSample]:
    import time

    _catch_up(graph, listener)
    end = time.monotonic() + _WAIT_S + 4.0 * samples * graph.scenario.sample_time_s
    while len(listener.unbroken()) <= samples:
        if graph.step(0.05):
            raise Failure("the station ended before the experiment did")
        if time.monotonic() > end:
            raise Failure(f"only {len(listener.samples)} of {samples} samples came from the station")
    return listener.unbroken()[: samples + 1]


def _settled(result: DiscoveryResult) -> bool:
    if result.verdict is Verdict.NAMED:
        return not any(effect.alternatives or effect.confidence < _SURE for effect in result.effects)
    return result.verdict is not Verdict.UNEXPLAINED


def _play(station: Remote, result: DiscoveryResult, number: int) -> str:
    """Change a set-point for the next round: to what the proposal's voltage would do, else to what moves much."""
    proposal = result.next_experiment
    channel, wanted, unit = Channel.PRESSURE, dict(_RICH[number % len(_RICH)]), "Pa"
    if proposal is not None:
        channel, unit = proposal.channel, proposal.channel.unit
        wanted = as_setpoint(proposal, result.model.paths[channel])
    playing = station.set_waveform(_LOOP[channel], wanted)
    return (
        f"{_LOOP[channel]} set-point {playing['shape']} of {playing['amplitude']:.3g} {unit} about "
        f"{playing['offset']:.3g} {unit} at {playing['frequency_hz']:.3g} Hz"
    )


def as_setpoint(proposal: NextExperiment, path: PathSpec) -> dict[str, Any]:
    """The set-point at which a loop's voltage moves about as proposed, within the station's range."""
    rate = max(proposal.frequency_hz, _SLOWEST_HZ)
    played: dict[str, Any] = {"shape": proposal.shape, "frequency_hz": rate}
    if path.denominator[-1] == 0.0:
        speed = abs(path.scale * path.gain * path.numerator[-1] / path.denominator[-2])
        amplitude = min(speed * abs(proposal.amplitude) / (2.0 * np.pi * rate), _STROKE_M)
        return {**played, "amplitude": float(amplitude), "offset": 0.0}
    static = path.scale * path.gain * path.numerator[-1] / path.denominator[-1]
    low, high = sorted(
        float(np.clip(path.rest + static * (proposal.offset + sign * proposal.amplitude), *_PRESSURES_PA))
        for sign in (-1.0, 1.0)
    )
    return {**played, "amplitude": 0.5 * (high - low), "offset": 0.5 * (high + low)}


def _live(graph: Supervisor, listener: Listener, samples: int) -> dict[Channel, float]:
    """RMS of the running twin's gap over as many samples."""
    _catch_up(graph, listener)
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
    runs: list[Path] = []
    earlier: Run | None = None
    try:
        with Supervisor(station) as graph, Remote() as remote:
            listener = Listener(graph.watch.node)
            for number in range(budget):
                run = as_run(_collect(graph, listener, samples), step, f"{scenario} round {number + 1}")
                path = folder / f"run-{number + 1}.csv"
                write_csv(run, path)
                result = search(run, spec, earlier, DiscoverySettings(max_effects=2, jobs=jobs))
                runs.append(path)
                rounds.append({**result.to_json(), "round": number + 1, "table": path, "sentence": result.sentence})
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
    task = Task(path, None, model, text, runs[-2] if len(runs) > 1 else None, None, 0.0, jobs)
    write(task, replace(result, run=replace(result.run, source=str(path))), folder)
    live = {c.value: {"before": before[c], "after": after[c], "unit": c.unit} for c in Channel}
    files = {"report": folder / "report.html", "model": folder / "model.yaml", "answer": folder / "discovery.json"}
    return {"rounds": rounds, "live": live, "verdict": result.verdict.value, "files": files}
