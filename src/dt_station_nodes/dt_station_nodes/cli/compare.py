"""`dt-station compare`: how far apart object and twin are, or two runs."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from .common import ForceOption, JsonOption, OutOption, console, emit_json, find_config, output_dir

if TYPE_CHECKING:
    from ..core.run import Array
    from ..records.comparing import Comparison

_DRAWN = 20_000
_STRIDE = 1 << 16


def compare(
    run: Annotated[Path, typer.Argument(help="A bag, the station's CSV, or foreign data with --map.")],
    other: Annotated[Path | None, typer.Argument(help="A second run [default: the twin in the first].")] = None,
    *,
    from_s: Annotated[float | None, typer.Option("--from", help="Start of the window, s.")] = None,
    to_s: Annotated[float | None, typer.Option("--to", help="End of the window, s.")] = None,
    max_delay: Annotated[float, typer.Option(min=0.0, help="Longest delay to align by, s.")] = 0.5,
    number: Annotated[int | None, typer.Option("--run", min=1, help="Which run of a bag that holds several.")] = None,
    data_map: Annotated[str, typer.Option("--map", help="Map of foreign columns, for both runs.")] = "",
    out: OutOption = None,
    force: ForceOption = False,
    json: JsonOption = False,
) -> None:
    """Print ISE, RMS and fit per channel, as they are and with the delay between the two taken out.

    Files (residuals and a picture) are written only where --out is given.

    Example: dt-station compare runs/demo/pid runs/demo/fuzzy --from 4 --to 20
    """
    from ..core.channels import Channel
    from ..records import load_run
    from ..records.bagrun import run_from_bag
    from ..records.comparing import compare_bag, compare_runs
    from ..records.load import is_bag

    mapped = find_config("maps", data_map) if data_map else None
    if other is None:
        found = compare_bag(run, from_s, to_s, max_delay, number)
    else:
        # of a long bag no more than what is compared
        runs = [
            run_from_bag(path, number=number, only=[channel.signal for channel in Channel])
            if is_bag(path)
            else load_run(path, mapped)
            for path in (run, other)
        ]
        found = compare_runs(runs[0], runs[1], from_s, to_s, max_delay)
    files = _write(found, output_dir("compare", out, force)) if out is not None else {}
    if json:
        emit_json({"first": found.first, "second": found.second, **_values(found), "files": files})
        return
    _print(found)
    for name, path in files.items():
        console.print(f"{name}: {path}")


def _values(found: "Comparison") -> dict[str, Any]:
    channels = {
        channel.value: {
            "samples": gap.samples,
            "ise": gap.ise,
            "rms": gap.rms,
            "fit_percent": gap.fit_percent,
            "delay_s": gap.delay_s,
            "aligned": {"ise": gap.aligned_ise, "rms": gap.aligned_rms, "fit_percent": gap.aligned_fit_percent},
            "unit": channel.unit,
        }
        for channel, gap in found.channels.items()
    }
    return {"sample_time_s": found.sample_time_s, "missed": found.missed, "channels": channels}


def _print(found: "Comparison") -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table(title=f"{found.first} minus {found.second}")
    for heading in ("channel", "samples", "ISE", "RMS", "fit", "delay", "ISE aligned", "RMS aligned", "fit aligned"):
        table.add_column(heading, justify="left" if heading == "channel" else "right")
    for channel, gap in found.channels.items():
        unit = channel.unit
        table.add_row(
            channel.value,
            str(gap.samples),
            f"{gap.ise:.4g} {unit}²s",
            f"{gap.rms:.4g} {unit}",
            f"{gap.fit_percent:.2f} %",
            f"{gap.delay_s * 1e3:.1f} ms",
            f"{gap.aligned_ise:.4g} {unit}²s",
            f"{gap.aligned_rms:.4g} {unit}",
            f"{gap.aligned_fit_percent:.2f} %",
        )
    Console(width=140).print(table)
    if found.missed:
        print(f"{found.missed} samples had no partner")


def _telling(first: "Array", second: "Array") -> Any:
    """Rows to draw: all, or of a long run the least and the greatest residual of each stretch."""
    import numpy as np

    if len(first) <= _DRAWN:
        return slice(None)
    edges = np.linspace(0, len(first), _DRAWN // 2 + 1).astype(int)
    found = set()
    for start, stop in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        residual = first[start:stop] - second[start:stop]
        found |= {start + int(np.argmin(residual)), start + int(np.argmax(residual))}
    return np.array(sorted(found))


def _write(found: "Comparison", folder: Path) -> dict[str, str]:
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    import numpy as np

    figure, axes = plt.subplots(2 * len(found.channels), 1, sharex=True, figsize=(10, 5 * len(found.channels)))
    columns = {"time_s": next(iter(found.channels.values())).time_s}
    for i, (channel, gap) in enumerate(found.channels.items()):
        shown = _telling(gap.first, gap.second)
        time = gap.time_s[shown]
        axes[2 * i].plot(time, gap.first[shown], label="first", linewidth=1)
        axes[2 * i].plot(time, gap.second[shown], label="second", linewidth=1)
        axes[2 * i].set_ylabel(f"{channel.value}, {channel.unit}")
        axes[2 * i].legend(loc="upper right")
        axes[2 * i + 1].plot(time, gap.first[shown] - gap.second[shown], color="tab:red", linewidth=1)
        axes[2 * i + 1].set_ylabel(f"residual, {channel.unit}")
        columns[f"{channel.value}_first"], columns[f"{channel.value}_second"] = gap.first, gap.second
    axes[-1].set_xlabel("time, s")
    figure.suptitle(f"{found.first}\nminus {found.second}", fontsize=9)
    figure.tight_layout()
    figure.savefig(folder / "residuals.png", dpi=110)
    plt.close(figure)
    with (folder / "residuals.csv").open("w", encoding="utf-8") as file:
        file.write(",".join(columns) + "\n")
        for at in range(0, len(columns["time_s"]), _STRIDE):
            rows = np.column_stack([values[at : at + _STRIDE] for values in columns.values()])
            np.savetxt(file, rows, fmt="%.17g", delimiter=",")
    return {"picture": str(folder / "residuals.png"), "table": str(folder / "residuals.csv")}
