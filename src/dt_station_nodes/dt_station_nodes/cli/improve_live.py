"""The rounds of `dt-station improve`: experiment, discovery, the next experiment, a new model for the running twin."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from ..core.channels import Channel
from ..core.models import ModelSpec, PathSpec
from ..core.run import Run
from ..discovery import DiscoveryResult, DiscoverySettings, NextExperiment, Verdict
from ..discovery import discover as search
from ..nodes.supervisor import RunError
from ..records import write_csv
from .common import Failure, load_model
from .discover_job import Task, write
from .improve_station import LOOP, RunningStation, shadowed

Say = Callable[[str], None]

# Set-points that move both paths through their range, used where discovery proposes nothing of its own.
_RICH = (
    {"shape": "triangle", "amplitude": 1.8e6, "offset": 3.0e6, "frequency_hz": 0.13},
    {"shape": "sine", "amplitude": 1.5e6, "offset": 3.0e6, "frequency_hz": 0.4},
    {"shape": "sawtooth", "amplitude": 1.8e6, "offset": 3.0e6, "frequency_hz": 0.2},
)
# A name surer than this needs no further experiment.
_SURE = 0.6
# What an experiment may ask of the station.
_SLOWEST_HZ = 0.05
_STROKE_M = 0.05
_PRESSURES_PA = (1.2e6, 5.0e6)


class Station(Protocol):
    """What experiments need of a station; see RunningStation."""

    def experiment(self, samples: int) -> Run:
        """As many samples in a row, none of them from before the last change."""

    def play(self, channel: Channel, changes: Mapping[str, Any]) -> dict[str, Any]:
        """Change a channel's set-point; what plays then."""

    def take_model(self, text: str) -> None:
        """Give the running twin another model."""

    def gap(self, samples: int, skipped: int = 0) -> dict[Channel, float]:
        """RMS of the running twin's gap since the last change, in the channel's unit."""


def settled(result: DiscoveryResult, confirmed: bool) -> bool:
    """Whether no further experiment is needed: a name has to stand on another waveform too.

    Names that no proposed experiment would tell apart stay as they are, and so do parameters that no effect could
    stand for.
    """
    if result.verdict is Verdict.NAMED:
        open_ones = [e for e in result.effects if e.alternatives or e.confidence < _SURE]
        alike = result.next_experiment is None and all(e.alternatives for e in open_ones)
        return confirmed and (alike or not open_ones)
    if result.verdict is Verdict.PARAMETERS_ONLY:
        return result.next_experiment is None
    return result.verdict is Verdict.NOTHING_MISSING


def play_next(station: Station, result: DiscoveryResult, number: int) -> str:
    """Change a set-point for the next round: to what the proposal's voltage would do, else to what moves much."""
    proposal = result.next_experiment
    channel, wanted = Channel.PRESSURE, dict(_RICH[number % len(_RICH)])
    if proposal is not None:
        channel = proposal.channel
        wanted = as_setpoint(proposal, result.model.paths[channel])
    playing = station.play(channel, wanted)
    return (
        f"{LOOP[channel]} set-point {playing['shape']} of {playing['amplitude']:.3g} {channel.unit} about "
        f"{playing['offset']:.3g} {channel.unit} at {playing['frequency_hz']:.3g} Hz"
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


def experiments(
    station: Station, spec: ModelSpec, budget: int, samples: int, jobs: int, folder: Path, say: Say
) -> tuple[list[DiscoveryResult], list[Path]]:
    """Experiment and discover until settled or `budget` experiments are spent; each answer and its run's table.

    A run is validated on the one before it.
    """
    results: list[DiscoveryResult] = []
    tables: list[Path] = []
    earlier: Run | None = None
    for number in range(budget):
        run = station.experiment(samples)
        table = folder / f"run-{number + 1}.csv"
        write_csv(run, table)
        result = search(run, spec, earlier, DiscoverySettings(max_effects=2, jobs=jobs))
        results.append(replace(result, run=replace(result.run, source=str(table))))
        tables.append(table)
        say(f"round {number + 1}: {result.sentence}")
        if settled(result, earlier is not None) or number + 1 == budget:
            break
        earlier = run
        say(f"next: {play_next(station, result, number)}")
    return results, tables


def improve_live(
    scenario: str, model: str, rig: str, budget: int, seconds: float, pace: str, jobs: int, folder: Path, say: Say
) -> dict[str, Any]:
    """Run it all; the outcome as plain values. Raises Failure and StationError."""
    spec, text = load_model(model)
    wanted = shadowed(scenario, model, rig, pace)
    samples = round(seconds / wanted.sample_time_s)
    try:
        with RunningStation(wanted) as station:
            results, tables = experiments(station, spec, budget, samples, jobs, folder, say)
            before = station.gap(samples // 2)
            station.take_model(results[-1].model.to_yaml())
            after = station.gap(samples // 2, skipped=samples // 4)
    except RunError as error:
        raise Failure(str(error)) from None
    validation = tables[-2] if len(tables) > 1 else None
    write(Task(tables[-1], None, model, text, validation, None, 0.0), results[-1], folder)
    rounds = [
        {**result.to_json(), "round": number, "table": table, "sentence": result.sentence}
        for number, (result, table) in enumerate(zip(results, tables, strict=True), start=1)
    ]
    live = {c.value: {"before": before[c], "after": after[c], "unit": c.unit} for c in Channel}
    files = {"report": folder / "report.html", "model": folder / "model.yaml", "answer": folder / "discovery.json"}
    return {"rounds": rounds, "live": live, "verdict": results[-1].verdict.value, "files": files}
