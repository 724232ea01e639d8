"""The run in a bag: what the object did, beside the set-points its controllers acted on."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..core.run import Array, Run
from .bag import Bag
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
_STAMP = ("header.stamp.sec", "header.stamp.nanosec")
Numbers = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class PlantStates:
    """Samples of one run in order: sequence numbers, stamps (ns) and signals, all of shape (n,)."""

    what: str
    sequence: Numbers
    stamp_ns: Numbers
    signals: dict[str, Array]

    def pick(self, rows: slice | NDArray[np.intp] | NDArray[np.bool_]) -> "PlantStates":
        """Some of the samples."""
        signals = {name: values[rows] for name, values in self.signals.items()}
        return PlantStates(self.what, self.sequence[rows], self.stamp_ns[rows], signals)

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


def run_from_bag(
    path: str | Path,
    ending: str = STATE,
    number: int | None = None,
    from_s: float | None = None,
    to_s: float | None = None,
) -> Run:
    """The run in a bag, from the topic that ends in `ending`; raises RecordError unless it is whole.

    Measured quantities come from the plant state, set-points from the commands for the same samples, voltages from
    the plant state after: a state carries those that led to it, a row those applied from it on. The last row takes its
    own commands, or is left out where they were not recorded.
    A bag in which the numbering began anew holds several runs; `number` (from 1) chooses. `from_s` and `to_s` (s on
    the run's own time axis) choose a stretch.
    """
    with Bag(path) as bag:
        whole = plant_states(bag, ending, number)
        chosen = np.flatnonzero(window(whole, from_s, to_s))
        step = whole.pick(chosen).sample_time_s()
        states = _with_voltages_to_come(bag, whole, chosen)
        signals: dict[str, Array] = {}
        for signal, topic in COMMANDS.items():
            values = _column_at(bag, topic, "setpoint", states.stamp_ns, "right")
            if values is None:
                values = _column_at(bag, SETPOINTS[signal], "value", states.stamp_ns, "left")
            if values is not None:
                signals[signal] = values
        signals.update(states.signals)
        # a channel that is not there at all reads not-a-number throughout
        signals = {name: values for name, values in signals.items() if not np.isnan(values).all()}
        first = int(states.sequence[0])
        for name, values in signals.items():
            check_finite(values, states.what, name, first)
        if not signals:
            raise RecordError(f"{states.what} holds no signal at all")
        return Run(step, signals, first * step, str(path))


def _with_voltages_to_come(bag: Bag, whole: PlantStates, chosen: NDArray[np.intp]) -> PlantStates:
    """The chosen samples, in a row and at least two, with the voltages applied from each until the next."""
    states, last = whole.pick(chosen), int(chosen[-1])
    followed = last + 1 < len(whole.sequence) and whole.sequence[last + 1] == whole.sequence[last] + 1
    for signal, topic in _VOLTAGES.items():
        values = np.append(states.signals[signal][1:], np.nan)
        if followed:
            values[-1] = whole.signals[signal][last + 1]
        else:
            values[-1] = _command_at(bag, topic, int(states.stamp_ns[-1]))
        states.signals[signal] = values
    complete = all(np.isfinite(states.signals[signal][-1]) for signal in _VOLTAGES)
    return states if complete else states.pick(slice(0, -1))


def _command_at(bag: Bag, ending: str, stamp_ns: int) -> float:
    """The voltage of the command that answers the sample of a stamp; NaN where none was recorded."""
    topic = bag.find(ending)
    if topic is None:
        return float("nan")
    columns = bag.columns(topic, [*_STAMP, "voltage"])
    if not len(columns["log_time"]):
        return float("nan")
    found = np.flatnonzero(_stamps(columns) == stamp_ns)
    return float(columns["voltage"][found[-1]]) if len(found) else float("nan")


def window(states: PlantStates, from_s: float | None, to_s: float | None) -> NDArray[np.bool_]:
    """Samples whose time (s, from sample 0) lies in from_s to to_s (exclusive)."""
    if len(states.sequence) < 2:
        return np.ones(len(states.sequence), np.bool_)
    steps = np.diff(states.stamp_ns) / np.diff(states.sequence)
    time = states.sequence * float(np.median(steps)) * 1e-9
    chosen = np.ones(len(time), np.bool_)
    if from_s is not None:
        chosen &= time >= from_s - 1e-9
    if to_s is not None:
        chosen &= time < to_s - 1e-9
    return chosen


def plant_states(bag: Bag, ending: str, number: int | None = None) -> PlantStates:
    """Samples of the plant state topic that ends in `ending`; raises RecordError."""
    topic = bag.find(ending, PLANT_STATE)
    if topic is None:
        known = ", ".join(bag.topics) or "none"
        raise RecordError(f"{bag.path}: no topic {ending} of type {PLANT_STATE}; the bag has {known}")
    columns = bag.columns(topic, ["sequence", *_STAMP, *_FIELDS.values()])
    check_numbers(columns, _FIELDS.values(), f"{bag.path}: {topic}")
    states = PlantStates(
        f"{bag.path}: {topic}",
        columns["sequence"].astype(np.int64),
        _stamps(columns),
        {signal: columns[name].astype(np.float64) for signal, name in _FIELDS.items()},
    )
    starts = [0, *(np.flatnonzero(np.diff(states.sequence) <= 0) + 1).tolist(), len(states.sequence)]
    runs = len(starts) - 1
    if runs > 1 and number is None:
        raise RecordError(f"{states.what} holds {runs} runs; export one with --run 1 to --run {runs}")
    if number is not None and not 1 <= number <= runs:
        raise RecordError(f"{states.what} holds {runs} runs; there is no run {number}")
    return states if number is None else states.pick(slice(starts[number - 1], starts[number]))


def check_numbers(columns: Mapping[str, NDArray[np.generic]], names: Iterable[str], what: str) -> None:
    """Raise RecordError where a field is not the float64 that our messages have."""
    for name in names:
        if len(columns[name]) and columns[name].dtype != np.float64:
            raise RecordError(
                f"{what}: the field {name} is {columns[name].dtype}, not float64; these are not our messages"
            )


def _stamps(columns: dict[str, NDArray[np.generic]]) -> Numbers:
    seconds, nanoseconds = (columns[name].astype(np.int64) for name in _STAMP)
    return np.asarray(seconds * 1_000_000_000 + nanoseconds)


def _column_at(bag: Bag, ending: str, field: str, stamp_ns: Numbers, side: str) -> Array | None:
    """A topic's field at stamps: the last value not after (right) or before (left) each, the first before any."""
    topic = bag.find(ending)
    if topic is None:
        return None
    columns = bag.columns(topic, [*_STAMP, field])
    if not len(columns["log_time"]):
        return None
    stamps, values = _stamps(columns), columns[field].astype(np.float64)
    order = np.argsort(stamps, kind="stable")
    place = np.searchsorted(stamps[order], stamp_ns, side="right" if side == "right" else "left") - 1
    return np.ascontiguousarray(values[order][np.clip(place, 0, None)])


def common_samples(first: PlantStates, second: PlantStates) -> Sequence[PlantStates]:
    """The samples that both have, by sequence number."""
    _, left, right = np.intersect1d(first.sequence, second.sequence, return_indices=True)
    return first.pick(left), second.pick(right)
