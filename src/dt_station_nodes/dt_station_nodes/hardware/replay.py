"""Measured data as an object: the sensors say what they said then, whatever is asked of the valves."""

import math

from ..core.run import Run
from .backend import Applied, Reading


class ReplayBackend:
    """A run behind the backend's door: row k is sample k, and the last row ends it.

    A quantity that the run did not measure reads not-a-number, which the graph takes as an absent channel; a
    voltage that it did not record was 0.
    """

    def __init__(self, run: Run) -> None:
        """Take the columns (SI, or the units the run states)."""
        self._run = run
        absent = {"position_m": math.nan, "pressure_pa": math.nan, "load_voltage_v": 0.0, "servo_voltage_v": 0.0}
        self._columns = [
            [value] * len(run) if (column := run.get(name)) is None else column.tolist()
            for name, value in absent.items()
        ]
        self._row = 0

    @property
    def sample_time_s(self) -> float:
        """Time between two rows, s."""
        return self._run.sample_time_s

    def open(self) -> None:
        """Start at the first row."""
        self._row = 0

    def read(self) -> Reading:
        """The row's measured values; the last row again once the run has ended."""
        position, pressure, _, _ = self._columns
        return Reading(position[self._row], pressure[self._row], ended=self._row == len(self._run) - 1)

    def write(self, load_voltage_v: float, servo_voltage_v: float) -> Applied:
        """Go on to the next row; returns the voltages that were applied from this one on."""
        _, _, load, servo = self._columns
        applied = Applied(load[self._row], servo[self._row])
        self._row = min(self._row + 1, len(self._run) - 1)
        return applied

    def close(self) -> None:
        """Nothing to let go of."""
