"""Write a set of hidden runs: `python -m benchmarks.discovery.generate --out DIR --set smoke --seed 1`.

DIR/runs/NNNN holds run.csv and validation.csv, which discovery may see, and unseen.csv for the judge, who alone
reads DIR/truth/truth.json.
"""

import json
from dataclasses import replace
from enum import Enum
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from .cases import Made, case_list, make, truth_of
from .plant import SAMPLE_S, Array, Drive

FILES = ("run", "validation", "unseen")
HEADER = "time_s,pressure_setpoint_pa,position_setpoint_m,load_voltage_v,servo_voltage_v,pressure_pa,position_m"


class Set(str, Enum):
    """Sizes of a set."""

    SMOKE = "smoke"
    STANDARD = "standard"
    FULL = "full"
    NULLS = "nulls"


def table(rows: Array, drive: Drive) -> Array:
    """The station's table, SI, shape (n, 7); in an open loop the set-point column repeats what was measured first."""
    n = rows.shape[1]
    pressure = drive.load if drive.load_closed else np.full(n, 1.0)
    position = drive.servo if drive.servo_closed else np.full(n, drive.start_cm)
    return np.stack(
        [np.arange(n) * SAMPLE_S, 1e6 * pressure, 0.01 * position, rows[0], rows[1], 1e6 * rows[2], 0.01 * rows[3]],
        axis=1,
    )


def write(made: Made, folder: Path) -> None:
    """The three tables of a case."""
    folder.mkdir(parents=True)
    for name, rows, drive in zip(FILES, made.runs, made.references, strict=True):
        np.savetxt(folder / f"{name}.csv", table(rows, drive), fmt="%.10g", delimiter=",", header=HEADER, comments="")


def main(
    out: Annotated[Path, typer.Option(help="new folder for runs/ and truth/")],
    which: Annotated[Set, typer.Option("--set", help="how many cases")] = Set.SMOKE,
    seed: Annotated[int, typer.Option(help="another seed, another set")] = 1,
    seconds: Annotated[float | None, typer.Option(help="length of every run; else 24 to 60 s, drawn")] = None,
) -> None:
    """Make hidden runs and, apart from them, the truth."""
    if out.exists() and any(out.iterdir()):
        raise typer.BadParameter(f"{out} is not empty: name a new folder")
    truth = {}
    for i, case in enumerate(case_list(which.value, seed)):
        made = make(replace(case, seconds=seconds))
        write(made, out / "runs" / f"{i:04d}")
        truth[f"{i:04d}"] = truth_of(made)
    (out / "truth").mkdir(parents=True)
    (out / "truth" / "truth.json").write_text(json.dumps({"set": which.value, "seed": seed, "cases": truth}, indent=1))
    typer.echo(f"{len(truth)} cases in {out}")


if __name__ == "__main__":
    typer.run(main)
