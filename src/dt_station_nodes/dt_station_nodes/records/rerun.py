"""Running recorded inputs through a machine again and comparing every output bit for bit.

A machine is a pure step. What a bag does not say exactly, such as before which sample a changed parameter took effect,
is found by trying: the choice that reproduces the recorded outputs is the right one, and if none does, that is
the finding.
"""

import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

State = TypeVar("State")
Output = tuple[float, ...]
HORIZON = 200


class Machine(Protocol[State]):
    """`count` samples in order; `step` answers sample i, `recorded` is what the bag holds for it."""

    @property
    def count(self) -> int:
        """Number of samples."""
        ...

    def initial(self) -> State:
        """The state before the first sample, and after a restart."""
        ...

    def step(self, state: State, i: int) -> tuple[State, Output | None]:
        """The state after sample i and the output for it, None where there is none."""
        ...

    def recorded(self, i: int) -> Output | None:
        """The recorded output for sample i, None where the bag has none."""
        ...


@dataclass(frozen=True, slots=True)
class Change(Generic[State]):
    """A change of the machine that took effect before one of the samples `low` to `high`, probably `likely`."""

    low: int
    likely: int
    high: int
    apply: Callable[[State], State]
    what: str


@dataclass(frozen=True, slots=True)
class Outcome:
    """Samples compared, the first that differs (-1: none), what was computed for it, what was found on the way."""

    compared: int
    differs: int = -1
    computed: Output | None = None
    notes: tuple[str, ...] = ()


def bits(value: float) -> bytes:
    """The bits of a number; all not-a-numbers are one."""
    return b"nan" if value != value else struct.pack("<d", value)  # noqa: PLR0124


def same(a: Output, b: Output) -> bool:
    """Whether two outputs are the same to the last bit."""
    return len(a) == len(b) and all(map(_same_number, a, b))


def _same_number(a: float, b: float) -> bool:
    return bits(float(a)) == bits(float(b))


class Rerun(Generic[State]):
    """Follows a machine through its samples."""

    def __init__(self, machine: Machine[State], changes: Sequence[Change[State]]) -> None:
        self._machine = machine
        self._changes = sorted(changes, key=lambda change: change.likely)
        self._notes: list[str] = []
        self._compared = 0

    def run(self) -> Outcome:
        """Compare all samples, as far as the first that no choice explains."""
        machine, state, i = self._machine, self._machine.initial(), 0
        pending = list(self._changes)
        while i < machine.count:
            if pending and pending[0].low <= i:
                i, state = self._place(pending.pop(0), i, state)
                continue
            if machine.recorded(i) is None:
                i, state = self._gap(i, state)
                continue
            after, computed = machine.step(state, i)
            recorded = machine.recorded(i)
            if computed is None or recorded is None or not same(computed, recorded):
                fresh = self._restarted(i)
                if fresh is None:
                    return Outcome(self._compared, i, computed, tuple(self._notes))
                self._notes.append(f"started anew at sample {i}")
                state = fresh
                continue
            self._compared += 1
            state, i = after, i + 1
        return Outcome(self._compared, notes=tuple(self._notes))

    def _reach(self, state: State, i: int, stop: int) -> int:
        """The first sample from i on that differs, or `stop`."""
        while i < stop:
            recorded = self._machine.recorded(i)
            if recorded is None:
                return stop
            state, computed = self._machine.step(state, i)
            if computed is None or not same(computed, recorded):
                return i
            i += 1
        return stop

    def _place(self, change: Change[State], i: int, state: State) -> tuple[int, State]:
        """Try the places a change may have; returns the sample it took effect before and the state there."""
        machine = self._machine
        low, high = i, max(i, min(change.high, machine.count))
        stop = min(high + HORIZON, machine.count)
        before = [state]
        for k in range(low, high):
            before.append(machine.step(before[-1], k)[0])
        likely = min(max(change.likely, low), high)
        unchanged = self._reach(state, low, high)
        best, reach = likely, -1
        for place in sorted(range(low, min(high, unchanged) + 1), key=lambda p: (abs(p - likely), p)):
            got = self._reach(change.apply(before[place - low]), place, stop)
            if got > reach:
                best, reach = place, got
            if got >= stop:
                break
        self._compared += sum(machine.recorded(k) is not None for k in range(low, best))
        self._notes.append(f"{change.what} from sample {best} on")
        return best, change.apply(before[best - low])

    def _gap(self, i: int, state: State) -> tuple[int, State]:
        """Samples without a recorded output: passed over, answered unseen, or the machine began anew after them."""
        machine, end = self._machine, i
        while end < machine.count and machine.recorded(end) is None:
            end += 1
        stepped = state
        for k in range(i, end):
            stepped, _ = machine.step(stepped, k)
        if end == machine.count:
            return end, stepped
        stop = min(end + HORIZON, machine.count)
        choices = [
            (stepped, "answered, but not recorded"),
            (state, "not seen"),
            (machine.initial(), "then a new start"),
        ]
        reaches = [self._reach(choice, end, stop) for choice, _ in choices]
        best = reaches.index(max(reaches))
        if i:
            self._notes.append(f"samples {i} to {end - 1} without an output: {choices[best][1]}")
        return end, choices[best][0]

    def _restarted(self, i: int) -> State | None:
        fresh = self._machine.initial()
        stop = min(i + HORIZON, self._machine.count)
        return fresh if i and stop > i + 1 and self._reach(fresh, i, stop) >= stop else None
