"""What a bag holds for verifying: the samples of each run, and beside each the messages that answered it."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..core.channels import Channel
from ..core.samples import PlantSample, SampleFlag, Setpoint
from .bag import Bag
from .bagrun import PLANT_STATE, STATE, TWIN, check_numbers
from .errors import RecordError
from .rerun import Output

COMMAND_FIELDS = ("voltage", "setpoint", "mode", "limited")
STATE_FIELDS = ("position", "pressure", "load_voltage", "servo_voltage")
RESIDUAL_FIELDS = tuple(
    f"{channel}_{figure}" for channel in ("position", "pressure") for figure in ("residual", "ise", "rms", "fit")
)
TOPICS = {Channel.PRESSURE: "load", Channel.POSITION: "position"}
_WHOLE = {"sequence", "flags", "mode", "limited", "streaming"}
_STAMP = ("header.stamp.sec", "header.stamp.nanosec")


@dataclass(frozen=True)
class Evidence:
    """One bag, keyed by stamp (ns): samples in order with their log times, and what answered each."""

    samples: list[PlantSample]
    log_time: list[int]
    starts: list[int]
    commands: Mapping[Channel, Mapping[int, Output]]
    setpoints: Mapping[Channel, Mapping[tuple[int, int], Setpoint]]
    twin: Mapping[int, PlantSample]
    residuals: Mapping[int, Output]

    def runs(self) -> list[tuple[int, int]]:
        """First and last (exclusive) sample of each run."""
        return list(zip(self.starts, [*self.starts[1:], len(self.samples)], strict=True))


def gather(bag: Bag) -> Evidence:
    """Read what a bag holds; raises RecordError without samples of the object."""
    state = bag.find(STATE, PLANT_STATE)
    if state is None:
        raise RecordError(f"{bag.path}: no topic {STATE}; there is nothing to verify")
    samples, log_time = _plant(bag, state)
    if not samples:
        raise RecordError(f"{bag.path}: no sample on {state}; there is nothing to verify")
    starts = [0, *(i for i in range(1, len(samples)) if samples[i].sequence <= samples[i - 1].sequence)]
    twin = bag.find(TWIN, PLANT_STATE)
    simulated = {sample.stamp_ns: sample for sample in _plant(bag, twin)[0]} if twin else {}
    commands = {channel: _outputs(bag, f"{name}/command", COMMAND_FIELDS) for channel, name in TOPICS.items()}
    setpoints = {channel: _setpoints(bag, f"{name}/setpoint") for channel, name in TOPICS.items()}
    return Evidence(
        samples, log_time, starts, commands, setpoints, simulated, _outputs(bag, "shadow/residual", RESIDUAL_FIELDS)
    )


def _columns(bag: Bag, topic: str, names: tuple[str, ...]) -> tuple[list[int], list[int], list[list[float]]]:
    """Log times, stamps and the named fields as Python numbers."""
    columns = bag.columns(topic, [*_STAMP, *names])
    check_numbers(columns, set(names) - _WHOLE, f"{bag.path}: {topic}")
    stamps = columns[_STAMP[0]].astype(np.int64) * 1_000_000_000 + columns[_STAMP[1]].astype(np.int64)
    return columns["log_time"].tolist(), stamps.tolist(), [columns[name].tolist() for name in names]


def _plant(bag: Bag, topic: str) -> tuple[list[PlantSample], list[int]]:
    times, stamps, columns = _columns(bag, topic, ("sequence", *STATE_FIELDS, "flags"))
    samples = [
        PlantSample(int(sequence), stamp, position, pressure, load, servo, SampleFlag(int(flags)))
        for stamp, sequence, position, pressure, load, servo, flags in zip(stamps, *columns, strict=True)
    ]
    return samples, times


def _outputs(bag: Bag, ending: str, names: tuple[str, ...]) -> dict[int, Output]:
    topic = bag.find(ending)
    if topic is None:
        return {}
    _, stamps, columns = _columns(bag, topic, names)
    return {stamp: tuple(map(float, row)) for stamp, row in zip(stamps, zip(*columns, strict=True), strict=True)}


def _setpoints(bag: Bag, ending: str) -> dict[tuple[int, int], Setpoint]:
    """By (stamp of the sample reacted to, number)."""
    topic = bag.find(ending)
    if topic is None:
        return {}
    _, stamps, columns = _columns(bag, topic, ("sequence", "value", "streaming"))
    found = [
        Setpoint(int(sequence), stamp, value, bool(streaming))
        for stamp, sequence, value, streaming in zip(stamps, *columns, strict=True)
    ]
    return {(setpoint.stamp_ns, setpoint.sequence): setpoint for setpoint in found}


def output_of(sample: PlantSample | None) -> Output | None:
    """A plant sample as a comparable output, fields as in STATE_FIELDS and flags."""
    if sample is None:
        return None
    return (
        sample.position_m,
        sample.pressure_pa,
        sample.load_voltage_v,
        sample.servo_voltage_v,
        float(int(sample.flags)),
    )
