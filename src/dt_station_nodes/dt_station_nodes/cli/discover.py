"""`dt-station discover`: where model and measurement disagree, which effect is missing, and the model with it."""

import os

# The fits multiply small matrices; linear algebra's own threads only get in each other's way.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from .common import (
    ForceOption,
    JsonOption,
    OutOption,
    UserError,
    console,
    emit_json,
    find_config,
    load_model,
    output_dir,
)

if TYPE_CHECKING:
    from ..workers import Workers


def discover(
    runs: Annotated[list[Path], typer.Argument(metavar="RUN...", help="Runs: bags, CSV, or foreign data with --map.")],
    *,
    model: Annotated[str, typer.Option("--model", help="The model examined, a path or a name.")] = "paper",
    validate: Annotated[
        Path | None, typer.Option("--validate", metavar="RUN2", help="Another run, to judge on; no fit sees it.")
    ] = None,
    data_map: Annotated[str, typer.Option("--map", help="Map of foreign columns, a path or a name.")] = "",
    validate_map: Annotated[str, typer.Option("--validate-map", help="Map of RUN2 [that of --map].")] = "",
    jobs: Annotated[int, typer.Option(min=0, help="Workers; the answer does not depend on it. 0: all cores.")] = 0,
    scheduler: Annotated[str, typer.Option(metavar="ADDRESS", help="Dask scheduler to spread many runs over.")] = "",
    window: Annotated[
        float, typer.Option(min=0.0, help="Length of re-anchored windows, s. 0: chosen by the data.")
    ] = 0.0,
    out: OutOption = None,
    force: ForceOption = False,
    json: JsonOption = False,
) -> None:
    """Find, name and add the effect that a model lacks, or say that nothing is missing or that it is not known.

    Leaves model.yaml, report.html and discovery.json; with several runs one folder each and a table.

    Example: dt-station discover runs/demo/pid --model paper --out runs/found
    """
    count = jobs or os.cpu_count() or 1
    # Of many runs each is searched by a process of its own.
    with _workers(count if len(runs) == 1 else 1) as workers:
        from .discover_job import Task, load_input, table, work_all, work_one

        mapped = find_config("maps", data_map) if data_map else None
        checked_map = find_config("maps", validate_map) if validate_map else mapped
        _, text = load_model(model)
        tasks = [Task(run, mapped, model, text, validate, checked_map, window) for run in runs]
        loaded = [load_input(task) for task in tasks]
        folder = output_dir("discover", out, force)
        if len(tasks) == 1:
            result = work_one(tasks[0], loaded[0], folder, _speaker(), workers)
            if json:
                emit_json({**result.to_json(), "files": _files(folder)})
                return
            _print(result, folder)
            return
        rows = work_all(tasks, folder, count, _cluster(scheduler))
        summary = table(rows, folder)
        if json:
            emit_json({"rows": rows, "files": {"table": summary}})
            return
        _print_table(rows)
        console.print(f"one folder a run in {folder}")


def discover_for_demo(bag: Path, folder: Path, model: str = "paper") -> dict[str, Any]:
    """What the demo's twin lacks: the answer as --json has it, with its sentence and the report's path."""
    with _workers(os.cpu_count() or 1) as workers:
        from .discover_job import Task, load_input, work_one

        _, text = load_model(model)
        task = Task(bag, None, model, text, None, None, 0.0)
        result = work_one(task, load_input(task), folder, _speaker(), workers)
    return {**result.to_json(), "sentence": result.sentence, "report": folder / "report.html"}


def _workers(jobs: int) -> "Workers":
    """Workers whose helpers start at once: they import what they need while this process does."""
    from ..workers import Workers

    workers = Workers(jobs)
    workers.start(f"{__package__}.discover_job")
    return workers


def _cluster(address: str) -> str:
    if address:
        try:
            import distributed  # noqa: F401
        except ImportError:
            raise UserError(
                "--scheduler needs Dask; install it into the environment with: pip install distributed"
            ) from None
    return address


def _files(folder: Path) -> dict[str, Path]:
    return {name: folder / name for name in ("model.yaml", "report.html", "discovery.json")}


def _speaker() -> Any:
    """Progress on standard error: one line that changes, where a person can see it."""
    if not console.is_terminal:
        return None
    from rich.live import Live
    from rich.spinner import Spinner

    spinner = Spinner("dots", text="reading")
    live = Live(spinner, console=console, transient=True, refresh_per_second=8)
    live.start()

    def say(text: str | None) -> None:
        if text is None:
            live.stop()
        else:
            spinner.update(text=f"trying {text.replace('_', ' ')}")

    return say


def _print(result: Any, folder: Path) -> None:
    from rich.console import Console
    from rich.table import Table

    screen = Console(highlight=False)
    if result.interrupted:
        screen.print("interrupted; this is what was known by then:")
    screen.print(result.sentence)
    for effect in result.effects:
        numbers = Table(title=f"{effect.name} ({effect.channel.value}), confidence {effect.confidence:.0%}")
        for head in ("parameter", "value", "95 % from", "to", "unit"):
            numbers.add_column(head)
        for name, p in effect.parameters.items():
            numbers.add_row(name, f"{p.value:.4g}", f"{p.low:.4g}", f"{p.high:.4g}", p.unit)
        screen.print(numbers)
        if effect.check:
            screen.print(f"check on the rig: {effect.check}")
    if result.next_experiment is not None:
        wave = result.next_experiment
        screen.print(
            f"next experiment: {wave.shape} of {wave.amplitude:.3g} V about {wave.offset:.3g} V "
            f"at {wave.frequency_hz} Hz on the {wave.channel.value} valve: {wave.why}"
        )
    screen.print(f"report: {folder / 'report.html'}\nmodel:  {folder / 'model.yaml'}")


def _print_table(rows: list[dict[str, Any]]) -> None:
    from rich.console import Console
    from rich.table import Table

    shown = Table()
    for head in ("run", "verdict", "effects", "confidence", "RMS before", "after", "noise"):
        shown.add_column(head, overflow="fold")
    for row in rows:
        shown.add_row(
            *(str(row[key]) for key in ("run", "verdict", "effects", "confidence", "before", "after", "noise"))
        )
    Console(highlight=False).print(shown)
