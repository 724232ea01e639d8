"""Whole columns of a topic with little memory beside them: a day at 50 Hz is 35 MB a column."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .bag import Bag
from .errors import RecordError

STAMP_NS = "stamp_ns"
_STAMP = ("header.stamp.sec", "header.stamp.nanosec")
Column = NDArray[np.generic]


def columns_of(bag: Bag, topic: str, names: Sequence[str]) -> dict[str, Column]:
    """Fields of a topic, shape (n,), in order of log time; `stamp_ns` is the header's stamp, int64.

    Raises RecordError where the topic has no such field.
    """
    count = bag.topics[topic].info.count
    found: dict[str, Column] = {}
    at, last = 0, np.iinfo(np.int64).min
    for log_time, table in bag.tables(topic):
        stop = at + len(table)
        ordered = log_time[0] >= last and bool((log_time[1:] >= log_time[:-1]).all())
        for name in names:
            values = _field(bag, topic, table, name)
            held = found.setdefault(name, np.empty(count, values.dtype))
            if not ordered or stop > count or held.dtype != values.dtype:
                return _sorted(bag, topic, names)
            held[at:stop] = values
        at, last = stop, log_time[-1]
    return {name: found[name][:at] if name in found else np.empty(0) for name in names}


def _field(bag: Bag, topic: str, table: NDArray[Any], name: str) -> Column:
    parts = _STAMP if name == STAMP_NS else (name,)
    for part in parts:
        if part not in (table.dtype.names or ()):
            raise RecordError(f"{bag.path}: {topic} has no field {part!r}")
    return stamps(table[_STAMP[0]], table[_STAMP[1]]) if name == STAMP_NS else table[name]


def _sorted(bag: Bag, topic: str, names: Sequence[str]) -> dict[str, Column]:
    """The same of a bag whose messages are not in order."""
    fields = [part for name in names for part in (_STAMP if name == STAMP_NS else (name,))]
    columns = bag.columns(topic, list(dict.fromkeys(fields)))
    return {name: stamps(*(columns[p] for p in _STAMP)) if name == STAMP_NS else columns[name] for name in names}


def stamps(seconds: Column, nanoseconds: Column) -> NDArray[np.int64]:
    """Stamps in ns of their two parts."""
    whole: NDArray[np.int64] = seconds.astype(np.int64)
    whole *= 1_000_000_000
    whole += nanoseconds.astype(np.int64)
    return whole
