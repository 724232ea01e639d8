"""A run: the table of one experiment, one row a sample."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from .channels import Channel

Array = NDArray[np.float64]

SIGNALS = (
    "pressure_setpoint_pa",
    "position_setpoint_m",
    "load_voltage_v",
    "servo_voltage_v",
    "pressure_pa",
    "position_m",
)


@dataclass(frozen=True, slots=True)
class Run:
    """One experiment on an even time grid.

    `signals` holds arrays of shape (n,) under names of `SIGNALS`; absent ones were not measured.
    A row's voltages are those applied from its time until the next row's. Units are SI unless
    `units` says otherwise for a signal (foreign data whose unit is unknown or not pressure or length).
    """

    sample_time_s: float
    signals: Mapping[str, Array]
    start_s: float = 0.0
    source: str = ""
    units: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        lengths = {name: values.shape for name, values in self.signals.items()}
        if len(set(lengths.values())) != 1:
            raise ValueError(f"signals of a run must have one length, got {lengths}")
        unknown = sorted(set(lengths) - set(SIGNALS))
        if unknown:
            raise ValueError(f"unknown signals {unknown}; a run has {', '.join(SIGNALS)}")

    def __len__(self) -> int:
        return len(next(iter(self.signals.values())))

    @property
    def time_s(self) -> Array:
        """Sample times, shape (n,), s."""
        return self.start_s + self.sample_time_s * np.arange(len(self), dtype=np.float64)

    def get(self, signal: str) -> Array | None:
        """The signal, or None where the run did not measure it."""
        return self.signals.get(signal)

    def channels(self) -> tuple[Channel, ...]:
        """Channels with both a voltage and a measured quantity."""
        return tuple(c for c in Channel if c.signal in self.signals and c.voltage_signal in self.signals)

    def unit(self, signal: str) -> str:
        """Unit of a signal: SI by its name unless the run says otherwise."""
        return self.units.get(signal, {"pa": "Pa", "m": "m", "v": "V"}[signal.rsplit("_", 1)[-1]])

    def window(self, start: int, stop: int) -> "Run":
        """Rows start to stop (exclusive), on the same time axis."""
        return Run(
            self.sample_time_s,
            {name: values[start:stop] for name, values in self.signals.items()},
            self.start_s + self.sample_time_s * start,
            self.source,
            self.units,
        )
