"""The common face of the control laws."""

from typing import Protocol, TypeVar

from .signals import ControlInput

Memory = TypeVar("Memory")


class Law(Protocol[Memory]):
    """A control law: a frozen configuration at one sample time, with an explicit memory."""

    def initial(self) -> Memory:
        """The memory of a controller at rest."""
        ...

    def step(self, memory: Memory, given: ControlInput) -> tuple[Memory, float]:
        """One sample: the next memory and the voltage wanted (V), before any limit."""
        ...

    def cut(self, memory: Memory, excess_v: float) -> Memory:
        """Anti-windup: the memory after the voltage applied differed from the one wanted by `excess_v` (V)."""
        ...

    def take_over(self, voltage_v: float, last: ControlInput, kept: object) -> tuple[Memory, float]:
        """Bumpless start at a running voltage (V): the memory, and the offset (V) it cannot take on itself.

        `kept` is the memory of the law before; a law of the same kind goes on with what it holds.
        """
        ...
