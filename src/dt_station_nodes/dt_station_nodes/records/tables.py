"""CSV tables: the station's own and foreign ones."""

import csv
import warnings
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..core.run import SIGNALS, Array, Run
from .errors import RecordError

TIME = "time_s"
_STRIDE = 1 << 16
Columns = dict[str, NDArray[np.float64]]


def column_names(path: Path) -> list[str]:
    """Names in the header line of a CSV file."""
    return _header(path)[0]


def read_columns(path: Path, wanted: tuple[str, ...], may_be_empty: tuple[str, ...] = ()) -> Columns:
    """The wanted columns of a CSV file with a header line.

    Values may be NaN or infinite, and so are empty cells of columns that `may_be_empty`; text that is no number
    raises RecordError with its column and row (from 1, below the header).
    """
    header, delimiter = _header(path)
    for name in wanted:
        if name not in header:
            known = ", ".join(n for n in header if n)
            raise RecordError(f"{path}: no column {name!r}; the file has {known}{_unit_hint(name, header)}")
    places = [header.index(name) for name in wanted]
    try:
        with path.open(encoding="utf-8-sig", newline="") as file, warnings.catch_warnings():
            warnings.simplefilter("ignore")
            table = np.loadtxt(
                file, delimiter=delimiter, skiprows=1, usecols=places, ndmin=2, quotechar='"', comments=None
            )
    except (ValueError, IndexError, UnicodeDecodeError):
        table = _read_slowly(path, delimiter, wanted, places, may_be_empty)
    if len(table) == 0:
        raise RecordError(f"{path}: no rows below the header")
    return {name: np.ascontiguousarray(table[:, i]) for i, name in enumerate(wanted)}


def _header(path: Path) -> tuple[list[str], str]:
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            line = file.readline(1 << 20)
    except UnicodeDecodeError:
        raise RecordError(f"{path}: this is no CSV text file") from None
    except OSError as error:
        raise RecordError(f"{path}: cannot be read ({error.strerror}); check the path") from None
    if not line.strip():
        raise RecordError(f"{path}: the file is empty")
    if "\0" in line:
        raise RecordError(f"{path}: this is no CSV text file")
    delimiter = max(",;\t", key=line.count)
    return [name.strip() for name in next(csv.reader([line], delimiter=delimiter))], delimiter


def _unit_hint(name: str, header: list[str]) -> str:
    stem = name.rsplit("_", 1)[0]
    near = [other for other in header if other.rsplit("_", 1)[0] == stem and other != name]
    return f"; {near[0]!r} has another unit, convert it or give a data map" if near else ""


def _read_slowly(
    path: Path, delimiter: str, names: tuple[str, ...], places: list[int], may_be_empty: tuple[str, ...]
) -> NDArray[np.float64]:
    """Row by row, to find the value that is no number; empty cells count as such unless they may be."""
    rows = []
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            for number, cells in enumerate(csv.reader(file, delimiter=delimiter)):
                if number == 0 or not any(cell.strip() for cell in cells):
                    continue
                rows.append(
                    [
                        _number(path, cells, place, name, number, name in may_be_empty)
                        for place, name in zip(places, names, strict=True)
                    ]
                )
    except (UnicodeDecodeError, csv.Error):
        raise RecordError(f"{path}: row {len(rows) + 1}: this is no CSV text") from None
    return np.array(rows, dtype=np.float64).reshape(-1, len(places))


def _number(path: Path, cells: list[str], place: int, name: str, row: int, may_be_empty: bool) -> float:
    if place >= len(cells):
        raise RecordError(f"{path}: column {name!r}, row {row}: the row ends before this column")
    try:
        return float(cells[place])
    except ValueError:
        text = cells[place].strip()
        if may_be_empty and not text:
            return float("nan")
        what = f"{text!r} is no number" if text else "the cell is empty"
        raise RecordError(f"{path}: column {name!r}, row {row}: {what}") from None


def write_csv(run: Run, path: str | Path) -> None:
    """Write a run as the station's own CSV; reading it back gives the same numbers to the last bit."""
    names = [name for name in SIGNALS if name in run.signals]
    foreign = [name for name in names if run.unit(name) not in ("Pa", "m", "V")]
    if foreign:
        raise RecordError(f"{path}: {foreign[0]} is in {run.unit(foreign[0])!r}; the station's tables are in SI only")
    with Path(path).open("w", encoding="utf-8", newline="") as file:
        file.write(",".join([TIME, *names]) + "\n")
        for columns in pieces(run, names):
            file.writelines(
                ",".join(map(repr, row)) + "\n" for row in zip(*(column.tolist() for column in columns), strict=True)
            )


def pieces(run: Run, names: Sequence[str]) -> Iterator[list[Array]]:
    """Times (s) and signals of a run, a stretch of rows at a time: a long run leaves no room for copies."""
    for start in range(0, len(run), _STRIDE):
        rows = np.arange(start, min(start + _STRIDE, len(run)), dtype=np.float64)
        yield [run.start_s + run.sample_time_s * rows, *(run.signals[name][start : start + _STRIDE] for name in names)]
