"""Set-points for samples: on sample k the value for k+1, so that one hop separates sample and command."""

from dataclasses import dataclass, replace

from .waveforms import Waveform, WaveformGenerator, WaveformState


@dataclass(frozen=True, slots=True)
class StreamState:
    """`upcoming` is the number of the sample the waveform stands before."""

    waveform: WaveformState
    upcoming: int = 0


class SetpointStream:
    """Plays a waveform against sample numbers: gaps are jumped over, a run begun anew starts it anew."""

    __slots__ = ("_generator",)

    def __init__(self, sample_time_s: float) -> None:
        self._generator = WaveformGenerator(sample_time_s)

    def initial_state(self, waveform: Waveform) -> StreamState:
        """Before sample 0."""
        return StreamState(self._generator.initial_state(waveform))

    def first(self, state: StreamState) -> tuple[StreamState, tuple[int, float]]:
        """Number and value of the set-point that is due before any sample was seen."""
        after, value = self._generator.step(state.waveform)
        return StreamState(after, state.upcoming + 1), (state.upcoming, value)

    def step(
        self, state: StreamState, sequence: int, waveform: Waveform | None = None
    ) -> tuple[StreamState, list[tuple[int, float]]]:
        """Sample `sequence` was taken: numbers and values to send, the last of them for `sequence` + 1.

        More than one is sent where samples were not seen or the run began anew.
        """
        if state.upcoming > sequence + 1:
            state = self.initial_state(waveform or state.waveform.waveform)
        state = _jump(state, sequence)
        sent = []
        while state.upcoming <= sequence + 1:
            after, value = self._generator.step(state.waveform, waveform)
            sent.append((state.upcoming, value))
            state = StreamState(after, state.upcoming + 1)
        return state, sent


def _jump(state: StreamState, sequence: int) -> StreamState:
    gap = sequence - state.upcoming
    if gap <= 0:
        return state
    wave = state.waveform
    position = (wave.position + gap * wave.increment) % wave.modulus
    return StreamState(replace(wave, position=position), sequence)
