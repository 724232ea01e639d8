"""The one metronome: when sample k+1 is due, which voltages answer sample k, and what was missed.

Pure: the clock's reading is passed in, as nanoseconds of any steady clock. The order of calls for one
sample is `take`, any number of `accept` and `follow`, `answer`; each sample is answered once. In real time
`begin` follows the answer to sample 0.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import Enum

from .channels import Channel
from .errors import StationError
from .samples import SampleFlag, ValveCommand

# what the best of timers may be late
_OVERSLEEP_NS = 500_000


class MetronomeError(StationError):
    """A pace that cannot be kept."""


class Pace(str, Enum):
    """Who sets the time: the clock, or the slowest of those waited for."""

    REALTIME = "realtime"
    LOCKSTEP = "lockstep"


MISSED_FLAG = {
    Channel.PRESSURE: SampleFlag.LOAD_COMMAND_MISSED,
    Channel.POSITION: SampleFlag.POSITION_COMMAND_MISSED,
}


@dataclass(frozen=True, slots=True)
class Tick:
    """A sample to take now: its number, how late it is, and how far the schedule was moved (ns)."""

    sequence: int
    late_ns: int = 0
    shifted_ns: int = 0
    follower_lost: bool = False

    def overrun(self, period_ns: int) -> bool:
        """Whether it is late by over half a period."""
        return self.late_ns > period_ns // 2


@dataclass(frozen=True, slots=True)
class Answer:
    """The voltages (V) that answer a sample, and the channels whose command did not come."""

    voltage_v: Mapping[Channel, float]
    missed: tuple[Channel, ...] = ()

    @property
    def flags(self) -> SampleFlag:
        """Flags of the sample after."""
        flags = SampleFlag.OK
        for channel in self.missed:
            flags |= MISSED_FLAG[channel]
        return flags


@dataclass(frozen=True, slots=True)
class MetronomeState:
    """`sequence` is the last sample taken (-1: none); `due_ns` when the next is (realtime) or is forced (lockstep).

    `excused` says that the next sample is late anyway and the commands of the last have a little longer.
    """

    sequence: int = -1
    answered: bool = True
    due_ns: int = 0
    origin_ns: int = 0
    command: Mapping[Channel, ValveCommand] = field(default_factory=dict)
    silent: Mapping[Channel, int] = field(default_factory=dict)
    followed: int | None = None
    excused: bool = False


class Metronome:
    """Decides when the next sample is due.

    `expected` channels are those whose controllers answer every sample; their silence is flagged and the
    last command held. In lockstep a silent one is waited for `command_timeout_s` at a sample; one silent
    for `patience` samples in a row is not waited for again until it answers one, even late: without that
    one started anew would run after the samples for good. In lockstep the followers (those who call
    `follow`) are never left behind by more than `max_lead` samples, unless they fall silent for
    `follower_timeout_s`: time enough to be started anew.
    """

    __slots__ = (
        "_follower_ns", "_max_late_ns", "_oversleep_ns", "_sample_time_s", "_timeout_ns", "expected", "max_lead",
        "pace", "patience",
    )  # fmt: skip

    def __init__(
        self,
        sample_time_s: float,
        pace: Pace,
        expected: frozenset[Channel] = frozenset(Channel),
        command_timeout_s: float = 1.0,
        patience: int = 5,
        max_lead: int = 50,
        max_late_s: float = 0.5,
        follower_timeout_s: float = 10.0,
    ) -> None:
        if not 0.0 < sample_time_s < 1e4:
            raise MetronomeError(f"sample time must be above 0 s, got {sample_time_s}")
        if command_timeout_s <= 0.0:
            raise MetronomeError(f"command time-out must be above 0 s, got {command_timeout_s}")
        self.pace = pace
        self.expected = tuple(channel for channel in Channel if channel in expected)
        self.patience = patience
        self.max_lead = max_lead
        self._sample_time_s = sample_time_s
        self._timeout_ns = round(command_timeout_s * 1e9)
        self._follower_ns = round(follower_timeout_s * 1e9)
        self._max_late_ns = round(max_late_s * 1e9)
        self._oversleep_ns = max(round(sample_time_s * 5e7), _OVERSLEEP_NS)

    def offset_ns(self, sequence: int) -> int:
        """Time from sample 0 to sample `sequence`, without drift."""
        return round(sequence * self._sample_time_s * 1e9)

    def start(self, now_ns: int, following: bool = False) -> MetronomeState:
        """The state before sample 0, which is due now; `following` says that followers will call `follow`."""
        return MetronomeState(due_ns=now_ns, origin_ns=now_ns, followed=-1 if following else None)

    def accept(self, state: MetronomeState, channel: Channel, command: ValveCommand) -> MetronomeState:
        """A command came in; one for a sample not yet taken (an earlier run's) or older than the held is ignored."""
        held = state.command.get(channel)
        if command.sequence > state.sequence or (held is not None and command.sequence <= held.sequence):
            return state
        # a late answer says that the controller is there: the sample now out is waited for once more
        allowed = 0 if command.sequence == state.sequence else self.patience - 1
        silent = {**state.silent, channel: min(state.silent.get(channel, 0), allowed)}
        commands = {**state.command, channel: command}
        return MetronomeState(
            state.sequence,
            state.answered,
            state.due_ns,
            state.origin_ns,
            commands,
            silent,
            state.followed,
            state.excused,
        )

    def follow(self, state: MetronomeState, sequence: int) -> MetronomeState:
        """A follower has dealt with sample `sequence`."""
        return state if sequence > state.sequence else replace(state, followed=sequence)

    def welcome(self, state: MetronomeState) -> MetronomeState:
        """Somebody new listens to the samples: perhaps the follower that fell, who never hears of those before."""
        return state if state.followed is None else replace(state, followed=state.sequence)

    def missing(self, state: MetronomeState) -> tuple[Channel, ...]:
        """Expected channels that have not answered the last sample."""
        if state.sequence < 0:
            return ()
        return tuple(c for c in self.expected if c not in state.command or state.command[c].sequence != state.sequence)

    def complete(self, state: MetronomeState) -> bool:
        """Whether the last sample can be answered: every expected command is in, or no longer waited for."""
        if self.pace is Pace.REALTIME:
            return not self.missing(state)
        missing = self.missing(state)
        return not missing or all(state.silent.get(channel, 0) >= self.patience for channel in missing)

    def overslept(self, state: MetronomeState, now_ns: int) -> MetronomeState:
        """In real time: the sample is due and its predecessor's commands are not in.

        If the caller itself comes late, the machine stood still for the controllers too: they get a quarter of a
        period, once, before a stale command is held. The sample is late anyway, and says so.
        """
        late = now_ns - state.due_ns
        if self.pace is not Pace.REALTIME or state.excused or state.sequence < 1 or late < self._oversleep_ns:
            return state
        return replace(state, due_ns=now_ns + self.offset_ns(1) // 4, excused=True)

    def answer(self, state: MetronomeState) -> tuple[MetronomeState, Answer]:
        """Answer the last sample with what is in; what is not is held and counted as missed."""
        missed = self.missing(state)
        silent = state.silent
        for channel in missed:
            silent = {**silent, channel: silent.get(channel, 0) + 1}
        voltage = {channel: command.voltage_v for channel, command in state.command.items()}
        due = state.due_ns
        if state.excused:
            due = state.origin_ns + self.offset_ns(state.sequence + 1)
        if self._ahead(state) and not state.answered:
            due += max(0, self._follower_ns - self._timeout_ns)
        after = MetronomeState(state.sequence, True, due, state.origin_ns, state.command, silent, state.followed)
        return after, Answer(voltage, missed)

    def begin(self, state: MetronomeState, now_ns: int) -> MetronomeState:
        """Sample 0 was answered: in real time the clock runs from now on, since only now all are known to listen."""
        return replace(state, origin_ns=now_ns, due_ns=now_ns + self.offset_ns(1))

    @staticmethod
    def resume(state: MetronomeState, held_ns: int) -> MetronomeState:
        """Lockstep goes on after it was held for a time, which nobody is blamed for."""
        return replace(state, due_ns=state.due_ns + held_ns)

    def due(self, state: MetronomeState, now_ns: int) -> bool:
        """Whether the next sample is to be taken now."""
        if state.sequence < 0 or now_ns >= state.due_ns:
            return True
        return self.pace is Pace.LOCKSTEP and not self._ahead(state) and (state.answered or self.complete(state))

    def take(self, state: MetronomeState, now_ns: int) -> tuple[MetronomeState, Tick]:
        """Take the next sample now; the last one must be answered. A follower still behind is run away from."""
        sequence = state.sequence + 1
        lost = self._ahead(state)
        followed = None if lost else state.followed
        late, shift, origin = 0, 0, state.origin_ns
        if self.pace is Pace.REALTIME and sequence == 0 and self.expected:
            due = now_ns + self._timeout_ns
        elif self.pace is Pace.REALTIME:
            late = max(0, now_ns - state.due_ns)
            if late > self._max_late_ns:
                # The machine stood still: going on from here beats a burst of samples that nobody can answer.
                shift = late
                origin += late
            due = origin + self.offset_ns(sequence + 1)
        else:
            due = now_ns + self._timeout_ns
        after = MetronomeState(sequence, False, due, origin, state.command, state.silent, followed)
        return after, Tick(sequence, late, shift, lost)

    def _ahead(self, state: MetronomeState) -> bool:
        return (
            self.pace is Pace.LOCKSTEP
            and state.followed is not None
            and state.sequence - state.followed >= self.max_lead
        )
