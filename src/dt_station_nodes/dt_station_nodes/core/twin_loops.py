"""A twin with loops of its own among samples and set-points: simulates a sample once its set-points are known."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from .channels import Channel
from .control import LoopConfig, LoopController
from .models import PlantModel
from .samples import PlantSample, Setpoint
from .setpoint_inbox import InboxState, SetpointInbox
from .twin import LoopTwinState, SetpointTwin

_REST = {Channel.PRESSURE: 1.0e6, Channel.POSITION: 0.0}


@dataclass(frozen=True, slots=True)
class TwinLoopsState:
    """`queue` holds samples whose set-points are still to come; `late` counts those simulated without.

    `awaited` are channels whose set-points have a publisher, though none was heard when the last sample came.
    """

    twin: LoopTwinState
    inbox: Mapping[Channel, InboxState]
    queue: tuple[PlantSample, ...] = ()
    late: int = 0
    awaited: frozenset[Channel] = frozenset()


Simulated = tuple[TwinLoopsState, list[PlantSample]]


class TwinLoops:
    """Like a controller, but outside the loop: it waits `patience` samples for a streaming set-point, not one."""

    __slots__ = ("_inbox", "_model", "_patience", "_twin")

    def __init__(self, model: PlantModel, load: LoopController, position: LoopController, patience: int = 20) -> None:
        self._model = model
        self._twin = SetpointTwin(model, load, position)
        self._inbox = SetpointInbox()
        self._patience = patience

    def initial_state(self) -> TwinLoopsState:
        """Nothing seen yet; the set-points of rest stand."""
        inbox = {channel: self._inbox.initial_state(value) for channel, value in _REST.items()}
        return TwinLoopsState(self._twin.initial_state(), inbox)

    def reconfigured(
        self, load: LoopConfig, position: LoopConfig, state: TwinLoopsState
    ) -> tuple["TwinLoops", TwinLoopsState]:
        """The same with other controllers, bumpless."""
        twin = state.twin
        loads, load_state = self._twin.load, twin.load
        positions, position_state = self._twin.position, twin.position
        if twin.load_input is not None and twin.position_input is not None:
            loads, load_state = loads.reconfigured(load, load_state, twin.load_input)
            positions, position_state = positions.reconfigured(position, position_state, twin.position_input)
        else:
            loads, positions = (LoopController(c, loads.sample_time_s) for c in (load, position))
            load_state, position_state = loads.initial_state(), positions.initial_state()
        changed = TwinLoops(self._model, loads, positions, self._patience)
        return changed, replace(state, twin=replace(twin, load=load_state, position=position_state))

    def on_setpoint(self, state: TwinLoopsState, channel: Channel, setpoint: Setpoint) -> Simulated:
        """A set-point came in."""
        inbox = {**state.inbox, channel: self._inbox.offer(state.inbox[channel], setpoint)}
        return self._drain(replace(state, inbox=inbox))

    def on_sample(
        self, state: TwinLoopsState, sample: PlantSample, awaited: frozenset[Channel] = frozenset()
    ) -> Simulated:
        """A sample came in; one that does not follow the last begins a new run.

        `awaited` names channels whose set-points have a publisher: their first one is waited for.
        """
        newest = state.queue[-1] if state.queue else state.twin.twin.last
        if newest is not None and sample.sequence <= newest.sequence:
            inbox = {channel: self._inbox.restart(each) for channel, each in state.inbox.items()}
            state = replace(state, inbox=inbox, queue=())
        return self._drain(replace(state, queue=(*state.queue, sample), awaited=awaited))

    def _drain(self, state: TwinLoopsState) -> Simulated:
        done = []
        while state.queue:
            sample = state.queue[0]
            inbox, found = {}, {}
            for channel, each in state.inbox.items():
                inbox[channel], found[channel] = self._inbox.find(each, sample.sequence)
                if channel in state.awaited and not each.heard:
                    found[channel] = None
            overdue = len(state.queue) > self._patience
            if None in found.values() and not overdue:
                break
            load, position = (
                inbox[c].standing if found[c] is None else found[c] for c in (Channel.PRESSURE, Channel.POSITION)
            )
            twin, simulated = self._twin.step(state.twin, sample, float(load or 0.0), float(position or 0.0))
            state = replace(
                state, twin=twin, inbox=inbox, queue=state.queue[1:], late=state.late + (None in found.values())
            )
            done.append(simulated)
        return state, done
