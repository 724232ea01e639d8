"""A controller among samples and set-points: which sample is answered when, and with which set-point."""

from dataclasses import dataclass, replace

from .channels import Channel
from .control import ControlInput, LoopConfig, LoopController, LoopState
from .samples import PlantSample, Setpoint, ValveCommand
from .setpoint_inbox import InboxState, SetpointInbox


@dataclass(frozen=True, slots=True)
class AnsweringState:
    """`waiting` is a sample whose streaming set-point is still to come; `late` counts those that never came in time."""

    loop: LoopState
    inbox: InboxState
    sequence: int = -1
    stamp_ns: int = 0
    waiting: PlantSample | None = None
    late: int = 0
    last: ControlInput | None = None


Answered = tuple[AnsweringState, list[ValveCommand]]


class Answering:
    """Answers every sample once: when its set-point is known, at the latest at the next sample."""

    __slots__ = ("_channel", "_controller", "_inbox", "_sample_time_s")

    def __init__(self, channel: Channel, config: LoopConfig, sample_time_s: float) -> None:
        self._channel = channel
        self._sample_time_s = sample_time_s
        self._controller = LoopController(config, sample_time_s)
        self._inbox = SetpointInbox()

    def initial_state(self, setpoint: float) -> AnsweringState:
        """Nothing seen yet; `setpoint` (Pa or m) stands until one comes."""
        return AnsweringState(self._controller.initial_state(), self._inbox.initial_state(setpoint))

    def reconfigured(self, config: LoopConfig, state: AnsweringState) -> tuple["Answering", AnsweringState]:
        """The same with another configuration, bumpless."""
        changed = Answering(self._channel, config, self._sample_time_s)
        if state.last is None:
            return changed, replace(state, loop=changed._controller.initial_state())
        changed._controller, loop = self._controller.reconfigured(config, state.loop, state.last)
        return changed, replace(state, loop=loop)

    def on_setpoint(self, state: AnsweringState, setpoint: Setpoint) -> Answered:
        """A set-point came in."""
        state = replace(state, inbox=self._inbox.offer(state.inbox, setpoint))
        if state.waiting is None:
            return state, []
        inbox, value = self._inbox.find(state.inbox, state.waiting.sequence)
        if value is None:
            return state, []
        return self._answer(replace(state, inbox=inbox, waiting=None), state.waiting, value)

    def on_sample(self, state: AnsweringState, sample: PlantSample, awaited: bool = False) -> Answered:
        """A sample came in; `awaited` says that a publisher of set-points exists, though none was heard yet.

        A number not above the last one's begins a new run, except that the same sample twice is ignored.
        """
        commands: list[ValveCommand] = []
        if sample.sequence <= state.sequence:
            if (state.sequence, state.stamp_ns) == (sample.sequence, sample.stamp_ns):
                return state, []
            inbox = self._inbox.restart(state.inbox)
            state = AnsweringState(self._controller.initial_state(), inbox, late=state.late)
        if state.waiting is not None:
            overdue, value = state.waiting, state.inbox.standing
            state = replace(state, waiting=None, late=state.late + 1)
            state, commands = self._answer(state, overdue, value)
        inbox, found = self._inbox.find(state.inbox, sample.sequence)
        state = replace(state, inbox=inbox, sequence=sample.sequence, stamp_ns=sample.stamp_ns)
        if found is None or (awaited and not inbox.heard):
            return replace(state, waiting=sample), commands
        state, more = self._answer(state, sample, found)
        return state, commands + more

    def _answer(self, state: AnsweringState, sample: PlantSample, setpoint: float) -> Answered:
        measured = sample.pressure_pa if self._channel is Channel.PRESSURE else sample.position_m
        given = ControlInput(setpoint, measured, sample.pressure_pa)
        loop, output = self._controller.step(state.loop, given)
        command = ValveCommand(
            sample.sequence, sample.stamp_ns, output.voltage_v, setpoint, output.mode, output.limited
        )
        return replace(state, loop=loop, last=given), [command]
