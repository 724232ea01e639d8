"""The run in a bag: what the object did, beside the set-points its controllers acted on."""

from collections.abc import Sequence
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
_STATE_FIELDS = {
    "pressure_pa": "pressure",
    "position_m": "position",
    "load_voltage_v": "load_voltage",
    "servo_voltage_v": "servo_voltage",
}
PLANT_STATE = "dt_station_msgs/msg/PlantState"
_STAMP = ("header.stamp.sec", "header.stamp.nanosec")
Sequence64 = NDArray[np.int64]


def run_from_bag(path: str | Path, ending: str = STATE) -> Run:
    """The run in a bag, from the topic that ends in `ending`; raises RecordError unless it is whole.

    Voltages and measured quantities come from the plant state, set-points from the commands for the same samples.
    """
    with Bag(path) as bag:
        topic = bag.find(ending, PLANT_STATE)
        if topic is None:
            raise RecordError(
                f"{path}: no topic {ending} of type {PLANT_STATE}; the bag has {', '.join(bag.topics) or 'none'}"
            )
        sequence, stamps, table = plant_states(bag, topic)
        first, step = sampling(sequence, stamps, f"{path}: {topic}")
        signals: dict[str, Array] = {}
        for signal, name in (*COMMANDS.items(), *SETPOINTS.items()):
            if signal not in signals:
                values = _setpoints(bag, name, sequence)
                if values is not None:
                    signals[signal] = values
        signals.update(table)
        # a channel that is not there at all reads not-a-number throughout
        signals = {name: values for name, values in signals.items() if not np.isnan(values).all()}
        for name, values in signals.items():
            check_finite(values, f"{path}: {topic}", name, first)
        return Run(step, signals, first * step, str(path))


def plant_states(bag: Bag, topic: str) -> tuple[Sequence64, Sequence64, dict[str, Array]]:
    """Sequence numbers, stamps (ns) and signals of a plant state topic, in order of sequence."""
    columns = bag.columns(topic, ["sequence", *_STAMP, *_STATE_FIELDS.values()])
    for name in _STATE_FIELDS.values():
        if len(columns["sequence"]) and columns[name].dtype.kind != "f":
            raise RecordError(f"{bag.path}: the field {name} of {topic} is no floating-point number")
    sequence = columns["sequence"].astype(np.int64)
    stamps = columns[_STAMP[0]].astype(np.int64) * 1_000_000_000 + columns[_STAMP[1]].astype(np.int64)
    table = {signal: columns[name].astype(np.float64) for signal, name in _STATE_FIELDS.items()}
    if len(sequence) > 1 and not (np.diff(sequence) > 0).all():
        back = int(np.flatnonzero(np.diff(sequence) <= 0)[0])
        raise RecordError(
            f"{bag.path}: {topic} holds more than one run: sample {sequence[back + 1]} follows {sequence[back]}; "
            "export the stretch you want with --from and --to"
        )
    return sequence, stamps, table


def sampling(sequence: Sequence64, stamps: Sequence64, what: str) -> tuple[int, float]:
    """First sequence number and sample time (s) of a gapless topic; raises RecordError."""
    if len(sequence) < 2:
        raise RecordError(f"{what} has {len(sequence)} samples; a run needs at least 2")
    gaps = np.flatnonzero(np.diff(sequence) != 1)
    if gaps.size:
        k = int(gaps[0])
        raise RecordError(
            f"{what}: samples {sequence[k] + 1} to {sequence[k + 1] - 1} are missing "
            f"({int((np.diff(sequence) - 1).sum())} in all); export the stretch you want with --from and --to"
        )
    _, step = even_grid((stamps - stamps[0]) * 1e-9, what, "header.stamp", int(sequence[0]))
    return int(sequence[0]), step


def _setpoints(bag: Bag, ending: str, sequence: Sequence64) -> Array | None:
    """Set-points at the samples asked for; those without one take the last before (the first after at the start)."""
    topic = bag.find(ending)
    if topic is None:
        return None
    field = "setpoint" if ending.endswith("command") else "value"
    columns = bag.columns(topic, ["sequence", field])
    numbers, values = columns["sequence"].astype(np.int64), columns[field].astype(np.float64)
    if not len(numbers):
        return None
    order = np.argsort(numbers, kind="stable")
    numbers, values = numbers[order], values[order]
    place = np.searchsorted(numbers, sequence, side="right") - 1
    return np.ascontiguousarray(values[np.clip(place, 0, None)])


def common_samples(first: Sequence64, second: Sequence64) -> Sequence[NDArray[np.intp]]:
    """Places in both of the sequence numbers that both have."""
    _, left, right = np.intersect1d(first, second, return_indices=True)
    return left, right
