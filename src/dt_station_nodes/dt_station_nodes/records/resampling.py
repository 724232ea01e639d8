"""Rows of an uneven clock, with some of them lost, put on an even time grid."""

import numpy as np
from numpy.typing import NDArray

from .errors import RecordError
from .grid import check_finite, check_increasing
from .tables import Columns

LONGEST_BRIDGE = 5.0  # steps of the grid: a straight line over more of them is no measurement
COARSER = 1.5  # times the usual step: a grid that leaves out rows would fold what is quick into what is slow


def on_even_grid(columns: Columns, time: str, step_s: float, file: str, first_row: int = 1) -> tuple[float, Columns]:
    """Start (s) of an even grid of `step_s`, and the columns on it by straight lines between their finite values.

    `time` names the column of times (s), shape (n,) as all of them. Where one starts late or ends early the grid
    does so for all. Raises RecordError where time is not increasing, values are missing for too long, or the grid
    is coarser than the rows.
    """
    seconds = columns[time]
    check_finite(seconds, file, time, first_row)
    check_increasing(seconds, file, time, first_row)
    usual = float(np.median(np.diff(seconds))) if len(seconds) > 1 else 0.0
    if step_s > COARSER * usual:
        raise RecordError(
            f"{file}: column {time!r}: rows come every {usual:.6g} s, resample_s of {step_s:.6g} s would leave some "
            f"out; write resample_s: {usual:.4g}"
        )
    known = {name: np.flatnonzero(np.isfinite(values)) for name, values in columns.items()}
    for name, rows in known.items():
        _check_bridges(seconds, rows, step_s, f"{file}: column {name!r}", first_row)
    start = float(max(seconds[rows[0]] for rows in known.values()))
    stop = float(min(seconds[rows[-1]] for rows in known.values()))
    count = int((stop - start) / step_s + 1e-6) + 1
    if count < 2:
        raise RecordError(f"{file}: {count} rows on the grid of resample_s: {step_s:.6g}; a run needs at least 2")
    grid = start + step_s * np.arange(count)
    return start, {
        name: np.interp(grid, seconds[known[name]], values[known[name]])
        for name, values in columns.items()
        if name != time
    }


def _check_bridges(seconds: NDArray[np.float64], rows: NDArray[np.intp], step_s: float, what: str, first: int) -> None:
    if len(rows) < 2:
        raise RecordError(f"{what} has {len(rows)} values; a run needs at least 2")
    wide = np.flatnonzero(np.diff(seconds[rows]) > (LONGEST_BRIDGE + 0.5) * step_s)
    if wide.size:
        before, after = rows[wide[0]], rows[wide[0] + 1]
        raise RecordError(
            f"{what}, rows {first + before} to {first + after}: nothing for {seconds[after] - seconds[before]:.6g} s, "
            f"over {LONGEST_BRIDGE:.0f} steps of resample_s; keep the rows before or after with rows: [start, stop]"
        )
