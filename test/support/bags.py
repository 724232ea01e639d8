"""Small station bags for the tests, serialized by the rosbags library."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from dt_station_nodes.records.bagwriter import BagWriter, RecordedTopic, WriterOptions
from dt_station_nodes.records.definitions import installed_definition, type_hash, typestore
from dt_station_nodes.records.rosbag2 import TopicInfo, dump_qos

STATE = "/station/object/state"
TWIN = "/station/twin/state"
LOAD = "/station/load/command"
POSITION = "/station/position/command"
STEP_NS = 20_000_000
START_NS = 1_700_000_000_000_000_000
QOS = dump_qos(
    [
        {
            "history": "keep_last",
            "depth": 10,
            "reliability": "reliable",
            "durability": "volatile",
            "deadline": {"sec": 9223372036, "nsec": 854775807},
            "lifespan": {"sec": 9223372036, "nsec": 854775807},
            "liveliness": "automatic",
            "liveliness_lease_duration": {"sec": 9223372036, "nsec": 854775807},
            "avoid_ros_namespace_conventions": False,
        }
    ]
)
TYPES = {
    STATE: "dt_station_msgs/msg/PlantState",
    TWIN: "dt_station_msgs/msg/PlantState",
    LOAD: "dt_station_msgs/msg/ValveCommand",
    POSITION: "dt_station_msgs/msg/ValveCommand",
}
STORE = typestore({name: installed_definition(name) for name in set(TYPES.values())})


def make(msgtype: str, stamp_ns: int, frame: str, **values: Any) -> Any:
    """A message object with its header filled in."""
    types = STORE.types
    seconds, nanoseconds = divmod(stamp_ns, 1_000_000_000)
    stamp = types["builtin_interfaces/msg/Time"](sec=seconds, nanosec=nanoseconds)
    return types[msgtype](header=types["std_msgs/msg/Header"](stamp=stamp, frame_id=frame), **values)


def state_values(k: int) -> dict[str, float]:
    """What sample k measures; irrational on purpose, so that every bit counts."""
    return {
        "position": float(np.sin(0.1 * k) * 0.1),
        "pressure": float(np.cos(0.07 * k) * 1e6 + 2e6),
        "load_voltage": float(np.sin(0.05 * k) * 5),
        "servo_voltage": float(np.cos(0.03 * k)),
    }


def station_messages(
    samples: int, skip: frozenset[int] | set[int] = frozenset(), restart_at: int | None = None
) -> Iterator[tuple[str, int, int, bytes]]:
    """(topic, sequence, log time ns, serialized) of a run, in order; numbers begin anew at `restart_at`."""
    for k in range(samples):
        if k in skip:
            continue
        number = k if restart_at is None or k < restart_at else k - restart_at
        stamp = START_NS + k * STEP_NS
        for i, topic in enumerate((STATE, LOAD, POSITION, TWIN)):
            if TYPES[topic].endswith("PlantState"):
                body = make(TYPES[topic], stamp, "object", sequence=number, flags=0, reserved=0, **state_values(k))
            else:
                values = {"voltage": 0.5 * k, "setpoint": float(100 + k) if topic == LOAD else 0.001 * k}
                body = make(TYPES[topic], stamp, "station", sequence=number, mode=1, limited=False, **values)
            yield topic, number, stamp + 1000 * i, bytes(STORE.serialize_cdr(body, TYPES[topic]))


def recorded(topic: str, swap: tuple[str, str] | None = None) -> RecordedTopic:
    """A topic as the recorder registers it; `swap` exchanges two fields in the definition, not in its hash."""
    text = installed_definition(TYPES[topic])
    digest = type_hash(TYPES[topic], text)
    if swap is not None:
        first, second = (f"float64 {name} " for name in swap)
        text = text.replace(first, "@").replace(second, first).replace("@", second)
    return RecordedTopic(TopicInfo(topic, TYPES[topic], 0, QOS, digest), text)


def write_bag(
    folder: Path,
    samples: int = 100,
    options: WriterOptions | None = None,
    per_tick: int = 25,
    skip: frozenset[int] | set[int] = frozenset(),
    restart_at: int | None = None,
    swap: tuple[str, str] | None = None,
) -> Path:
    """A whole bag of a run; one chunk every `per_tick` samples."""
    writer = BagWriter(folder, options or WriterOptions(sync=False), {"version": "test"})
    numbers = {topic: writer.topic(recorded(topic, swap)) for topic in TYPES}
    writer.attach("models/paper.yaml", "application/yaml", b"name: paper\n", START_NS)
    for i, (topic, k, time_ns, data) in enumerate(station_messages(samples, skip, restart_at)):
        writer.write(numbers[topic], k, time_ns, data)
        if i % (4 * per_tick) == 4 * per_tick - 1:
            writer.tick(1.0 + i)
    writer.close()
    return folder
