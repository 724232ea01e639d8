"""Manual: the operator's voltage."""

from .signals import ControlInput


class ManualLaw:
    """A constant voltage; remembers nothing."""

    __slots__ = ("_voltage_v",)

    def __init__(self, voltage_v: float) -> None:
        self._voltage_v = voltage_v

    def initial(self) -> None:
        """Nothing to remember."""

    def step(self, memory: None, given: ControlInput) -> tuple[None, float]:
        """The voltage (V)."""
        return None, self._voltage_v

    def cut(self, memory: None, excess_v: float) -> None:
        """Nothing winds up."""

    def take_over(self, voltage_v: float, last: ControlInput, kept: object) -> tuple[None, float]:
        """All of the difference is left over."""
        return None, voltage_v - self._voltage_v
