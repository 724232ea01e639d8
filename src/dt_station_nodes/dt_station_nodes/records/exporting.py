"""Tables for other programs: CSV and Parquet, streamed so that a long bag needs little memory."""

from collections.abc import Iterator, Sequence
from enum import Enum
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet

from ..core.run import SIGNALS, Run
from .bag import Bag
from .errors import RecordError
from .tables import TIME, pieces, write_csv


class TableKind(str, Enum):
    """File formats we write."""

    CSV = "csv"
    PARQUET = "parquet"


def export_run(run: Run, path: Path, kind: TableKind) -> int:
    """Write a run's table; returns the number of rows."""
    if kind is TableKind.CSV:
        write_csv(run, path)
    else:
        names = [name for name in SIGNALS if name in run.signals]
        units = {b"source": run.source.encode(), **{n.encode(): run.unit(n).encode() for n in names}}
        schema = pa.schema([(name, pa.float64()) for name in (TIME, *names)], metadata=units)
        with pyarrow.parquet.ParquetWriter(path, schema) as writer:
            for columns in pieces(run, names):
                writer.write_table(pa.table(columns, schema=schema))
    return len(run)


def export_topic(bag: Bag, topic: str, path: Path, kind: TableKind) -> int:
    """Write every message of a topic, one row each, fields named with dots; returns the number of rows."""
    writer = None
    rows = 0
    try:
        for batch in _batches(bag, topic):
            if writer is None:
                opener = pyarrow.csv.CSVWriter if kind is TableKind.CSV else pyarrow.parquet.ParquetWriter
                writer = opener(path, batch.schema)
            writer.write_table(batch)
            rows += batch.num_rows
    except pa.ArrowInvalid as error:
        raise RecordError(f"{bag.path}: {topic} makes no table ({error})") from None
    finally:
        if writer is not None:
            writer.close()
    return rows


def _batches(bag: Bag, topic: str) -> Iterator[pa.Table]:
    names: Sequence[str] | None = None
    for log_time, table in bag.tables(topic):
        fields = table.dtype.names or ()
        if names is None:
            names = fields
        elif fields != names:
            raise RecordError(f"{bag.path}: messages on {topic} differ in their fields; they make no table")
        columns: dict[str, object] = {"log_time_ns": log_time}
        for name in fields:
            values = np.ascontiguousarray(table[name])
            if values.ndim > 1:
                values = [row.tolist() for row in values]  # type: ignore[assignment]
            elif values.dtype.kind == "S":
                values = np.char.decode(values, "utf-8", "replace")
            columns[name] = pa.array(values)
        yield pa.table(columns)


def table_topics(bag: Bag) -> list[str]:
    """Topics with messages, in the order of the bag."""
    return [name for name, topic in bag.topics.items() if topic.info.count]


def file_name(topic: str, kind: TableKind) -> str:
    """A topic's table: /station/object/state -> station.object.state.csv."""
    return topic.strip("/").replace("/", ".") + "." + kind.value
