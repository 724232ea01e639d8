"""The shadow: pairs object and twin samples by number and compares both channels."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from .channels import Channel
from .comparison import Comparison, ComparisonState, Score
from .samples import PlantSample, SampleFlag

_WAITING = 400


@dataclass(frozen=True, slots=True)
class ShadowState:
    """Figures so far, and the samples whose partner is still to come."""

    channels: Mapping[Channel, ComparisonState]
    sequence: int = -1
    stamp_ns: int = 0
    missed: int = 0
    ended: bool = False
    waiting: Mapping[int, PlantSample] = field(default_factory=dict)
    waiting_is_measured: bool = True


class Shadow:
    """Offers of measured and simulated samples in any interleaving; figures come in order of number.

    Both sides arrive in order, so once a pair is found whatever older waits has lost its partner and is
    counted as missed.
    """

    __slots__ = ("_comparison",)

    def __init__(self, sample_time_s: float, window_s: float) -> None:
        self._comparison = Comparison(sample_time_s, window_s)

    def initial_state(self) -> ShadowState:
        """Nothing compared yet."""
        return ShadowState(dict.fromkeys(Channel, self._comparison.initial_state()))

    def measured(self, state: ShadowState, sample: PlantSample) -> tuple[ShadowState, Mapping[Channel, Score] | None]:
        """A sample of the object; scores if its partner was there."""
        return self._offer(state, sample, True)

    def simulated(self, state: ShadowState, sample: PlantSample) -> tuple[ShadowState, Mapping[Channel, Score] | None]:
        """A sample of the twin; scores if its partner was there."""
        return self._offer(state, sample, False)

    def _offer(
        self, state: ShadowState, sample: PlantSample, is_measured: bool
    ) -> tuple[ShadowState, Mapping[Channel, Score] | None]:
        if is_measured and sample.sequence == 0 and state.sequence >= 0:
            # The object's run began anew; so do the figures. The twin's first answer may be here already.
            first = {} if state.waiting_is_measured else {n: s for n, s in state.waiting.items() if n == 0}
            state = replace(self.initial_state(), waiting=first, waiting_is_measured=False)
        partner = None if state.waiting_is_measured is is_measured else state.waiting.get(sample.sequence)
        if partner is None:
            return self._wait(state, sample, is_measured), None
        measured, simulated = (sample, partner) if is_measured else (partner, sample)
        older = sum(number < sample.sequence for number in state.waiting)
        later = {number: s for number, s in state.waiting.items() if number > sample.sequence}
        channels, scores = {}, {}
        for channel, own, other in (
            (Channel.PRESSURE, measured.pressure_pa, simulated.pressure_pa),
            (Channel.POSITION, measured.position_m, simulated.position_m),
        ):
            channels[channel], scores[channel] = self._comparison.step(state.channels[channel], own, other)
        after = ShadowState(
            channels,
            sample.sequence,
            measured.stamp_ns,
            state.missed + older,
            SampleFlag.END in measured.flags,
            later,
            state.waiting_is_measured,
        )
        return after, scores

    def _wait(self, state: ShadowState, sample: PlantSample, is_measured: bool) -> ShadowState:
        if state.waiting_is_measured is is_measured:
            waiting, missed = dict(state.waiting), state.missed
        else:
            # The other side's samples waited for ones this side has passed over.
            behind = [number for number in state.waiting if number < sample.sequence]
            if len(behind) < len(state.waiting):
                return replace(state, missed=state.missed + 1)
            waiting, missed = {}, state.missed + len(behind)
        waiting[sample.sequence] = sample
        while len(waiting) > _WAITING:
            del waiting[min(waiting)]
            missed += 1
        return replace(state, waiting=waiting, waiting_is_measured=is_measured, missed=missed)
