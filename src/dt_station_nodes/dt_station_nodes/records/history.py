"""The nodes' parameters over the time of a bag: a snapshot of each, and the changes recorded after it."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import yaml

from .bag import Bag
from .errors import RecordError

EVENTS = "/parameter_events"
_FOLDER = "parameters/"
_VALUE_FIELDS = {
    1: "bool_value",
    2: "integer_value",
    3: "double_value",
    4: "string_value",
    5: "byte_array_value",
    6: "bool_array_value",
    7: "integer_array_value",
    8: "double_array_value",
    9: "string_array_value",
}


class Values(dict[str, Any]):
    """A node's parameters by name; one that the bag does not hold is a RecordError that says so."""

    __slots__ = ("_node",)

    def __init__(self, node: str, values: Mapping[str, Any]) -> None:
        super().__init__(values)
        self._node = node

    def __missing__(self, name: str) -> Any:
        raise RecordError(f"the bag does not hold the parameter {name} of {self._node}; its outputs cannot be verified")


@dataclass(frozen=True, slots=True)
class ParameterChange:
    """Values that a node took over at a log time (ns)."""

    time_ns: int
    values: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class NodeHistory:
    """A node's parameters at the start of the bag, and their changes in order."""

    node: str
    initial: Mapping[str, Any]
    changes: tuple[ParameterChange, ...]

    def at(self, time_ns: int) -> Values:
        """Values in force at a log time."""
        values = Values(self.node, self.initial)
        for change in self.changes:
            if change.time_ns <= time_ns:
                values.update(change.values)
        return values


def histories(bag: Bag) -> dict[str, NodeHistory]:
    """Parameters by node name; raises RecordError where the bag's own account cannot be read."""
    events = _events(bag)
    found = {}
    for name, (time_ns, data) in bag.attachment_records().items():
        if not name.startswith(_FOLDER):
            continue
        node = name.removeprefix(_FOLDER).removesuffix(".yaml")
        try:
            snapshot = yaml.safe_load(data)
        except yaml.YAMLError:
            raise RecordError(f"{bag.path}: the attachment {name} is no valid YAML") from None
        if not isinstance(snapshot, dict):
            raise RecordError(f"{bag.path}: the attachment {name} holds no parameters")
        declared, changes = events.get(node, ({}, ()))
        # the snapshot may come after a change: then what was declared says what was in force before
        earlier = [change for change in changes if change.time_ns <= time_ns]
        initial = dict(snapshot)
        for change in earlier:
            initial.update({key: declared[key] for key in change.values if key in declared})
        kept = changes if all(key in declared for c in earlier for key in c.values) else changes[len(earlier) :]
        found[node] = NodeHistory(node, initial, tuple(kept))
    return found


def _events(bag: Bag) -> dict[str, tuple[dict[str, Any], list[ParameterChange]]]:
    """Per node: values declared, and changes."""
    topic = bag.topics.get(EVENTS)
    found: dict[str, tuple[dict[str, Any], list[ParameterChange]]] = {}
    if topic is None or not topic.info.count:
        return found
    for message in bag.messages([EVENTS]):
        event: Any = bag.deserialize(message)
        declared, changes = found.setdefault(event.node.rsplit("/", 1)[-1], ({}, []))
        declared.update({p.name: _value(p.value) for p in event.new_parameters})
        if event.changed_parameters:
            changes.append(
                ParameterChange(message.log_time, {p.name: _value(p.value) for p in event.changed_parameters})
            )
    return found


def _value(value: Any) -> Any:
    field = _VALUE_FIELDS.get(value.type)
    found: Any = getattr(value, field) if field else None
    return found.tolist() if hasattr(found, "tolist") else found
