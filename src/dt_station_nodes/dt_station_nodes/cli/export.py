"""`dt-station export`: a bag as tables for other programs."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from .common import ForceOption, JsonOption, OutOption, UserError, emit_json, find_config, output_dir, progress

if TYPE_CHECKING:
    from ..core.run import Run


def export(
    run: Annotated[Path, typer.Argument(help="A bag, the station's CSV, or foreign data with --map.")],
    *,
    kind: Annotated[str, typer.Option("--format", help="csv or parquet.")] = "csv",
    topic: Annotated[list[str] | None, typer.Option(help="Write a topic's messages; repeatable; 'all'.")] = None,
    from_s: Annotated[float | None, typer.Option("--from", help="Start, s.")] = None,
    to_s: Annotated[float | None, typer.Option("--to", help="End, s.")] = None,
    number: Annotated[int | None, typer.Option("--run", min=1, help="Which run of a bag that holds several.")] = None,
    twin: Annotated[bool, typer.Option("--twin", help="The twin's run instead of the object's.")] = False,
    data_map: Annotated[str, typer.Option("--map", help="Map of foreign columns to signals.")] = "",
    out: OutOption = None,
    force: ForceOption = False,
    json: JsonOption = False,
) -> None:
    """Write a run's table (one row a sample), or whole topics (one row a message), as CSV or Parquet.

    Example: dt-station export runs/demo/pid --format parquet --out tables
    """
    from ..records import Bag
    from ..records.exporting import TableKind, export_topic, file_name, table_topics
    from ..records.load import is_bag

    if kind not in {k.value for k in TableKind}:
        raise UserError(f"--format {kind}: write csv or parquet")
    form = TableKind(kind)
    rows: dict[str, int] = {}
    if topic:
        if not is_bag(run):
            raise UserError(f"{run} is no bag; --topic goes with bags only")
        if from_s is not None or to_s is not None or number is not None or twin:
            raise UserError("--from, --to, --run and --twin choose of a run's table; they do not go with --topic")
        with Bag(run) as bag:
            wanted = table_topics(bag) if "all" in topic else topic
            for name in wanted:
                bag.decoder(name)
            folder = output_dir("export", out, force)
            with progress("exporting", len(wanted)) as advance:
                for name in wanted:
                    path = folder / file_name(name, form)
                    rows[str(path)] = export_topic(bag, name, path, form)
                    advance(1)
    else:
        from ..records import load_run, run_from_bag
        from ..records.bagrun import STATE, TWIN
        from ..records.exporting import export_run

        if is_bag(run):
            table = run_from_bag(run, TWIN if twin else STATE, number, from_s, to_s)
        else:
            table = _cut(load_run(run, find_config("maps", data_map) if data_map else None), from_s, to_s)
        folder = output_dir("export", out, force)
        path = folder / f"run.{form.value}"
        rows[str(path)] = export_run(table, path, form)
    if json:
        emit_json({"files": [{"path": path, "rows": count} for path, count in rows.items()]})
        return
    for path_text, count in rows.items():
        print(f"{path_text}: {count} rows")


def _cut(table: "Run", from_s: float | None, to_s: float | None) -> "Run":
    step = table.sample_time_s
    start = 0 if from_s is None else max(0, round((from_s - table.start_s) / step))
    stop = len(table) if to_s is None else min(len(table), round((to_s - table.start_s) / step))
    if stop - start < 2:
        raise UserError(f"{table.source} has {max(0, stop - start)} samples in this window; at least 2 are needed")
    return table.window(start, stop)
