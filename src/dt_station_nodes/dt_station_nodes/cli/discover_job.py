"""The work behind `dt-station discover`: reads, discovers, writes; one run or many."""

import csv
import hashlib
import json
import platform
import shlex
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ..core.errors import StationError
from ..core.models import ModelSpec
from ..core.run import Run
from ..discovery import DiscoveryResult, DiscoverySettings
from ..discovery import discover as search
from ..workers import ALONE, Workers
from .common import console, jsonable, version

__all__ = ["Task", "load_input", "table", "work_all", "work_one", "write"]


@dataclass(frozen=True, slots=True)
class Task:
    """One run to discover in; paths and text only, so that it travels to a worker."""

    run: Path
    data_map: Path | None
    model: str
    model_text: str
    validate: Path | None
    validate_map: Path | None
    window_s: float

    @property
    def settings(self) -> DiscoverySettings:
        """The search's settings."""
        return DiscoverySettings(window_s=self.window_s)


Loaded = tuple[Run, Run | None, ModelSpec]


def load_input(task: Task) -> Loaded:
    """Run, validation run and model. Raises StationError in one sentence."""
    from ..records import load_run

    run = load_run(task.run, task.data_map)
    checked = load_run(task.validate, task.validate_map) if task.validate is not None else None
    return run, checked, ModelSpec.from_yaml(task.model_text, task.model)


def work_one(
    task: Task,
    loaded: Loaded,
    folder: Path,
    say: Callable[[str | None], None] | None = None,
    workers: Workers = ALONE,
) -> DiscoveryResult:
    """Discover in one run and write its three files."""
    run, checked, spec = loaded
    try:
        result = search(run, spec, checked, task.settings, say, workers=workers)
    finally:
        if say is not None:
            say(None)
    facts = replace(result.run, source=str(task.run), version=version())
    result = replace(result, run=facts)
    # After Ctrl-C helpers may still be at what they were given.
    write(task, result, folder, ALONE if result.interrupted else workers)
    return result


def _digest(path: Path) -> str:
    """SHA-256 of a file, or of a folder's files in order of name."""
    digest = hashlib.sha256()
    for file in sorted(path.rglob("*")) if path.is_dir() else [path]:
        if file.is_file():
            digest.update(file.read_bytes())
    return digest.hexdigest()


def _command(task: Task) -> str:
    words = ["dt-station", "discover", str(task.run), "--model", task.model]
    if task.data_map is not None:
        words += ["--map", str(task.data_map)]
    if task.validate is not None:
        words += ["--validate", str(task.validate)]
        if task.validate_map is not None and task.validate_map != task.data_map:
            words += ["--validate-map", str(task.validate_map)]
    if task.window_s > 0.0:
        words += ["--window", f"{task.window_s:g}"]
    return shlex.join(words)


def _facts(task: Task) -> list[tuple[str, str]]:
    import numba
    import numpy
    import scipy

    facts = [
        ("run, SHA-256", _digest(task.run)),
        ("model, SHA-256", hashlib.sha256(task.model_text.encode()).hexdigest()),
        ("dt_station", version()),
        ("python", platform.python_version()),
        ("numpy, scipy, numba", f"{numpy.__version__}, {scipy.__version__}, {numba.__version__}"),
    ]
    if task.validate is not None:
        facts.insert(1, ("validation run, SHA-256", _digest(task.validate)))
    return facts


def write(task: Task, result: DiscoveryResult, folder: Path, workers: Workers = ALONE) -> None:
    """Leave model.yaml, discovery.json and report.html."""
    from ..discovery.report import render

    folder.mkdir(parents=True, exist_ok=True)
    text = result.model.to_yaml()
    (folder / "model.yaml").write_text(text, encoding="utf-8")
    answer = json.dumps(jsonable(result.to_json()), indent=2, allow_nan=False)
    (folder / "discovery.json").write_text(answer + "\n", encoding="utf-8")
    report = render(result, _facts(task), [_command(task)], text, workers)
    (folder / "report.html").write_text(report, encoding="utf-8")


def _row(task: Task, folder: Path) -> dict[str, Any]:
    """Discover in one of many runs; a run that cannot be read gives a row that says so."""
    row: dict[str, Any] = {"run": str(task.run)}
    try:
        result = work_one(task, load_input(task), folder)
    except StationError as error:
        return {**row, "verdict": "unreadable", "effects": str(error), **dict.fromkeys(_FIGURES, "")}
    gap = result.gap

    def joined(figures: Any) -> str:
        return " ".join(f"{channel.value} {one.rms:.3g}" for channel, one in figures.items())

    return {
        **row,
        "verdict": result.verdict.value,
        "effects": " ".join(f"{e.name}@{e.channel.value}" for e in result.effects),
        "confidence": " ".join(f"{e.confidence:.2f}" for e in result.effects),
        "before": joined(gap.before),
        "after": joined(gap.after),
        "noise": joined(gap.noise_floor),
    }


_FIGURES = ("confidence", "before", "after", "noise")


def work_all(tasks: list[Task], folder: Path, jobs: int, scheduler: str) -> list[dict[str, Any]]:
    """Many runs, spread over processes here or over a Dask cluster; rows in the order of the runs."""
    import joblib
    from rich.progress import track

    width = len(str(len(tasks)))
    places = [folder / f"{number:0{width}d}-{task.run.stem}" for number, task in enumerate(tasks)]
    calls = (joblib.delayed(_row)(task, place) for task, place in zip(tasks, places, strict=True))
    if scheduler:
        from distributed import Client

        with Client(scheduler), joblib.parallel_config(backend="dask"):
            return list(joblib.Parallel()(calls))
    found = joblib.Parallel(n_jobs=min(jobs, len(tasks)), return_as="generator")(calls)
    rows: list[dict[str, Any]] = []
    try:
        rows.extend(track(found, "discovering", total=len(tasks), console=console, disable=not sys.stderr.isatty()))
    except KeyboardInterrupt:
        console.print(f"interrupted: {len(rows)} of {len(tasks)} runs are done")
    return rows


def table(rows: list[dict[str, Any]], folder: Path) -> Path:
    """Write the rows as table.csv; its path."""
    path = folder / "table.csv"
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, fieldnames=["run", "verdict", "effects", *_FIGURES])
        writer.writeheader()
        writer.writerows(rows)
    return path
