"""`dt-station shadow`: measured data through the live graph, and the gap that the twin leaves."""

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
    from ..core.models import ModelSpec
    from ..core.run import Run
    from ..nodes.scenario import Scenario
    from ..records.comparing import Comparison


def shadow(
    file: Annotated[Path, typer.Argument(help="Measured run: the station's CSV or bag, or foreign CSV or MAT.")],
    *,
    data_map: Annotated[str, typer.Option("--map", help="Map of foreign columns, a path or a name.")] = "",
    model: Annotated[str, typer.Option("--model", help="The twin's model, a path or a name.")] = "paper",
    out: OutOption = None,
    force: ForceOption = False,
    json: JsonOption = False,
) -> None:
    """Replay a measured run through bridge, twin, shadow and recorder, and print the gap per channel.

    Leaves a bag and a picture of each channel. Published figures for the same data stand beside ours where
    config/published has a file of the map's name.

    Example: dt-station shadow ../shared/data/emps.mat --map emps --model emps_free_run
    """
    from ..records import load_run

    mapped = find_config("maps", data_map) if data_map else None
    run = load_run(file, mapped)
    spec, _ = load_model(model)
    _check(run, spec, file)
    folder = output_dir("shadow", out, force)
    station = _scenario(run, file, mapped, find_config("models", model), folder / "bag")
    missed, factor = _drive(station)
    found = _gap(folder / "bag")
    result = _result(run, spec, found, missed, factor)
    result["repeats_offline"] = _repeats_offline(run, spec, found)
    result["published"] = _published(found, run, mapped)
    result["files"] = {"bag": folder / "bag", **_draw(found, run, spec, folder)}
    if json:
        emit_json(result)
        return
    _print(result)


def _check(run: "Run", spec: "ModelSpec", file: Path) -> None:
    shared = [channel for channel in run.channels() if channel in spec.paths]
    if not shared:
        has = ", ".join(channel.value for channel in run.channels()) or "no channel with both voltage and output"
        describes = ", ".join(channel.value for channel in spec.paths)
        raise UserError(f"{file} measured {has}, but model {spec.name} describes {describes}; choose another model.")


def _scenario(run: "Run", file: Path, mapped: Path | None, model: Path, bag: Path) -> "Scenario":
    from ..nodes.scenario import NodeSpec, Scenario

    source = {"file": str(file.resolve()), **({"map": str(mapped.resolve())} if mapped else {})}
    attached = [str(model.resolve()), *([str(mapped.resolve())] if mapped else [])]
    nodes = {
        "recorder": NodeSpec(parameters={"out": str(bag.resolve()), "attach": attached}),
        "shadow": NodeSpec(executable="shadow_compare", parameters={"window_s": max(5.0, 50 * run.sample_time_s)}),
        "twin": NodeSpec(
            executable="twin_simulator", parameters={"model": str(model.resolve()), "feed": "commands"}
        ),
        "daq_bridge": NodeSpec(parameters={"backend": "replay", "backend_options": source}),
    }  # fmt: skip
    # The last row is the sample that ends the run.
    length_s = (len(run) - 1) * run.sample_time_s
    return Scenario(name="shadow", sample_time_s=run.sample_time_s, pace="lockstep", duration_s=length_s, nodes=nodes)


def _drive(station: "Scenario") -> tuple[int, float]:
    """Run the graph to the data's end; samples without a partner, and how many times faster than the data."""
    from .station import private_domain, run_station

    with private_domain():
        statistics = run_station(station, label="shadow: measured data through the graph")
    return int(statistics.shadow.get("missed", 0)), float(statistics.bridge.get("realtime_factor", float("nan")))


def _gap(bag: Path) -> "Comparison":
    from ..records.comparing import compare_bag

    return compare_bag(bag, None, None, 0.0)


def _result(run: "Run", spec: "ModelSpec", found: "Comparison", missed: int, factor: float) -> dict[str, Any]:
    rows = [
        {
            "channel": channel.value,
            "samples": gap.samples,
            "rms": gap.rms,
            "ise": gap.ise,
            "fit_percent": gap.fit_percent,
            "unit": run.unit(channel.signal),
        }
        for channel, gap in found.channels.items()
    ]
    return {
        "source": run.source,
        "model": spec.name,
        "sample_time_s": run.sample_time_s,
        "samples": len(run),
        "missed": missed,
        "realtime_factor": factor,
        "rows": rows,
    }


def _repeats_offline(run: "Run", spec: "ModelSpec", found: "Comparison") -> bool:
    """Whether the live twin's outputs are, bit for bit, those of simulating the run in one go."""
    import numpy as np

    from ..core.channels import Channel
    from ..core.models import PlantModel

    measured = {channel: run.get(channel.signal) for channel in Channel}
    first = {channel: None if values is None else float(values[0]) for channel, values in measured.items()}
    voltages = [np.zeros(len(run)) if v is None else v for v in (run.get(c.voltage_signal) for c in Channel)]
    model = PlantModel(spec, run.sample_time_s)
    state = model.initial_state(first[Channel.POSITION], first[Channel.PRESSURE])
    whole = model.simulate(voltages[0], voltages[1], measured[Channel.PRESSURE], state)
    alone = {Channel.PRESSURE: whole.pressure_pa, Channel.POSITION: whole.position_m}
    return all(np.array_equal(gap.second, alone[channel]) for channel, gap in found.channels.items())


def _published(found: "Comparison", run: "Run", mapped: Path | None) -> list[dict[str, Any]]:
    """Others' figures for this data, each with ours over the same rows."""
    from ..core.comparison import score
    from .published import figures_for

    rows = []
    for figure in figures_for(mapped.stem) if mapped else ():
        gap = found.channels.get(figure.channel)
        if gap is None:
            continue
        start, stop = figure.rows or (0, gap.samples)
        own = score(gap.first[start:stop], gap.second[start:stop], found.sample_time_s)
        ours = own.rms if figure.figure == "rms" else own.fit_percent
        unit = run.unit(figure.channel.signal) if figure.figure == "rms" else "%"
        rows.append({**figure.model_dump(mode="json"), "unit": unit, "ours": ours, "status": figure.judged(ours)})
    return rows


def _draw(found: "Comparison", run: "Run", spec: "ModelSpec", folder: Path) -> dict[str, Path]:
    from .shadow_picture import draw_channel

    return {
        channel.value: draw_channel(channel, gap, run.unit(channel.signal), spec.name, folder / f"{channel.value}.png")
        for channel, gap in found.channels.items()
    }


def _print(result: dict[str, Any]) -> None:
    from rich.console import Console
    from rich.table import Table

    screen = Console()
    table = Table(title=f"{result['source']} minus twin {result['model']}")
    for heading in ("channel", "samples", "RMS", "ISE", "fit"):
        table.add_column(heading, justify="left" if heading == "channel" else "right")
    for row in result["rows"]:
        unit = "" if row["unit"] == "1" else f" {row['unit']}"
        squared = f"{unit}²s" if unit else " s"
        fit = f"{row['fit_percent']:.1f} %"
        table.add_row(row["channel"], str(row["samples"]), f"{row['rms']:.4g}{unit}", f"{row['ise']:.4g}{squared}", fit)
    screen.print(table)
    if result["published"]:
        beside = Table(title="beside published figures")
        for heading in ("channel", "figure", "published", "ours", "what"):
            beside.add_column(heading, overflow="fold")
        for row in result["published"]:
            span = f"{row['low']:g}" if row["low"] == row["high"] else f"{row['low']:g} to {row['high']:g}"
            name = (
                "fit, %"
                if row["figure"] == "fit_percent"
                else "RMS" + (f", {row['unit']}" if row["unit"] != "1" else "")
            )
            beside.add_row(row["channel"], name, span, f"{row['ours']:.4g} ({row['status']})", row["what"])
        screen.print(beside)
    repeats = "the same bits as" if result["repeats_offline"] else "NOT the same bits as"
    console.print(
        f"{result['missed']} samples missed; {result['realtime_factor']:.1f} times real time; "
        f"the live twin gave {repeats} a simulation of the whole run"
    )
    for name, path in result["files"].items():
        console.print(f"{name}: {path}")
