"""The run in a bag: what the object did, beside the set-points its controllers acted on."""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..core.run import SIGNALS, Array, Run
from .bag import Bag
from .columns import STAMP_NS, columns_of
from .errors import RecordError
from .grid import check_finite, even_grid

STATE = "object/state"
TWIN = "twin/state"
COMMANDS = {"pressure_setpoint_pa": "load/command", "position_setpoint_m": "position/command"}
SETPOINTS = {"pressure_setpoint_pa": "load/setpoint", "position_setpoint_m": "position/setpoint"}
PLANT_STATE = "dt_station_msgs/msg/PlantState"
_VOLTAGES = {"load_voltage_v": "load/command", "servo_voltage_v": "position/command"}
_FIELDS = {
    "pressure_pa": "pressure",
    "position_m": "position",
    "load_voltage_v": "load_voltage",
    "servo_voltage_v": "servo_voltage",
}
_STRIDE = 1 << 16
Numbers = NDArray[np.int64]
Rows = slice | NDArray[np.intp]


@dataclass(frozen=True, slots=True)
class Samples:
    """Samples of a plant state topic in order: numbers and stamps (ns) of shape (n,), and their rows in the topic."""

    what: str
    topic: str
    sequence: Numbers
    stamp_ns: Numbers
    rows: Rows

    def pick(self, chosen: slice | NDArray[np.intp] | NDArray[np.bool_]) -> "Samples":
        """Some of the samples."""
        if isinstance(chosen, slice) and chosen == slice(None):
            return self
        stop = self.rows.stop if isinstance(self.rows, slice) else int(self.rows.max(initial=-1)) + 1
        rows = np.arange(stop)[self.rows][chosen]
        whole = len(rows) > 0 and rows[-1] - rows[0] + 1 == len(rows) and bool((np.diff(rows) == 1).all())
        compact = slice(int(rows[0]), int(rows[-1]) + 1) if whole else rows
        return Samples(self.what, self.topic, self.sequence[chosen], self.stamp_ns[chosen], compact)

    def bare(self) -> "Samples":
        """The rows alone, without numbers and stamps."""
        return Samples(self.what, self.topic, self.sequence[:0].copy(), self.stamp_ns[:0].copy(), self.rows)

    def sample_time_s(self) -> float:
        """Sample time of an even, gapless run; raises RecordError with what is missing."""
        if len(self.sequence) < 2:
            raise RecordError(f"{self.what} has {len(self.sequence)} samples; a run needs at least 2")
        gaps = np.flatnonzero(np.diff(self.sequence) != 1)
        if gaps.size:
            k = int(gaps[0])
            raise RecordError(
                f"{self.what}: samples {self.sequence[k] + 1} to {self.sequence[k + 1] - 1} are missing "
                f"({int((np.diff(self.sequence) - 1).sum())} in all); export a whole stretch with --from and --to"
            )
        seconds = (self.stamp_ns - self.stamp_ns[0]) * 1e-9
        return even_grid(seconds, self.what, "header.stamp", int(self.sequence[0]))[1]

    def columns(self, bag: Bag, names: Collection[str]) -> dict[str, Array]:
        """Signals of the whole topic, of which these samples are `rows`; raises RecordError unless they are numbers."""
        fields = [_FIELDS[name] for name in names]
        columns = columns_of(bag, self.topic, fields)
        check_numbers(columns, fields, self.what)
        return {name: np.asarray(columns[_FIELDS[name]], dtype=np.float64) for name in names}


def run_from_bag(
    path: str | Path,
    ending: str = STATE,
    number: int | None = None,
    from_s: float | None = None,
    to_s: float | None = None,
    only: Collection[str] = SIGNALS,
) -> Run:
    """The run in a bag, from the topic that ends in `ending`; raises RecordError unless it is whole.

    Measured quantities come from the plant state, set-points from the commands for the same samples, voltages from
    the plant state after: a state carries those that led to it, a row those applied from it on. The last row takes its
    own commands, or is left out where they were not recorded.
    A bag in which the numbering began anew holds several runs; `number` (from 1) chooses. `from_s` and `to_s` (s on
    the run's own time axis) choose a stretch, `only` the signals.
    """
    with Bag(path) as bag:
        whole = plant_samples(bag, ending, number)
        chosen = window(whole, from_s, to_s)
        samples = whole.pick(chosen)
        step = samples.sample_time_s()
        last = _last_voltages(bag, whole, samples) if set(only) & set(_VOLTAGES) else {}
        if any(np.isnan(value) for value in last.values() if value is not None):
            samples, last = samples.pick(slice(0, -1)), dict.fromkeys(last)
        signals = _setpoints(bag, samples.stamp_ns, only)
        first, source = int(samples.sequence[0]), samples.what
        states = samples.bare()
        del whole, chosen, samples  # a long bag's numbers and stamps make room for its signals
        signals.update(_states(bag, states, last, [name for name in _FIELDS if name in only]))
        # a channel that is not there at all reads not-a-number throughout
        signals = {name: values for name, values in signals.items() if not np.isnan(values).all()}
        for name, values in signals.items():
            check_finite(values, source, name, first)
        if not signals:
            raise RecordError(f"{source} holds no signal at all")
        return Run(step, signals, first * step, str(path))


def _last_voltages(bag: Bag, whole: Samples, samples: Samples) -> dict[str, float | None]:
    """The voltages from the last of the samples on: None where the next sample tells, NaN where nothing does."""
    place = int(np.searchsorted(whole.sequence, samples.sequence[-1]))
    if place + 1 < len(whole.sequence) and whole.sequence[place + 1] == whole.sequence[place] + 1:
        return dict.fromkeys(_VOLTAGES)
    stamp_ns = int(samples.stamp_ns[-1])
    return {signal: _command_at(bag, topic, stamp_ns) for signal, topic in _VOLTAGES.items()}


def _states(bag: Bag, samples: Samples, last: Mapping[str, float | None], names: Collection[str]) -> dict[str, Array]:
    """Signals of the state topic, voltages those applied from each sample until the next."""
    columns = samples.columns(bag, names)
    final = samples.rows.stop - 1 if isinstance(samples.rows, slice) else int(samples.rows[-1])
    for name in names:
        # in place of the whole column, so that a long bag fits into memory once
        column = columns[name]
        columns[name] = column[samples.rows]
        if name in _VOLTAGES:
            told = last[name]
            columns[name] = np.append(columns[name][1:], column[final + 1] if told is None else told)
    return columns


def _setpoints(bag: Bag, stamp_ns: Numbers, only: Collection[str]) -> dict[str, Array]:
    """What the controllers acted on, or where that was not recorded what was published."""
    found = {}
    for signal, topic in COMMANDS.items():
        if signal not in only:
            continue
        values = _column_at(bag, topic, "setpoint", stamp_ns, "right")
        if values is None:
            values = _column_at(bag, SETPOINTS[signal], "value", stamp_ns, "left")
        if values is not None:
            found[signal] = values
    return found


def _command_at(bag: Bag, ending: str, stamp_ns: int) -> float:
    """The voltage of the command that answers the sample of a stamp; NaN where none was recorded."""
    topic = bag.find(ending)
    if topic is None:
        return float("nan")
    columns = columns_of(bag, topic, [STAMP_NS, "voltage"])
    found = np.flatnonzero(columns[STAMP_NS] == stamp_ns)
    return float(columns["voltage"][found[-1]]) if len(found) else float("nan")


def window(samples: Samples, from_s: float | None, to_s: float | None) -> slice | NDArray[np.bool_]:
    """Samples whose time (s, from sample 0) lies in from_s to to_s (exclusive)."""
    if len(samples.sequence) < 2 or (from_s is None and to_s is None):
        return slice(None)
    steps = np.diff(samples.stamp_ns) / np.diff(samples.sequence)
    time = samples.sequence * float(np.median(steps)) * 1e-9
    chosen = np.ones(len(time), np.bool_)
    if from_s is not None:
        chosen &= time >= from_s - 1e-9
    if to_s is not None:
        chosen &= time < to_s - 1e-9
    return chosen


def plant_samples(bag: Bag, ending: str, number: int | None = None) -> Samples:
    """Samples of the plant state topic that ends in `ending`; raises RecordError."""
    topic = bag.find(ending, PLANT_STATE)
    if topic is None:
        known = ", ".join(bag.topics) or "none"
        raise RecordError(f"{bag.path}: no topic {ending} of type {PLANT_STATE}; the bag has {known}")
    columns = columns_of(bag, topic, ["sequence", STAMP_NS])
    sequence = columns.pop("sequence").astype(np.int64)
    stamp_ns: Numbers = columns.pop(STAMP_NS).astype(np.int64, copy=False)
    samples = Samples(f"{bag.path}: {topic}", topic, sequence, stamp_ns, slice(0, len(sequence)))
    starts = [0, *(np.flatnonzero(np.diff(sequence) <= 0) + 1).tolist(), len(sequence)]
    runs = len(starts) - 1
    if runs > 1 and number is None:
        raise RecordError(f"{samples.what} holds {runs} runs; export one with --run 1 to --run {runs}")
    if number is not None and not 1 <= number <= runs:
        raise RecordError(f"{samples.what} holds {runs} runs; there is no run {number}")
    return samples if number is None else samples.pick(slice(starts[number - 1], starts[number]))


def check_numbers(columns: Mapping[str, NDArray[np.generic]], names: Iterable[str], what: str) -> None:
    """Raise RecordError where a field is not the float64 that our messages have."""
    for name in names:
        if len(columns[name]) and columns[name].dtype != np.float64:
            raise RecordError(
                f"{what}: the field {name} is {columns[name].dtype}, not float64; these are not our messages"
            )


def _column_at(bag: Bag, ending: str, field: str, stamp_ns: Numbers, side: Literal["left", "right"]) -> Array | None:
    """A topic's field at stamps: the last value not after (right) or before (left) each, the first before any."""
    topic = bag.find(ending)
    if topic is None:
        return None
    columns = columns_of(bag, topic, [STAMP_NS, field])
    stamps: Numbers = columns[STAMP_NS].astype(np.int64, copy=False)
    values = columns[field].astype(np.float64, copy=False)
    if not len(values):
        return None
    if not (stamps[1:] >= stamps[:-1]).all():
        order = np.argsort(stamps, kind="stable")
        stamps, values = stamps[order], values[order]
    found = np.empty(len(stamp_ns))
    for at in range(0, len(found), _STRIDE):
        place = np.searchsorted(stamps, stamp_ns[at : at + _STRIDE], side=side) - 1
        found[at : at + _STRIDE] = values[np.clip(place, 0, None)]
    return found


def common_samples(first: Samples, second: Samples) -> tuple[Samples, Samples]:
    """The samples that both have, by sequence number."""
    if np.array_equal(first.sequence, second.sequence):
        return first, second
    _, left, right = np.intersect1d(first.sequence, second.sequence, return_indices=True)
    return first.pick(left), second.pick(right)
