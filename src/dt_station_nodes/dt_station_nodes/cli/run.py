"""`dt-station run`: a scenario's nodes, started, watched and stopped."""

from pathlib import Path
from typing import Annotated, Any

import typer

from .common import Failure, ForceOption, JsonOption, OutOption, UserError, console, emit_json, output_dir


def run(
    scenario: Annotated[str, typer.Argument(help="Scenario file, or its name in config/scenarios.")] = "paper",
    *,
    pace: Annotated[str | None, typer.Option(help="realtime or lockstep [the scenario's].")] = None,
    duration: Annotated[str | None, typer.Option(help="Length, such as 24s or 5min; 0: until Ctrl-C.")] = None,
    sample_time: Annotated[str | None, typer.Option(help="Time between samples, such as 20ms.")] = None,
    param: Annotated[
        list[str] | None,
        typer.Option("--param", "-p", metavar="NODE.NAME=VALUE", help="Change a parameter; repeatable."),
    ] = None,
    composed: Annotated[bool, typer.Option("--composed", help="All nodes in one process.")] = False,
    record: Annotated[bool, typer.Option("--record", help="Record a bag into --out.")] = False,
    json: JsonOption = False,
    out: OutOption = None,
    force: ForceOption = False,
) -> None:
    """Start a scenario: all its nodes as processes, watched, restarted where one falls, stopped cleanly.

    Example: dt-station run paper --pace lockstep --duration 60s -p load_generator.shape=sine --record
    """
    from ..nodes.scenario import NodeSpec, Scenario
    from .station import explain, run_station

    chosen = Scenario.load(scenario)
    chosen = chosen.changed(**_changes(pace, duration, sample_time))
    for each in param or []:
        chosen = _with_parameter(chosen, each)
    folder: Path | None = None
    if record or out is not None:
        folder = output_dir("run", out, force)
    if record and folder is not None:
        recorder = NodeSpec(executable="recorder", parameters={"out": str(folder / "bag")})
        chosen = chosen.with_nodes(recorder=recorder)
    statistics = run_station(chosen, composed=composed, log_dir=folder)
    if json:
        emit_json({"statistics": statistics, "out": folder, "bag": folder / "bag" if record and folder else None})
    else:
        explain(statistics)
        if folder is not None:
            console.print(f"files: {folder}")
    fallen = {name: status for name, status in statistics.exit_status.items() if status}
    if fallen:
        name, status = next(iter(fallen.items()))
        raise Failure(f"{name} ended with status {status}")


def _changes(pace: str | None, duration: str | None, sample_time: str | None) -> dict[str, Any]:
    from ..core.units import parse_quantity

    changes: dict[str, Any] = {}
    if pace is not None:
        changes["pace"] = pace
    if duration is not None:
        changes["duration_s"] = parse_quantity(duration, "time")
    if sample_time is not None:
        changes["sample_time_s"] = parse_quantity(sample_time, "time")
    return changes


def _with_parameter(scenario: Any, text: str) -> Any:
    import yaml

    path, equals, value = text.partition("=")
    node, dot, name = path.partition(".")
    if not (equals and dot and node and name):
        raise UserError(f"--param takes NODE.NAME=VALUE, such as load_generator.shape=sine, got {text!r}.")
    try:
        return scenario.with_parameters(node, **{name: yaml.safe_load(value)})
    except yaml.YAMLError:
        raise UserError(f"--param {text!r}: the value is not YAML.") from None
