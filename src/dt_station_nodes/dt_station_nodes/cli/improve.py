"""`dt-station improve`: experiment and discover on the live station until named, then update the running twin."""

import os

# See discover: linear algebra's own threads only get in each other's way.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from typing import Annotated, Any

import typer

from .common import ForceOption, JsonOption, OutOption, UserError, console, emit_json, load_model, output_dir


def improve(
    scenario: Annotated[str, typer.Argument(help="Scenario to run, a path or a name.")] = "paper",
    *,
    model: Annotated[str, typer.Option("--model", help="The twin's model at the start, a path or a name.")] = "paper",
    rig: Annotated[str, typer.Option(help="Virtual rig instead of the scenario's, a path or a name.")] = "",
    budget: Annotated[int, typer.Option(min=1, max=20, help="Most experiments.")] = 3,
    seconds: Annotated[float, typer.Option(min=8.0, max=600.0, help="Length of an experiment, s.")] = 24.0,
    pace: Annotated[str, typer.Option(help="realtime, or lockstep with a simulated object.")] = "realtime",
    jobs: Annotated[int, typer.Option(min=0, help="Workers of each discovery. 0: all cores.")] = 0,
    out: OutOption = None,
    force: ForceOption = False,
    json: JsonOption = False,
) -> None:
    """Find what the running station's twin lacks, by experiments of its own, and put it into the twin as it runs.

    Each round records, discovers, and where two names are left plays the waveform that separates them. Ends when
    the effect is named or the budget is spent; then the twin takes the model found and the live gap is shown.

    Example: dt-station improve paper --rig relief_hysteresis --pace lockstep
    """
    from .improve_live import improve_live

    if pace not in ("realtime", "lockstep"):
        raise UserError(f"--pace {pace}: choose realtime or lockstep.")
    load_model(model)
    workers = jobs or os.cpu_count() or 1
    folder = output_dir("improve", out, force)
    outcome = improve_live(scenario, model, rig, budget, seconds, pace, workers, folder, _say)
    if json:
        emit_json(outcome)
        return
    _print(outcome)


def _say(text: str) -> None:
    console.print(text)


def _print(outcome: dict[str, Any]) -> None:
    from rich.console import Console
    from rich.table import Table

    screen = Console(highlight=False)
    screen.print(outcome["rounds"][-1]["sentence"])
    shown = Table(title="live gap of the running twin, RMS over the shadow's window")
    for head in ("channel", "before", "after", "unit"):
        shown.add_column(head)
    for channel, row in outcome["live"].items():
        shown.add_row(channel, f"{row['before']:.4g}", f"{row['after']:.4g}", row["unit"])
    screen.print(shown)
    screen.print(f"report: {outcome['files']['report']}\nmodel:  {outcome['files']['model']}")
