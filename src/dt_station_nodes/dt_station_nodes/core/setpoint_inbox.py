"""Which set-point a sample is answered with: the streaming one of its own number, else the one that stands."""

from dataclasses import dataclass, replace

from .samples import Setpoint

_AHEAD = 16


@dataclass(frozen=True, slots=True)
class InboxState:
    """`standing` (Pa or m) is what holds, `known` that a publisher gave it; `streaming`: one comes for every sample."""

    standing: float
    known: bool = False
    streaming: bool = False
    ahead: tuple[Setpoint, ...] = ()

    @property
    def heard(self) -> bool:
        """Whether any set-point came yet."""
        return self.known or self.streaming


class SetpointInbox:
    """Keeps the streaming set-points that arrive before their sample, and the last one standing."""

    __slots__ = ()

    def initial_state(self, value: float) -> InboxState:
        """Before any set-point came, `value` (Pa or m) stands."""
        return InboxState(value)

    def offer(self, state: InboxState, setpoint: Setpoint) -> InboxState:
        """A set-point came in; a non-streaming one stands from now on and ends the streaming."""
        if not setpoint.streaming:
            return InboxState(setpoint.value, True)
        if any(held.sequence == setpoint.sequence for held in state.ahead):
            return state
        return replace(state, streaming=True, ahead=(*state.ahead, setpoint)[-_AHEAD:])

    def find(self, state: InboxState, sequence: int) -> tuple[InboxState, float | None]:
        """The set-point for a sample, or None where its streaming one is still to come.

        Set-points come in order: one for a later sample says that this one's was missed (we came late), so
        what stands serves, or that later one where nothing was known before.
        """
        if not state.streaming:
            return state, state.standing
        later = tuple(setpoint for setpoint in state.ahead if setpoint.sequence > sequence)
        for setpoint in state.ahead:
            if setpoint.sequence == sequence:
                return InboxState(setpoint.value, True, True, later), setpoint.value
        if later:
            value = state.standing if state.known else later[0].value
            return InboxState(value, True, True, later), value
        return state, None

    def restart(self, state: InboxState) -> InboxState:
        """The run began anew at sample 0: what was kept for later samples belongs to the old one."""
        return replace(state, ahead=tuple(setpoint for setpoint in state.ahead if setpoint.sequence <= 1))
