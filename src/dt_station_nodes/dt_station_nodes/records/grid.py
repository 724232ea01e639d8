"""The even time grid under a table, or a sentence why there is none."""

import numpy as np
from numpy.typing import NDArray

from .errors import RecordError

JITTER = 0.1  # share of a sample time
ROUNDING = 1e-7  # relative


def check_finite(values: NDArray[np.float64], file: str, column: str, first_row: int = 1) -> None:
    """Raise RecordError naming file, column and row (from 1) of the first value that is no finite number."""
    bad = np.flatnonzero(~np.isfinite(values))
    if bad.size:
        row = int(bad[0])
        raise RecordError(
            f"{file}: column {column!r}, row {first_row + row}: {values[row]} is no finite number; "
            "fill the gap or cut the rows out"
        )


def check_increasing(time_s: NDArray[np.float64], file: str, column: str, first_row: int = 1) -> None:
    """Raise RecordError naming file, column and row (from 1) where time stands still or runs backwards."""
    back = np.flatnonzero(np.diff(time_s) <= 0.0)
    if back.size:
        row = int(back[0]) + 1
        raise RecordError(
            f"{file}: column {column!r}, row {first_row + row}: time is not increasing "
            f"({float(time_s[row])!r} s after {float(time_s[row - 1])!r} s); sort the rows or remove the repeated ones"
        )


def even_grid(time_s: NDArray[np.float64], file: str, column: str, first_row: int = 1) -> tuple[float, float]:
    """Start and sample time (s) of an evenly sampled time column, shape (n,), n >= 2.

    Raises RecordError naming file, column and row where time stands still, runs backwards, or
    leaves the grid by over a tenth of a sample time.
    """
    if len(time_s) < 2:
        raise RecordError(f"{file}: column {column!r} has {len(time_s)} rows; a run needs at least 2")
    check_finite(time_s, file, column, first_row)
    check_increasing(time_s, file, column, first_row)
    steps = np.diff(time_s)
    typical = float(np.median(steps))
    uneven = np.flatnonzero(np.abs(steps - typical) > JITTER * typical)
    if uneven.size:
        row = int(uneven[0]) + 1
        raise RecordError(
            f"{file}: column {column!r}, row {first_row + row}: jittery time, a step of {steps[row - 1]:.6g} s where "
            f"{typical:.6g} s is usual; resample to an even grid first: a data map can, with resample_s: {typical:.4g}"
        )
    return float(time_s[0]), _round_step(time_s)


def _round_step(time_s: NDArray[np.float64]) -> float:
    """Mean step, or the short decimal number near it that keeps every row on the grid."""
    count = len(time_s) - 1
    mean = float(time_s[-1] - time_s[0]) / count
    for digits in range(1, 7):
        short = float(f"{mean:.{digits}g}")
        if abs(short - mean) < ROUNDING * mean and abs(short - mean) * count < JITTER * mean:
            return short
    return mean
