"""The demo's figures: what the paper prints, and ours from the bags."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..core.channels import Channel
from ..core.comparison import score
from ..core.run import Array, Run
from ..identification.tuning import StepFigures, error_index, step_figures
from ..nodes.statistics import RunStatistics

# the index (8) is over 4 s to 20 s, four whole load cycles; errors in mm.
# The paper prints no unit; on a rig near its models only mm^2 gives figures of its size.
INDEX_FROM_S, INDEX_TO_S = 4.0, 20.0
PAPER_INDEX = {"pid": 1.3031, "fuzzy": 1.8612}
_MM = 1000.0


@dataclass(frozen=True, slots=True)
class DemoRun:
    """One run of the demo: the object's table, the twin's, and the graph's figures."""

    title: str
    run: Run
    twin: Run
    statistics: RunStatistics

    @classmethod
    def from_bag(cls, bag: Path, title: str, statistics: RunStatistics) -> "DemoRun":
        """Read a run's bag. Raises RecordError."""
        from ..records import load_run, run_from_bag

        return cls(title, load_run(bag), run_from_bag(bag, "twin/state"), statistics)


def table(runs: Mapping[str, DemoRun]) -> list[dict[str, Any]]:
    """Rows of what, paper, ours and unit."""
    rows = []
    ours = {name: index(runs[name].run) for name in PAPER_INDEX}
    for name, paper in PAPER_INDEX.items():
        rows.append(_row(f"position error index (8), {name}", paper, ours[name], "mm^2"))
    rows.append(
        _row("index ratio, fuzzy to pid", PAPER_INDEX["fuzzy"] / PAPER_INDEX["pid"], ours["fuzzy"] / ours["pid"], "1")
    )
    for name, label, settling, overshoot in (
        ("pid", "optimised PI", 0.5, "none"),
        ("ziegler_nichols", "Ziegler-Nichols PI", 1.0, "slight"),
    ):
        figures = pressure_steps(runs[name].run)
        rows.append(_row(f"pressure settling (2 %), {label}", settling, figures.settling_s, "s"))
        rows.append(_row(f"pressure overshoot, {label}", overshoot, figures.overshoot_percent, "%"))
    for name in PAPER_INDEX:
        for channel, unit in ((Channel.PRESSURE, "Pa"), (Channel.POSITION, "m")):
            found = gap(runs[name], channel)
            rows.append(_row(f"shadow {channel.value} ISE, {name}", None, found[0], f"{unit}^2 s"))
            rows.append(_row(f"shadow {channel.value} fit, {name}", None, found[1], "%"))
    for name in PAPER_INDEX:
        bridge = runs[name].statistics.bridge
        rows.append(_row(f"missed samples, {name}", None, bridge["missed_samples"], "1"))
        rows.append(_row(f"measurement to command p99, {name}", None, bridge["latency_p99_s"] * 1e3, "ms"))
    return rows


def index(run: Run) -> float:
    """The paper's position error index (8) of a run, mm^2."""
    rows = slice(round(INDEX_FROM_S / run.sample_time_s), round(INDEX_TO_S / run.sample_time_s))
    return error_index(_MM * run.signals["position_setpoint_m"][rows], _MM * run.signals["position_m"][rows])


def pressure_steps(run: Run) -> StepFigures:
    """Figures of the mean response to the load's edges, each scaled to a step from 0 to 1."""
    setpoint, pressure = run.signals["pressure_setpoint_pa"], run.signals["pressure_pa"]
    edges = np.flatnonzero(np.diff(setpoint)) + 1
    length = int(np.min(np.diff(edges)))
    scaled: list[Array] = []
    for edge in edges:
        if edge + length <= len(setpoint):
            low, high = setpoint[edge - 1], setpoint[edge]
            scaled.append((pressure[edge : edge + length] - low) / (high - low))
    mean = np.mean(scaled, axis=0)
    return step_figures(0.0, 1.0, mean, np.zeros(length), run.sample_time_s)


def gap(run: DemoRun, channel: Channel) -> tuple[float, float]:
    """ISE (unit^2 s) and fit (percent) of the twin on one channel."""
    found = score(run.run.signals[channel.signal], run.twin.signals[channel.signal], run.run.sample_time_s)
    return found.ise, found.fit_percent


def _row(what: str, paper: Any, ours: Any, unit: str) -> dict[str, Any]:
    return {"what": what, "paper": paper, "ours": ours, "unit": unit}
