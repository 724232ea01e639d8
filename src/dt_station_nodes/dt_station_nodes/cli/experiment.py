"""`dt-station experiment`: identification experiments on the station, in its graph or in this process."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from .common import ForceOption, JsonOption, OutOption, UserError, console, emit_json, output_dir, progress

if TYPE_CHECKING:
    from ..core.run import Run
    from ..identification.experiments import ExperimentPlan


def experiment(
    name: Annotated[str, typer.Argument(help="Which experiment; none: list them.")] = "",
    *,
    rig: Annotated[str, typer.Option(help="Virtual rig, a path or a name in config/rigs.")] = "paper",
    backend: Annotated[str, typer.Option(help="The object's backend, as in the bridge.")] = "virtual",
    backend_options: Annotated[str, typer.Option(help="Its options in YAML [virtual: {rig: RIG}].")] = "",
    duration: Annotated[float | None, typer.Option(help="Length, s [60, slow ones 120].")] = None,
    amplitude: Annotated[float, typer.Option(help="Share of the usual amplitude, above 0 to 1.")] = 1.0,
    centre: Annotated[float, typer.Option(help="Piston position to work around, m.")] = 0.0,
    sample_time: Annotated[float, typer.Option(help="Sample time, s.")] = 0.02,
    pace: Annotated[str, typer.Option(help="lockstep (simulated objects only) or realtime.")] = "lockstep",
    in_process: Annotated[
        bool, typer.Option("--in-process", help="Without the graph; leaves a table, no bag.")
    ] = False,
    out: OutOption = None,
    force: ForceOption = False,
    json: JsonOption = False,
) -> None:
    """Run an identification experiment: the station's DAQ bridge and recorder, with the experiment as controller.

    Leaves run.csv, the plan, and (in the graph) a bag. The voltages go to 0 V where the piston leaves its travel.

    Example: dt-station experiment pressure-square --rig paper
    """
    from ..identification.experiments import ExperimentDriver, experiments

    plans = experiments(centre, duration, amplitude)
    if not name:
        _list(plans, json)
        return
    if name not in plans:
        raise UserError(f"there is no experiment {name!r}; there are {', '.join(plans)}.")
    if pace not in ("lockstep", "realtime"):
        raise UserError(f"--pace {pace}: choose lockstep or realtime.")
    if not 0.0 < sample_time < 10.0:
        raise UserError(f"--sample-time {sample_time:g}: give seconds above 0.")
    plan = plans[name]
    ExperimentDriver(plan, sample_time)
    options = backend_options or (f"{{rig: {rig}}}" if backend == "virtual" else "{}")
    if in_process:
        run = _alone(plan, backend, options, sample_time)
        folder = output_dir("experiment", out, force)
        files: dict[str, Path] = {}
    else:
        from .experiment_graph import check, run_in_graph

        check(backend, options, sample_time)
        folder = output_dir("experiment", out, force)
        run = run_in_graph(plan, backend, options, sample_time, pace, folder / "bag")
        files = {"bag": folder / "bag"}
    _leave(run, plan, folder, files, json)


def _list(plans: "dict[str, ExperimentPlan]", json: bool) -> None:
    if json:
        emit_json(
            {"experiments": [{"name": p.name, "purpose": p.purpose, "seconds": p.duration_s} for p in plans.values()]}
        )
        return
    from rich.console import Console
    from rich.table import Table

    table = Table("experiment", "for", "seconds")
    for plan in plans.values():
        table.add_row(plan.name, plan.purpose, f"{plan.duration_s:g}")
    Console().print(table)


def _alone(plan: "ExperimentPlan", kind: str, options: str, sample_time_s: float) -> "Run":
    """The experiment on a backend in this process."""
    from ..identification.experiments import run_in_process
    from ..nodes.backends import backend_from

    device = backend_from(kind, options, sample_time_s)
    device.open()

    def read() -> tuple[float, float]:
        reading = device.read()
        return reading.pressure_pa, reading.position_m

    def write(load_v: float, servo_v: float) -> tuple[float, float]:
        applied = device.write(load_v, servo_v)
        return applied.load_voltage_v, applied.servo_voltage_v

    try:
        with progress(plan.name, round(plan.duration_s / sample_time_s)) as advance:
            return run_in_process(plan, sample_time_s, read, write, plan.name, advance)
    finally:
        device.close()


def _leave(run: "Run", plan: "ExperimentPlan", folder: Path, files: dict[str, Path], json: bool) -> None:
    import dataclasses

    import yaml

    from ..records import write_csv
    from .common import jsonable

    files = {"run": folder / "run.csv", "plan": folder / "plan.yaml", **files}
    write_csv(run, files["run"])
    text = yaml.safe_dump(jsonable(dataclasses.asdict(plan)), sort_keys=False, allow_unicode=True)
    files["plan"].write_text(text, encoding="utf-8")
    spans = {name: [float(values.min()), float(values.max())] for name, values in run.signals.items()}
    result: dict[str, Any] = {
        "experiment": plan.name,
        "purpose": plan.purpose,
        "samples": len(run),
        "sample_time_s": run.sample_time_s,
        "ranges": spans,
        "files": files,
    }
    if json:
        emit_json(result)
        return
    from rich.console import Console
    from rich.table import Table

    table = Table("signal", "from", "to", title=f"{plan.name}: {len(run)} samples")
    for name, (low, high) in spans.items():
        table.add_row(name, f"{low:.5g}", f"{high:.5g}")
    Console().print(table)
    for name, path in files.items():
        console.print(f"{name}: {path}", soft_wrap=True)
    static = " --method static" if plan.name.endswith("triangle") else ""
    channel = "position" if plan.name.startswith(("position", "disturbance")) else "pressure"
    console.print(f"next: dt-station identify {files['run']} --channel {channel}{static} --model paper", soft_wrap=True)
