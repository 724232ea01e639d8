"""A scripted object for tests of whatever stands before the backend's door."""

from collections.abc import Callable

from .backend import Applied, Reading


class FakeBackend:
    """Plays readings from a script and notes what is written; ends after `samples` reads where given.

    `script(k)` gives the reading of sample k. Without one, position and pressure follow the voltages of the
    sample before: 0.01 m and 1 MPa per volt, so that a test sees what arrived when.
    """

    def __init__(
        self, sample_time_s: float = 0.02, samples: int | None = None, script: Callable[[int], Reading] | None = None
    ) -> None:
        """Set up an object that has been read and written never."""
        self._sample_time_s = sample_time_s
        self._samples = samples
        self._script = script
        self.written: list[tuple[float, float]] = []
        self.is_open = False

    @property
    def sample_time_s(self) -> float:
        """Time between two reads, s."""
        return self._sample_time_s

    def open(self) -> None:
        """Start again with nothing written."""
        self.written.clear()
        self.is_open = True

    def read(self) -> Reading:
        """The script's reading, or the answer to the last voltages."""
        k = len(self.written)
        if self._script is not None:
            return self._script(k)
        load, servo = self.written[-1] if self.written else (0.0, 0.0)
        return Reading(0.01 * servo, 1.0e6 * load, ended=self._samples is not None and k >= self._samples - 1)

    def write(self, load_voltage_v: float, servo_voltage_v: float) -> Applied:
        """Note the voltages; they are applied as they are."""
        self.written.append((load_voltage_v, servo_voltage_v))
        return Applied(load_voltage_v, servo_voltage_v)

    def close(self) -> None:
        """Safe to call twice."""
        self.is_open = False
