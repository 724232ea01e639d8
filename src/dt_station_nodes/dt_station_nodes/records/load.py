"""A run from a file, whatever its kind."""

from pathlib import Path

import numpy as np

from ..core.channels import Channel
from ..core.run import SIGNALS, Run
from .bagrun import run_from_bag
from .datamap import DataMap, TableFormat, load_map
from .errors import RecordError
from .grid import check_finite, even_grid
from .matfile import read_variables
from .resampling import on_even_grid
from .tables import TIME, Columns, column_names, read_columns
from .units import FACTORS, factor_to_si

SETPOINTS = tuple(channel.setpoint_signal for channel in Channel)


def load_run(path: str | Path, data_map: DataMap | str | Path | None = None) -> Run:
    """The run in a bag (directory, .mcap or .db3), the station's CSV, or a foreign CSV or MAT file with its map.

    Raises RecordError: one sentence naming the file and, for tables, column and row.
    """
    path = Path(path)
    if not path.exists():
        raise RecordError(f"{path}: no such file or directory")
    if data_map is not None:
        return _foreign(path, data_map if isinstance(data_map, DataMap) else load_map(data_map))
    if is_bag(path):
        return run_from_bag(path)
    if path.suffix.lower() == ".mat":
        raise RecordError(f"{path}: a MAT file needs a data map (--map) that says which column is which signal")
    return _own(path)


def is_bag(path: Path) -> bool:
    """Whether a path is read as a bag: a folder, an MCAP or a sqlite3 file."""
    return path.is_dir() or path.suffix in (".mcap", ".db3")


def _own(path: Path) -> Run:
    header = column_names(path)
    present = tuple(name for name in SIGNALS if name in header)
    if TIME in header and not present:
        raise RecordError(f"{path}: none of the columns {', '.join(SIGNALS)}; give a data map (--map)")
    foreign = [name for name in header if name and name not in (TIME, *SIGNALS)]
    for channel in Channel:
        # a column under another name must not become a channel that was not measured
        if channel.voltage_signal in present and channel.signal not in present and foreign:
            raise RecordError(
                f"{path}: no column {channel.signal!r} beside {channel.voltage_signal!r}; the file has "
                f"{', '.join(foreign)} instead: rename it, or give a data map (--map)"
            )
    columns = read_columns(path, (TIME, *present), may_be_empty=SETPOINTS)
    signals = {name: columns[name] for name in present}
    start, step = even_grid(columns[TIME], str(path), TIME)
    # Where a loop is open there is no set-point to write down.
    signals = {name: v for name, v in signals.items() if name not in SETPOINTS or not np.isnan(v).all()}
    for name, values in signals.items():
        check_finite(values, str(path), name)
    return Run(step, signals, start, str(path))


def _foreign(path: Path, data_map: DataMap) -> Run:
    if path.is_dir():
        raise RecordError(f"{path}: a directory; a data map goes with a CSV or MAT file")
    time = () if data_map.time is None else (data_map.time.column,)
    wanted = tuple(dict.fromkeys((*time, *(signal.column for signal in data_map.signals.values()))))
    if data_map.format is TableFormat.MAT:
        columns = read_variables(path, wanted)
    else:
        columns = read_columns(path, wanted, may_be_empty=wanted if data_map.resample_s else ())
    columns = _rows(path, columns, data_map)
    first = 1 + (data_map.rows[0] if data_map.rows else 0)
    start, step = 0.0, data_map.sample_time_s
    if data_map.time is not None:
        seconds = columns[data_map.time.column] * FACTORS["s"][data_map.time.unit]
        if data_map.resample_s is None:
            start, step = even_grid(seconds, str(path), data_map.time.column, first)
        else:
            step = data_map.resample_s
            uneven = {**columns, data_map.time.column: seconds}
            start, columns = on_even_grid(uneven, data_map.time.column, step, str(path), first)
    signals, units = {}, {}
    for name, signal in data_map.signals.items():
        check_finite(columns[signal.column], str(path), signal.column, first)
        factor, units[name] = factor_to_si(name, signal.unit, signal.keep_unit)
        signals[name] = (columns[signal.column] * signal.scale + signal.offset) * factor
    assert step is not None
    return Run(step, signals, start, str(path), units)


def _rows(path: Path, columns: Columns, data_map: DataMap) -> Columns:
    lengths = {name: len(values) for name, values in columns.items()}
    longest = max(lengths, key=lambda name: lengths[name])
    for name, length in lengths.items():
        if length != lengths[longest]:
            raise RecordError(f"{path}: column {name!r} has {length} rows, but {longest!r} has {lengths[longest]}")
    start, stop = data_map.rows or (0, lengths[longest])
    if stop > lengths[longest]:
        raise RecordError(f"{path}: rows {start} to {stop} asked for, the file has {lengths[longest]}")
    if stop - start < 2:
        raise RecordError(f"{path}: {stop - start} rows; a run needs at least 2")
    return {name: values[start:stop] for name, values in columns.items()}
