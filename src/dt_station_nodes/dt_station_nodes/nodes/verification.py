"""From what a bag says of its nodes to the machines that run again: configurations and models out of the bag itself."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from ..core.channels import Channel
from ..core.control import LoopConfig
from ..core.models import ModelSpec, PlantModel
from ..core.waveforms import Shape, Waveform
from ..records import Bag
from ..records.bagrun import TWIN
from ..records.evidence import COMMAND_FIELDS, RESIDUAL_FIELDS, STATE_FIELDS, TOPICS, Evidence, gather
from ..records.history import NodeHistory, histories
from ..records.machines import (
    ControllerMachine,
    GeneratorMachine,
    LoopTwinMachine,
    ShadowMachine,
    TwinMachine,
)
from ..records.rerun import Change, Outcome, Rerun
from .loop_parameters import loop_from_values
from .recorded_configuration import announced_models, recorded_loop, recorded_model, unpacked

CONTROLLERS = {Channel.PRESSURE: "pressure_controller", Channel.POSITION: "position_controller"}
TELLING = {"twin_simulator": {"feed", "model_yaml"}, "shadow_compare": {"window_s", "summary_every"}}
_NONE = {"no node has this"}
_SPREAD = 60


@dataclass(frozen=True, slots=True)
class Verdict:
    """One topic of one run: samples compared and, where one differs, what the bag holds and what was computed."""

    topic: str
    outcome: Outcome
    sequence: int = -1
    field: str = ""
    recorded: float = 0.0
    computed: float = 0.0

    @property
    def identical(self) -> bool:
        """Whether every sample compared is the same to the last bit."""
        return self.outcome.differs < 0


class Verifier:
    """Runs one bag's recorded inputs again. Raises RecordError where the bag does not say enough."""

    def __init__(self, bag: Bag) -> None:
        self._bag = bag
        self._evidence: Evidence = gather(bag)
        self._histories = histories(bag)
        self._models = announced_models(bag)
        self.skipped: dict[str, str] = {}

    def verdicts(self) -> Iterator[Verdict]:
        """One a topic and run, as they are found."""
        with unpacked(self._bag) as files:
            for run in self._evidence.runs():
                missing = _missing(self._evidence, run)
                if missing:
                    self.skipped["object/state"] = missing
                    continue
                yield from self._generators(run)
                yield from self._controllers(run, files)
                yield from self._twin(run, files)
                yield from self._shadow(run)

    def _judged(
        self, topic: str, fields: tuple[str, ...], machine: Any, changes: list[Change[Any]], run: tuple[int, int]
    ) -> Verdict:
        outcome = Rerun(machine, changes).run()
        if outcome.differs < 0:
            return Verdict(topic, outcome)
        sequence = self._evidence.samples[run[0] + outcome.differs].sequence
        recorded, computed = machine.recorded(outcome.differs) or (), outcome.computed or ()
        for i, field in enumerate(fields):
            pair = [values[i] if i < len(values) else float("nan") for values in (recorded, computed)]
            if str(pair[0]) != str(pair[1]):
                return Verdict(topic, outcome, sequence, field, pair[0], pair[1])
        return Verdict(topic, outcome, sequence, "sign of zero", 0.0, -0.0)

    def _changes(
        self, history: NodeHistory, run: tuple[int, int], apply: Callable[[Any, Mapping[str, Any]], Any]
    ) -> list[Change[Any]]:
        """A node's changes of parameters within a run, each with the samples before which it may have acted."""
        times = self._evidence.log_time[slice(*run)]
        found = []
        for change in history.changes:
            if not times or change.time_ns <= times[0] or change.time_ns >= times[-1]:
                continue
            likely = sum(time < change.time_ns for time in times)
            values = history.at(change.time_ns)
            found.append(
                Change(
                    max(0, likely - _SPREAD),
                    likely,
                    min(len(times), likely + _SPREAD),
                    partial(_applied, apply, values),
                    f"{', '.join(f'{k} = {v}' for k, v in sorted(change.values.items()))}",
                )
            )
        return found

    def _known(self, node: str, topic: str) -> NodeHistory | None:
        """The history of the node of that name, else of one that writes the topic or has such a node's parameters."""
        history = self._histories.get(node)
        for each in self._histories.values() if history is None else ():
            readers = each.initial.get("wait_for_readers") or []
            writes = any(str(entry).startswith(f"{topic}:") for entry in readers)
            if writes or TELLING.get(node, _NONE) <= set(each.initial):
                history = each
        if history is None:
            self.skipped[topic] = f"the bag does not hold the parameters of {node}"
        return history

    def _start(self, run: tuple[int, int]) -> int:
        return self._evidence.log_time[run[0]]

    def _controllers(self, run: tuple[int, int], files: Path) -> Iterator[Verdict]:
        for channel, node in CONTROLLERS.items():
            topic = f"{TOPICS[channel]}/command"
            if not self._evidence.commands[channel]:
                continue
            history = self._known(node, topic)
            if history is None:
                continue
            values = history.at(self._start(run))
            base = recorded_loop(values, "config", values.get("alternatives") or [], files)
            config = loop_from_values(base, values)
            machine = ControllerMachine(self._evidence, run, channel, config, values["sample_time_s"])
            changes = self._changes(history, run, partial(_reconfigured, machine, base))
            yield self._judged(topic, COMMAND_FIELDS, machine, changes, run)

    def _generators(self, run: tuple[int, int]) -> Iterator[Verdict]:
        for history in self._histories.values():
            values = history.at(self._start(run))
            if not {"channel", "shape", "amplitude"} <= set(values):
                continue
            channel = Channel.PRESSURE if values["channel"] == "load" else Channel.POSITION
            if not values.get("enabled", True) or not self._evidence.setpoints[channel]:
                continue
            machine = GeneratorMachine(self._evidence, run, channel, _waveform(values), values["sample_time_s"])
            changes = self._changes(history, run, _played)
            yield self._judged(f"{TOPICS[channel]}/setpoint", ("value",), machine, changes, run)

    def _twin(self, run: tuple[int, int], files: Path) -> Iterator[Verdict]:
        history = self._known("twin_simulator", TWIN) if self._evidence.twin else None
        if history is None:
            return
        values = history.at(self._start(run))
        step = values["sample_time_s"]
        announced = [m for m in self._models if m[0] <= self._evidence.samples[run[0]].stamp_ns]
        text = announced[-1][1] if announced else recorded_model(values, "model", "models", files)
        model = PlantModel(ModelSpec.from_yaml(text), step)
        fields = (*STATE_FIELDS, "flags")
        if values["feed"] == "setpoints":
            bases = {
                "load.": recorded_loop(values, "load_config", [], files),
                "position.": recorded_loop(values, "position_config", values.get("alternatives") or [], files),
            }
            own = {prefix: loop_from_values(base, values, prefix) for prefix, base in bases.items()}
            loops = LoopTwinMachine(self._evidence, run, model, own["load."], own["position."], step)
            changes = self._changes(
                history,
                run,
                lambda state, v: loops.reconfigured(
                    state, *(loop_from_values(base, v, prefix) for prefix, base in bases.items())
                ),
            )
            yield self._judged(TWIN, fields, loops, changes, run)
            return
        machine = TwinMachine(self._evidence, run, model, values["measured_pressure"])
        stamps = [sample.stamp_ns for sample in self._evidence.samples[slice(*run)]]
        changes = []
        for stamp, later in self._models:
            if stamp in stamps:
                place = stamps.index(stamp) + 1
                renewed = PlantModel(ModelSpec.from_yaml(later), step)
                measured = history.at(self._evidence.log_time[run[0] + place - 1])["measured_pressure"]
                changes.append(
                    Change(
                        max(0, place - 2),
                        place,
                        place + 2,
                        partial(_renewed, machine, renewed, measured),
                        f"model {renewed.spec.name}",
                    )
                )
        yield self._judged(TWIN, fields, machine, changes, run)

    def _shadow(self, run: tuple[int, int]) -> Iterator[Verdict]:
        topic = "shadow/residual"
        history = self._known("shadow_compare", topic) if self._evidence.residuals else None
        if history is not None:
            values = history.at(self._start(run))
            machine = ShadowMachine(self._evidence, run, values["sample_time_s"], values["window_s"])
            yield self._judged(topic, RESIDUAL_FIELDS, machine, [], run)


def _waveform(values: Mapping[str, Any]) -> Waveform:
    """What a generator's parameters say it plays."""
    shape = Shape[str(values["shape"]).upper()]
    return Waveform(
        shape, *(float(values[name]) for name in ("amplitude", "offset", "frequency_hz", "phase_rad", "duty"))
    )


def _played(state: Any, values: Mapping[str, Any]) -> Any:
    return _waveform(values), state[1]


def _applied(apply: Callable[[Any, Mapping[str, Any]], Any], values: Mapping[str, Any], state: Any) -> Any:
    return apply(state, values)


def _reconfigured(machine: ControllerMachine, base: LoopConfig, state: Any, values: Mapping[str, Any]) -> Any:
    return machine.reconfigured(state, loop_from_values(base, values))


def _renewed(machine: TwinMachine, model: PlantModel, measured_pressure: bool, _: Any) -> Any:
    return machine.renewed(model, measured_pressure)


def _missing(evidence: Evidence, run: tuple[int, int]) -> str:
    numbers = [sample.sequence for sample in evidence.samples[slice(*run)]]
    lost = numbers[-1] - numbers[0] + 1 - len(numbers)
    return (
        f"{lost} samples of the object are missing in the bag; what followed from them cannot be verified"
        if lost
        else ""
    )
