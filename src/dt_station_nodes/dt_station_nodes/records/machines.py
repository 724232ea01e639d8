"""The station's machines fed from a bag: the same classes as in the live nodes, one sample after the other."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from ..core.channels import Channel
from ..core.comparison import Score
from ..core.control import ControlInput, LoopConfig, LoopController, LoopState
from ..core.models import PlantModel
from ..core.samples import PlantSample, Setpoint
from ..core.setpoint_stream import SetpointStream, StreamState
from ..core.shadow import Shadow, ShadowState
from ..core.twin import CommandTwin, TwinState
from ..core.twin_loops import TwinLoops, TwinLoopsState
from ..core.waveforms import Waveform
from .evidence import Evidence, output_of
from .rerun import Output


@dataclass(frozen=True, slots=True)
class Loop:
    """A controller between two samples."""

    controller: LoopController
    state: LoopState
    last: ControlInput | None = None


class ControllerMachine:
    """A controller: answers each sample with the set-point that its command says it acted on."""

    def __init__(
        self, evidence: Evidence, run: tuple[int, int], channel: Channel, config: LoopConfig, step_s: float
    ) -> None:
        self._samples = evidence.samples[slice(*run)]
        self._commands, self._channel = evidence.commands[channel], channel
        self._setpoints = {s.sequence: s.value for s in evidence.setpoints[channel].values() if s.streaming}
        self._config, self._step_s = config, step_s

    @property
    def count(self) -> int:
        """Number of samples."""
        return len(self._samples)

    def initial(self) -> Loop:
        """The controller as it starts."""
        controller = LoopController(self._config, self._step_s)
        return Loop(controller, controller.initial_state())

    def reconfigured(self, loop: Loop, config: LoopConfig) -> Loop:
        """Another configuration, taken over as the node does."""
        if loop.last is None:
            controller = LoopController(config, self._step_s)
            return Loop(controller, controller.initial_state())
        controller, state = loop.controller.reconfigured(config, loop.state, loop.last)
        return Loop(controller, state, loop.last)

    def step(self, state: Loop, i: int) -> tuple[Loop, Output | None]:
        """The command for sample i."""
        sample = self._samples[i]
        recorded = self.recorded(i)
        held = state.last.setpoint if state.last is not None else 0.0
        setpoint = recorded[1] if recorded is not None else self._setpoints.get(sample.sequence, held)
        measured = sample.pressure_pa if self._channel is Channel.PRESSURE else sample.position_m
        given = ControlInput(setpoint, measured, sample.pressure_pa)
        after, output = state.controller.step(state.state, given)
        computed = (output.voltage_v, setpoint, float(int(output.mode)), float(output.limited))
        return replace(state, state=after, last=given), computed

    def recorded(self, i: int) -> Output | None:
        """The recorded command."""
        return self._commands.get(self._samples[i].stamp_ns)


class TwinMachine:
    """The twin fed with the voltages applied."""

    def __init__(self, evidence: Evidence, run: tuple[int, int], model: PlantModel, measured_pressure: bool) -> None:
        self._samples = evidence.samples[slice(*run)]
        self._recorded = evidence.twin
        self._twin = CommandTwin(model, measured_pressure)

    @property
    def count(self) -> int:
        """Number of samples."""
        return len(self._samples)

    def initial(self) -> tuple[CommandTwin, TwinState]:
        """The twin as it starts."""
        return self._twin, self._twin.initial_state()

    def renewed(self, model: PlantModel, measured_pressure: bool) -> tuple[CommandTwin, TwinState]:
        """Another model, taken over as the node does: standing where the object stands next."""
        twin = CommandTwin(model, measured_pressure)
        return twin, twin.initial_state()

    def step(self, state: tuple[CommandTwin, TwinState], i: int) -> tuple[tuple[CommandTwin, TwinState], Output | None]:
        """The twin's sample i."""
        twin, inner = state
        after, simulated = twin.step(inner, self._samples[i])
        return (twin, after), output_of(simulated)

    def recorded(self, i: int) -> Output | None:
        """The recorded twin's sample."""
        return output_of(self._recorded.get(self._samples[i].stamp_ns))


class LoopTwinMachine:
    """The twin with loops of its own, fed with set-points."""

    def __init__(
        self, evidence: Evidence, run: tuple[int, int], model: PlantModel, load: LoopConfig, position: LoopConfig,
        step_s: float,
    ) -> None:  # fmt: skip
        self._samples = evidence.samples[slice(*run)]
        self._recorded = evidence.twin
        self._setpoints = {channel: _by_use(evidence, run, channel) for channel in Channel}
        self._loops = TwinLoops(model, LoopController(load, step_s), LoopController(position, step_s))

    @property
    def count(self) -> int:
        """Number of samples."""
        return len(self._samples)

    def initial(self) -> tuple[TwinLoops, TwinLoopsState]:
        """The twin as it starts."""
        return self._loops, self._loops.initial_state()

    def reconfigured(
        self, state: tuple[TwinLoops, TwinLoopsState], load: LoopConfig, position: LoopConfig
    ) -> tuple[TwinLoops, TwinLoopsState]:
        """Other controllers, taken over as the node does."""
        loops, inner = state
        return loops.reconfigured(load, position, inner)

    def step(
        self, state: tuple[TwinLoops, TwinLoopsState], i: int
    ) -> tuple[tuple[TwinLoops, TwinLoopsState], Output | None]:
        """The twin's sample i, once its set-points are offered."""
        loops, inner = state
        for channel in Channel:
            for setpoint in self._setpoints[channel].get(i, ()):
                inner, _ = loops.on_setpoint(inner, channel, setpoint)
        inner, done = loops.on_sample(inner, self._samples[i])
        return (loops, inner), output_of(done[-1] if done else None)

    def recorded(self, i: int) -> Output | None:
        """The recorded twin's sample."""
        return output_of(self._recorded.get(self._samples[i].stamp_ns))


def _by_use(evidence: Evidence, run: tuple[int, int], channel: Channel) -> Mapping[int, Sequence[Setpoint]]:
    """Set-points of a run by the place of the sample they are for: streaming ones by number, others by stamp."""
    samples = evidence.samples[slice(*run)]
    place = {sample.sequence: i for i, sample in enumerate(samples)}
    at = {sample.stamp_ns: i + 1 for i, sample in enumerate(samples)}
    found: dict[int, list[Setpoint]] = {}
    for setpoint in evidence.setpoints[channel].values():
        if setpoint.stamp_ns and setpoint.stamp_ns not in at:
            continue
        i = place.get(setpoint.sequence) if setpoint.streaming else at.get(setpoint.stamp_ns, 0)
        if i is not None:
            found.setdefault(i, []).append(setpoint)
    return found


class ShadowMachine:
    """The comparison of object and twin, both as recorded."""

    def __init__(self, evidence: Evidence, run: tuple[int, int], step_s: float, window_s: float) -> None:
        self._samples = evidence.samples[slice(*run)]
        self._twin, self._recorded = evidence.twin, evidence.residuals
        self._shadow = Shadow(step_s, window_s)

    @property
    def count(self) -> int:
        """Number of samples."""
        return len(self._samples)

    def initial(self) -> ShadowState:
        """Nothing compared yet."""
        return self._shadow.initial_state()

    def step(self, state: ShadowState, i: int) -> tuple[ShadowState, Output | None]:
        """The figures after sample i."""
        sample = self._samples[i]
        state, scores = self._shadow.measured(state, sample)
        partner = self._twin.get(sample.stamp_ns)
        if scores is None and partner is not None:
            state, scores = self._shadow.simulated(state, partner)
        if scores is None:
            return state, None
        return state, (*_figures(scores[Channel.POSITION]), *_figures(scores[Channel.PRESSURE]))

    def recorded(self, i: int) -> Output | None:
        """The recorded figures."""
        return self._recorded.get(self._samples[i].stamp_ns)


def _figures(score: Score) -> tuple[float, float, float, float]:
    return (score.residual, score.ise, score.window_rms, score.fit_percent)


class GeneratorMachine:
    """A generator of set-points: on sample k the value for k + 1."""

    def __init__(
        self, evidence: Evidence, run: tuple[int, int], channel: Channel, waveform: Waveform, step_s: float
    ) -> None:
        self._samples: list[PlantSample] = evidence.samples[slice(*run)]
        self._recorded = evidence.setpoints[channel]
        self._stream = SetpointStream(step_s)
        self._waveform = waveform

    @property
    def count(self) -> int:
        """Number of samples."""
        return len(self._samples)

    def initial(self) -> tuple[Waveform, StreamState]:
        """The generator as it starts: the set-point for sample 0 has been sent."""
        state, _ = self._stream.first(self._stream.initial_state(self._waveform))
        return self._waveform, state

    def step(self, state: tuple[Waveform, StreamState], i: int) -> tuple[tuple[Waveform, StreamState], Output | None]:
        """The set-point sent on sample i."""
        waveform, inner = state
        inner, sent = self._stream.step(inner, self._samples[i].sequence, waveform)
        return (waveform, inner), ((sent[-1][1],) if sent else None)

    def recorded(self, i: int) -> Output | None:
        """The set-point recorded for the next sample."""
        sample = self._samples[i]
        setpoint = self._recorded.get((sample.stamp_ns, sample.sequence + 1))
        return (setpoint.value,) if setpoint is not None and setpoint.streaming else None
