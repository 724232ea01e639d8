"""Records the graph into a bag: serialized messages as they come, written by a thread of their own."""

import time
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import yaml
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.qos import QoSProfile

from ..core.samples import SampleFlag
from ..records.bagwriter import BagWriter, WriterOptions
from ..records.provenance import provenance
from ..records.writerthread import WriterStatus, WriterThread
from . import convert
from .diagnostics import Diagnostics, Health, Level
from .parameter_snapshot import ParameterSnapshot
from .parameters import Parameter, ParameterError, ParameterSet
from .qos import DIAGNOSTICS_READER, LATCHED, SETPOINT_READER, STREAM, WAVEFORM
from .recorded_topics import TopicSlot, deepened, free_folder, message_class
from .referenced_files import referenced_files
from .spinning import run_node

NAME = "recorder"
PACKAGE = "dt_station_msgs/msg/"
STATE = "object/state"
TOPICS: dict[str, tuple[str, QoSProfile]] = {
    STATE: (PACKAGE + "PlantState", STREAM),
    "twin/state": (PACKAGE + "PlantState", STREAM),
    "load/setpoint": (PACKAGE + "Setpoint", SETPOINT_READER),
    "position/setpoint": (PACKAGE + "Setpoint", SETPOINT_READER),
    "load/command": (PACKAGE + "ValveCommand", STREAM),
    "position/command": (PACKAGE + "ValveCommand", STREAM),
    "load/waveform": (PACKAGE + "Waveform", WAVEFORM),
    "position/waveform": (PACKAGE + "Waveform", WAVEFORM),
    "shadow/residual": (PACKAGE + "Residual", STREAM),
    "shadow/summary": (PACKAGE + "ShadowSummary", LATCHED),
    "twin/model": (PACKAGE + "TwinModel", LATCHED),
    "/diagnostics": ("diagnostic_msgs/msg/DiagnosticArray", DIAGNOSTICS_READER),
    "/parameter_events": ("rcl_interfaces/msg/ParameterEvent", DIAGNOSTICS_READER),
}
TABLE = (
    Parameter("out", "", "the bag's folder; it must not exist yet", fixed=True),
    Parameter("topics", [], "topics to record; none: all of the station's", fixed=True),
    Parameter("attach", [], "files to keep in the bag: models, rig, scenario", fixed=True),
    Parameter("chunk_s", 0.5, "longest time a message is kept in memory only", "s", 0.05, 1.0, fixed=True),
    Parameter("split_s", 0.0, "length of a file; 0: one file", "s", 0.0, 1e7, fixed=True),
    Parameter("split_mb", 0.0, "size of a file; 0: one file", "MB", 0.0, 1e6, fixed=True),
    Parameter("queue_mb", 64.0, "memory for messages that the disk has not taken yet", "MB", 0.1, 1e5, fixed=True),
    Parameter("sync", True, "have the disk confirm every chunk", fixed=True),
    Parameter("exit_at_end", False, "end the process once the run has ended and all is quiet", fixed=True),
)
_QUIET_S = 0.5
_SNAPSHOT_S = 2.0
# a busy machine may keep this process waiting for seconds while the graph runs ten times as fast as the object
DEPTH = 5000


class Recorder:
    """The node's own half: subscriptions that hand bytes to the writer."""

    ticker = None
    keeps_all = True

    def __init__(self, node: Node) -> None:
        self._node = node
        values = ParameterSet(node, TABLE, _checked).values
        chosen = values["topics"] or list(TOPICS)
        unknown = [name for name in chosen if name not in TOPICS and "/" not in name]
        if unknown:
            raise ParameterError(f"topics: {unknown[0]} is no topic; write it as the graph does, such as {STATE}")
        options = WriterOptions(
            values["chunk_s"], split_bytes=int(values["split_mb"] * 1e6), split_seconds=values["split_s"],
            sync=values["sync"],
        )  # fmt: skip
        attached = [(Path(name).name, Path(name).read_bytes()) for name in values["attach"]]
        context = provenance({"node": node.get_fully_qualified_name(), "topics": " ".join(chosen)})
        self.folder = free_folder(node, Path(values["out"]))
        bag = BagWriter(self.folder, options, context, patient=True)
        self._writer = WriterThread(bag, int(values["queue_mb"] * 1e6))
        # log times: steady, so that the bag's order is that of arrival whatever happens to the clock
        self._clock_ns = time.time_ns() - time.monotonic_ns()
        for name, data in attached:
            self._writer.attach(name, "application/octet-stream", data, self._now())
        self._exit, self._ended, self._heard = values["exit_at_end"], False, time.monotonic()
        self._slots: list[TopicSlot] = []
        self._attached: set[str] = set()
        self._pending: list[str] = []
        for name in chosen:
            if name in TOPICS and name != STATE:
                self._subscribe(name, *TOPICS[name])
            elif name not in TOPICS:
                self._pending.append(name)
        # the bridge waits for its readers: so a run begins when its nodes' parameters are in the bag
        self._state_due = time.monotonic() + _SNAPSHOT_S if STATE in chosen else None
        self._parameters = ParameterSnapshot(node, self._attach_parameters, lambda: any(s.running for s in self._slots))
        self._writer.start()
        self._diagnostics = Diagnostics(node, self._health)
        self._timer = node.create_timer(0.1, self._look, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def close(self) -> None:
        """Write what is queued and finish the bag."""
        for slot in self._slots:
            slot.register(self._node, self._writer)
        self._writer.close()

    def _now(self) -> int:
        return self._clock_ns + time.monotonic_ns()

    def _subscribe(self, name: str, msgtype: str, qos: QoSProfile) -> None:
        slot = TopicSlot(self._node.resolve_topic_name(name), msgtype)
        self._slots.append(slot)
        callback = partial(self._take_state if name == STATE else self._take, slot)
        self._node.create_subscription(message_class(msgtype), name, callback, deepened(qos, DEPTH), raw=True)

    def _take(self, slot: TopicSlot, data: bytes) -> None:
        now = self._now()
        if slot.number is None:
            slot.register(self._node, self._writer)
        self._writer.put(slot.number, slot.sequence(data), now, data)  # type: ignore[arg-type]
        if slot.numbered:
            self._heard = time.monotonic()

    def _take_state(self, slot: TopicSlot, data: bytes) -> None:
        self._take(slot, data)
        if self._exit and SampleFlag.END in convert.state_from_bytes(data).flags:
            self._ended = True

    def _look(self) -> None:
        """Topics named but not known: wait until somebody says their type. And the run's beginning and end."""
        if self._state_due is not None and (self._parameters.settled() or time.monotonic() > self._state_due):
            self._state_due = None
            self._subscribe(STATE, *TOPICS[STATE])
        if self._pending:
            known = dict(self._node.get_topic_names_and_types())
            for name in list(self._pending):
                types = known.get(self._node.resolve_topic_name(name))
                if types:
                    self._pending.remove(name)
                    self._subscribe(name, types[0], STREAM)
        if self._ended and time.monotonic() - self._heard > _QUIET_S:
            self._node.context.try_shutdown()

    def _attach_parameters(self, name: str, values: Mapping[str, Any]) -> None:
        text = yaml.safe_dump(dict(values), sort_keys=False, allow_unicode=True)
        for path, data in {f"parameters/{name}.yaml": text.encode(), **referenced_files(values)}.items():
            if path not in self._attached:
                self._attached.add(path)
                self._writer.attach(path, "application/yaml", data, self._now())

    def _health(self) -> Health:
        status = self._writer.status()
        values = {"folder": str(self.folder), **_figures(status)}
        if status.problem or status.unwritten or status.dropped:
            lost = status.unwritten + status.dropped
            return Health(Level.ERROR, f"{status.problem or 'messages were lost'} ({lost} messages lost)", values)
        if status.lost:
            return Health(Level.WARN, f"{status.lost} messages never arrived", values)
        return Health(Level.OK, "recording", values)


def _figures(status: WriterStatus) -> Mapping[str, Any]:
    return {name: getattr(status, name) for name in WriterStatus.__slots__ if name != "problem"}


def _checked(values: Mapping[str, Any]) -> Mapping[str, Any]:
    if not values["out"]:
        raise ParameterError("out is empty; name the bag's folder, such as -p out:=runs/bag")
    for name in values["attach"]:
        if not Path(name).is_file():
            raise ParameterError(f"attach: there is no file {name}")
    return values


def main(args: list[str] | None = None) -> int:
    """Run the node."""
    return run_node(NAME, Recorder, args)
