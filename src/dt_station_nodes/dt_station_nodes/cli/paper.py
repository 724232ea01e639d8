"""`dt-station paper`: every figure of the paper beside ours."""

import json as json_format
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
    jsonable,
    load_model,
    output_dir,
    progress,
)

if TYPE_CHECKING:
    from ..core.closed_loop import Plant
    from ..identification.paper import Row

COLOURS = {"reproduced": "green", "better": "bold green", "worse": "red", "not comparable": "yellow"}


def paper(
    *,
    model: Annotated[str, typer.Option(help="The paper's models, by path or name.")] = "paper",
    rig: Annotated[str, typer.Option(help="Virtual rig, by path or name in config/rigs.")] = "paper",
    seed: Annotated[int, typer.Option(min=0, help="Seed of the rig's noise.")] = 1,
    figures: Annotated[bool, typer.Option(help="Redraw the paper's figures.")] = True,
    out: OutOption = None,
    force: ForceOption = False,
    json: JsonOption = False,
) -> None:
    """Repeat the paper's experiments on its models and on the virtual rig, and compare every figure it prints.

    Each row says whether it is reproduced, better, worse or not comparable, and why. Leaves paper.json, the runs as
    CSV, and figures 6, 7, 9, 10, 12, 13, 14, 16, 17 and 18 redrawn from them. Runs in this process, in seconds.

    Example: dt-station paper --out runs/paper
    """
    from ..core.channels import Channel
    from ..core.control import LoopConfig
    from ..hardware import open_backend
    from ..identification.paper import CONTROLLERS, STEPS, Bench, rows, run_all

    spec, _ = load_model(model)
    lacking = [c.value for c in Channel if c not in spec.paths]
    if lacking or spec.paths[Channel.POSITION].disturbance is None:
        what = f"a {lacking[0]} path" if lacking else "a disturbance path"
        raise UserError(f"model {spec.name} lacks {what}, which the paper's experiments need; choose another.")
    controllers = {}
    for name in CONTROLLERS:
        path = find_config("controllers", name)
        controllers[name] = LoopConfig.from_yaml(path.read_text(encoding="utf-8"), str(path))
    options = {"sample_time_s": 0.02, "rig": str(find_config("rigs", rig)), "seed": seed}

    def fresh_rig() -> "Plant":
        # Everything in it is in memory: there is nothing to close.
        device = open_backend("virtual", options)
        device.open()
        return device

    fresh_rig()
    bench = Bench(spec, controllers, fresh_rig)
    with progress("Repeating the paper's experiments", STEPS) as advance:
        results = run_all(bench, lambda what: advance(1, f"Done: {what}"))
    found = rows(results)
    folder = output_dir("paper", out, force)
    files: dict[str, Any] = {"rows": folder / "paper.json", "runs": []}
    data = {"source": "doi:10.3390/electronics13173528", "model": spec.name, "rig": rig, "rows": found}
    files["rows"].write_text(json_format.dumps(jsonable(data), indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
    from ..records import write_csv

    for place, of in (("model", results.model), ("rig", results.rig)):
        for name, run in (
            *((k, v.run) for k, v in of.pressure.items()),
            *((k, v.run) for k, v in of.hold.items()),
        ):
            target = folder / f"{place}_{name}.csv"
            write_csv(run, target)
            files["runs"].append(target)
    if figures:
        from .paper_figures import draw

        with progress("Drawing"):
            files["figures"] = draw(results, folder)
    if json:
        emit_json({**data, "files": files})
    else:
        _show(found)
        console.print(f"figures and runs: {folder}", soft_wrap=True)


def _show(found: "list[Row]") -> None:
    from rich import box
    from rich.console import Console
    from rich.table import Table

    table = Table("what", "paper", "ours", "unit", "status", box=box.SIMPLE_HEAD, pad_edge=False)
    for column in table.columns[1:]:
        column.no_wrap = True
    for row in found:
        paper_says = (
            f"{row.paper:.5g}"
            if isinstance(row.paper, float) and "pole" not in row.what
            else "-"
            if row.paper is None
            else str(row.paper)
        )
        ours = "-" if row.ours is None else f"{row.ours:.7g}" if "pole" in row.what else f"{row.ours:.4g}"
        status = row.status.value
        table.add_row(row.what, paper_says, ours, row.unit, f"[{COLOURS[status]}]{status}[/]")
    printer = Console()
    printer.print(table)
    for row in found:
        if row.status.value in ("worse", "not comparable") and row.paper is not None:
            printer.print(f"{row.what}: {row.status.value}: {row.why}", soft_wrap=True)
