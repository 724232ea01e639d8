"""The virtual rig as a backend of the DAQ bridge."""

from ..backend import Applied, Reading
from .rig import RigInput, VirtualRig


class VirtualBackend:
    """A virtual rig behind the backend's door; `write` lets one sample time of simulated time pass."""

    def __init__(self, rig: VirtualRig) -> None:
        """Hold the rig; it starts at rest with each `open`."""
        self._rig = rig
        self._state = rig.initial_state()

    @property
    def sample_time_s(self) -> float:
        """Time between two reads, s."""
        return self._rig.sample_time_s

    def open(self) -> None:
        """Put the rig to rest, and have its physics compiled before the first sample."""
        rest = self._rig.initial_state()
        self._rig.step(rest, RigInput(0.0, 0.0))
        self._state = rest

    def read(self) -> Reading:
        """The sensors' values at this sample."""
        pressure, position, flags = self._rig.read(self._state)
        return Reading(position, pressure, flags)

    def write(self, load_voltage_v: float, servo_voltage_v: float) -> Applied:
        """Apply voltages (V) for one sample time."""
        given = RigInput(load_voltage_v, servo_voltage_v)
        load, servo, flags = self._rig.drive(given)
        self._state, _ = self._rig.step(self._state, given)
        return Applied(load, servo, flags)

    def close(self) -> None:
        """Nothing to let go of."""
