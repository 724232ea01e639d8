"""`dt-station demo`: the paper's experiment on the virtual rig, with a table and a report."""

import importlib
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from .common import ForceOption, JsonOption, OutOption, config_dir, console, emit_json, output_dir

if TYPE_CHECKING:
    from ..nodes.scenario import Scenario
    from .demo_table import DemoRun

_RUNS = (("pid", "position by PID"), ("fuzzy", "position by fuzzy control"))
_ZIEGLER_NICHOLS_S = 12.0


def demo(
    *,
    realtime: Annotated[bool, typer.Option("--realtime", help="Hold 20 ms; lockstep otherwise.")] = False,
    discovery: Annotated[
        bool, typer.Option("--discover/--no-discover", help="End by naming the effect the twin lacks.")
    ] = True,
    browse: Annotated[bool, typer.Option("--open", help="Open the report in a browser.")] = False,
    json: JsonOption = False,
    out: OutOption = None,
    force: ForceOption = False,
) -> None:
    """The paper's 24 s on the virtual rig: square load, position held by PID and then by fuzzy control.

    Every node is a process of its own; each run leaves a bag. The table stands beside the paper's figures.

    Example: dt-station demo --open
    """
    from ..nodes.scenario import Scenario
    from .demo_report import write_report
    from .demo_table import table
    from .station import private_domain

    scenario = Scenario.load("paper").changed(pace="realtime" if realtime else "lockstep")
    folder = output_dir("demo", out, force)
    started = time.monotonic()
    with private_domain():
        runs = _drive(scenario, folder)
    bags = [folder / "bags" / name for name, _ in _RUNS]
    rows = table(runs)
    found = _discover(bags[0], folder / "discovery") if discovery else None
    report = write_report(folder / "report.html", runs, rows, found)
    result = {
        "bags": bags,
        "report": report,
        "missed_samples": sum(run.statistics.bridge["missed_samples"] for run in runs.values()),
        "realtime_factor": min(run.statistics.bridge["realtime_factor"] for run in runs.values()),
        "latency_s": {
            name: max(run.statistics.bridge[f"latency_{name}_s"] for run in runs.values())
            for name in ("p50", "p99", "max")
        },
        "seconds": time.monotonic() - started,
        "rows": rows,
        "discovery": found,
        "extra_bags": [folder / "bags" / "ziegler_nichols"],
    }
    if json:
        emit_json(result)
    else:
        _show(result)
    if browse:
        typer.launch(report.resolve().as_uri())


def _drive(scenario: "Scenario", folder: Path) -> "dict[str, DemoRun]":
    from ..nodes.offspring import Nursery
    from ..nodes.scenario import NodeSpec, plan
    from .demo_table import DemoRun
    from .station import run_station

    attached = [str(config_dir() / "scenarios" / "paper.yaml")]
    fuzzy = scenario.with_parameters("position_controller", mode="fuzzy")
    slow = scenario.changed(duration_s=_ZIEGLER_NICHOLS_S).with_parameters(
        "pressure_controller", config="pressure_pi_zn"
    )
    scenarios = {
        "pid": scenario,
        "fuzzy": fuzzy.with_parameters("twin_simulator", **{"position.mode": "fuzzy"}),
        "ziegler_nichols": slow.with_parameters("twin_simulator", load_config="pressure_pi_zn"),
    }
    titles = {**dict(_RUNS), "ziegler_nichols": "pressure by the Ziegler-Nichols PI"}
    runs = {}
    (folder / "bags").mkdir(exist_ok=True)
    nursery = Nursery([each.executable for each in plan(scenario)] + ["recorder"])
    try:
        for name, chosen in scenarios.items():
            bag = folder / "bags" / name
            recorder = NodeSpec(executable="recorder", parameters={"out": str(bag.resolve()), "attach": attached})
            recorded = chosen.with_nodes(recorder=recorder)
            statistics = run_station(recorded, nursery=nursery, label=f"demo: {titles[name]}")
            runs[name] = DemoRun.from_bag(bag, titles[name], statistics)
    finally:
        nursery.close()
    return runs


def _discover(bag: Path, folder: Path) -> dict[str, Any] | None:
    """The effect the twin lacks, found from the PID run's bag; None where discovery is not installed."""
    try:
        module = importlib.import_module(".discover", __package__)
    except ImportError:
        return None
    found: dict[str, Any] = module.discover_for_demo(bag, folder)
    return found


def _show(result: dict[str, Any]) -> None:
    from rich.console import Console
    from rich.table import Table

    shown = Table("what", "paper", "ours", "unit", title="The paper's experiment on the virtual rig")
    for row in result["rows"]:
        shown.add_row(row["what"], _text(row["paper"]), _text(row["ours"]), row["unit"])
    Console(highlight=False).print(shown)
    found = result["discovery"]
    if found is not None:
        print(found.get("sentence", ""))
    latency = ", ".join(f"{name} {value * 1e3:.3g} ms" for name, value in result["latency_s"].items())
    print(f"missed samples {result['missed_samples']}; measurement to command {latency}")
    print(f"{result['realtime_factor']:.3g} times real time in the slowest run; all done in {result['seconds']:.0f} s")
    print("bags    " + "\n        ".join(str(bag) for bag in result["bags"]))
    print(f"report  {result['report']}")
    console.print("open the report in a browser, or run with --open", style="dim")


def _text(value: Any) -> str:
    if value is None:
        return "-"
    return f"{value:.4g}" if isinstance(value, float) else str(value)
