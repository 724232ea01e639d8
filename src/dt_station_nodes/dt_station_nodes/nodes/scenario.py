"""A scenario: which nodes run with which parameters, read from YAML and completed into plans for each process."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import yaml
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from ..core.errors import StationError
from . import registry
from .configuration import find_config

NAMESPACE = "station"


class ScenarioError(StationError):
    """A scenario file that cannot be run."""


class NodeSpec(BaseModel):
    """One node of a scenario; the executable is the node's name unless given."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    executable: str = ""
    parameters: Mapping[str, Any] = Field(default_factory=dict)
    required: bool = True


class Scenario(BaseModel):
    """What `dt-station run` starts. Times in s."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: str
    description: str = ""
    sample_time_s: float = Field(0.02, gt=0.0, le=60.0)
    pace: Literal["realtime", "lockstep"] = "realtime"
    duration_s: float = Field(0.0, ge=0.0)
    nodes: Mapping[str, NodeSpec]

    @classmethod
    def from_yaml(cls, text: str, source: str = "scenario") -> "Scenario":
        """Read a scenario. Raises ScenarioError with the place of the first mistake."""
        try:
            data = yaml.safe_load(text)
        except yaml.YAMLError as error:
            raise ScenarioError(f"{source} is not YAML: {' '.join(str(error).split())}") from None
        if not isinstance(data, dict):
            raise ScenarioError(f"{source} holds no scenario; it needs name and nodes")
        if isinstance(data.get("nodes"), dict):
            data["nodes"] = {name: spec or {} for name, spec in data["nodes"].items()}
        return cls._checked(data, source)

    @classmethod
    def load(cls, name: str | Path) -> "Scenario":
        """Read a scenario by path, or by name in config/scenarios. Raises StationError."""
        path = find_config("scenarios", name)
        return cls.from_yaml(path.read_text(encoding="utf-8"), str(path))

    @classmethod
    def _checked(cls, data: Mapping[str, Any], source: str) -> "Scenario":
        try:
            return cls.model_validate(data)
        except ValidationError as error:
            first = error.errors()[0]
            place = ".".join(str(part) for part in first["loc"])
            raise ScenarioError(f"{source}: {place}: {first['msg']}") from None

    def changed(self, **changes: Any) -> "Scenario":
        """The scenario with fields changed, checked as a whole. Raises ScenarioError."""
        return self._checked({**{name: getattr(self, name) for name in type(self).model_fields}, **changes}, self.name)

    def with_nodes(self, **nodes: NodeSpec | None) -> "Scenario":
        """The scenario with nodes added, replaced or (None) left out."""
        merged = {name: spec for name, spec in {**self.nodes, **nodes}.items() if spec is not None}
        return self.model_copy(update={"nodes": merged})

    def with_parameters(self, node: str, **parameters: Any) -> "Scenario":
        """The scenario with some parameters of one node changed. Raises ScenarioError if it has no such node."""
        if node not in self.nodes:
            raise ScenarioError(f"scenario {self.name} has no node {node!r}; it has {', '.join(self.nodes)}.")
        spec = self.nodes[node]
        return self.with_nodes(**{node: spec.model_copy(update={"parameters": {**spec.parameters, **parameters}})})


@dataclass(frozen=True, slots=True)
class NodePlan:
    """A node ready to start: all parameters, and whether the run can do without it for a moment."""

    name: str
    executable: str
    parameters: Mapping[str, Any]
    required: bool


def plan(scenario: Scenario) -> tuple[NodePlan, ...]:
    """Plans in the order of starting. Raises ScenarioError."""
    executables = {name: spec.executable or name for name, spec in scenario.nodes.items()}
    for name, executable in executables.items():
        if executable not in registry.NODES:
            raise ScenarioError(f"node {name}: there is no executable {executable!r}; give one as executable")
    parameters = {name: _own(scenario, name, executables) for name in scenario.nodes}
    readers: dict[str, int] = {}
    written: set[str] = set()
    for name, executable in executables.items():
        written.update(registry.writes(executable, parameters[name]))
        for topic in registry.reads(executable, parameters[name]):
            readers[topic] = readers.get(topic, 0) + 1
    ready = sum(executable in registry.SIGNING for executable in executables.values())
    plans = []
    for name, spec in scenario.nodes.items():
        executable, own = executables[name], parameters[name]
        wait: dict[str, Any] = {
            "wait_for_readers": [f"{t}:{readers[t]}" for t in registry.writes(executable, own) if readers.get(t)]
        }
        if executable in registry.TIMED:
            inputs = [t for t in registry.reads(executable, own) if t in written and t != "object/state"]
            wait["wait_for_writers"] = inputs
        if executable == "daq_bridge":
            wait["wait_for_nodes"] = ready
        complete = {**{key: value for key, value in wait.items() if value}, **own}
        plans.append(NodePlan(name, executable, complete, spec.required))
    return tuple(plans)


def _own(scenario: Scenario, name: str, executables: Mapping[str, str]) -> dict[str, Any]:
    executable = executables[name]
    given = dict(scenario.nodes[name].parameters)
    for key, value in given.items():
        if isinstance(value, dict):
            given[key] = yaml.safe_dump(value, sort_keys=False)
    defaults: dict[str, Any] = {}
    if executable in registry.TIMED:
        defaults["sample_time_s"] = scenario.sample_time_s
    if executable == "daq_bridge":
        present = set(executables.values())
        controllers = {"load": "pressure_controller", "position": "position_controller"}
        follower = next(
            (f for f, e in (("shadow", "shadow_compare"), ("twin", "twin_simulator")) if e in present), None
        )
        defaults |= {
            "pace": scenario.pace,
            "duration_s": scenario.duration_s,
            "expect": [channel for channel, node in controllers.items() if node in present] or [registry.NOBODY],
            "followers": [follower] if follower else [],
        }
    return {**defaults, **given}
