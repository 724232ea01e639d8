"""Changing the running station from outside: waveforms by topic, parameters by service."""

import math
from collections.abc import Mapping
from types import TracebackType
from typing import Any

from rcl_interfaces.srv import GetParameters, SetParametersAtomically
from rclpy.parameter import Parameter as RosParameter
from rclpy.parameter import parameter_value_to_python

from dt_station_msgs.msg import Waveform

from ..core.errors import StationError
from .load_generator import SHAPES
from .qos import WAVEFORM
from .scenario import NAMESPACE
from .watch import Watch

_WAVEFORM = ("shape", "amplitude", "offset", "frequency_hz", "phase_rad", "duty")
_ACQUAINTED_S = 1.0
_CONTROLLER = {"load": "pressure_controller", "position": "position_controller"}


class RemoteError(StationError):
    """The running station was not found, or refused a change."""


class Remote:
    """`with Remote(wait_s) as station: station.set_waveform("load", {...})`."""

    def __init__(self, wait_s: float = 10.0) -> None:
        self._wait_s = wait_s
        self._watch = Watch("dt_station_set")
        self._clients: dict[str, Any] = {}

    def __enter__(self) -> "Remote":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._watch.close()

    def generator(self, channel: str) -> str:
        """Name of the node that plays a channel's set-point. Raises RemoteError."""
        topic = f"/{NAMESPACE}/{channel}/waveform"

        def listening() -> list[str]:
            infos = self._watch.node.get_subscriptions_info_by_topic(topic)
            return [i.node_name for i in infos if i.node_name not in ("recorder", "_NODE_NAME_UNKNOWN_")]

        names = self._await(listening)
        if not names:
            raise RemoteError(
                f"no generator of the {channel} set-point is running; start the station with dt-station run."
            )
        return str(names[0])

    def set_waveform(self, channel: str, changes: Mapping[str, Any]) -> dict[str, Any]:
        """Publish the running waveform with these changes; returns what plays then. Raises RemoteError."""
        name = self.generator(channel)
        wanted = {**self._get(name, _WAVEFORM), **changes}
        if wanted["shape"] not in SHAPES:
            raise RemoteError(f"shape {wanted['shape']!r} is unknown; there are {', '.join(SHAPES)}.")
        if "shape" in changes and "duty" not in changes:
            wanted["duty"] = SHAPES[wanted["shape"]].usual_duty
        message = Waveform(
            shape=SHAPES[wanted["shape"]].value,
            amplitude=wanted["amplitude"],
            offset=wanted["offset"],
            frequency=wanted["frequency_hz"],
            phase=wanted["phase_rad"],
            duty=wanted["duty"],
        )
        publisher = self._watch.node.create_publisher(Waveform, f"{channel}/waveform", WAVEFORM)
        if not self._await(publisher.get_subscription_count):
            raise RemoteError(f"the generator {name} does not listen; is the station still running?")
        publisher.publish(message)
        if not self._await(lambda: _equal(self._get(name, _WAVEFORM), wanted)):
            reason = self._watch.observed.health.get(name)
            raise RemoteError(f"{name} did not take the waveform{': ' + reason.message if reason else ''}.")
        return wanted

    def play(self, channel: str, changes: Mapping[str, Any]) -> tuple[dict[str, Any], int]:
        """As `set_waveform`; also the number of the first sample that the waveform is for. Raises RemoteError."""
        name = self.generator(channel)
        before = self._await(lambda: self._since(name))
        playing = self._get(name, _WAVEFORM)
        wanted = self.set_waveform(channel, changes)
        if _equal(playing, wanted):
            return wanted, self._since(name)[0]
        if not before or not self._await(lambda: self._since(name) != before):
            raise RemoteError(f"{name} does not say since when its waveform plays.")
        return wanted, self._since(name)[0]

    def _since(self, generator: str) -> tuple[int, ...]:
        """From which sample on a generator plays its waveform; empty before its first report."""
        since = self._watch.observed.value(generator, "since")
        return () if since is None else (since,)

    def set_controller(self, channel: str, changes: Mapping[str, Any]) -> dict[str, Any]:
        """Set parameters of a channel's controller, and of a twin that simulates it. Raises RemoteError."""
        done = self.set_parameters(_CONTROLLER[channel], changes)
        twins = [name for name in self._watch.node.get_node_names() if name == "twin_simulator"]
        for twin in twins:
            own = {f"{channel}.{name}": value for name, value in changes.items()}
            if all(value is not None for value in self._get(twin, tuple(own)).values()):
                self.set_parameters(twin, own)
        return done

    def set_parameters(self, node: str, changes: Mapping[str, Any]) -> dict[str, Any]:
        """Set parameters of one node, all or none. Raises RemoteError with the node's reason."""
        parameters = [RosParameter(name, value=value).to_parameter_msg() for name, value in changes.items()]
        request = SetParametersAtomically.Request(parameters=parameters)
        result = self._call(node, SetParametersAtomically, "set_parameters_atomically", request).result
        if not result.successful:
            raise RemoteError(f"{node} refused: {result.reason}")
        return dict(changes)

    def _get(self, node: str, names: tuple[str, ...]) -> dict[str, Any]:
        """Values by name; None for a parameter that the node does not have."""
        answer = self._call(node, GetParameters, "get_parameters", GetParameters.Request(names=list(names)))
        if len(answer.values) == len(names):
            return dict(zip(names, map(parameter_value_to_python, answer.values), strict=True))
        # one unknown name spoils the answer for all
        return {name: self._get(node, (name,))[name] for name in names} if len(names) > 1 else {names[0]: None}

    def _call(self, node: str, kind: Any, service: str, request: Any) -> Any:
        path = f"/{NAMESPACE}/{node}/{service}"
        client = self._clients.get(path)
        if client is None:
            client = self._watch.node.create_client(kind, path)
            if not self._await(client.service_is_ready):
                self._watch.node.destroy_client(client)
                raise RemoteError(f"the node {node} is not running; start the station with dt-station run.")
            self._clients[path] = client
            # a node that does not know its client yet holds its answer, and everything else, for a tenth of a second
            self._watch.spin(_ACQUAINTED_S)
        future = client.call_async(request)
        if not self._await(future.done):
            raise RemoteError(f"the node {node} does not answer.")
        return future.result()

    def _await(self, condition: Any) -> Any:
        self._watch.spin(self._wait_s, condition)
        return condition()


def _equal(have: Mapping[str, Any], wanted: Mapping[str, Any]) -> bool:
    return all(
        math.isclose(have[name], wanted[name]) if isinstance(wanted[name], float) else have[name] == wanted[name]
        for name in have
        if name != "frequency_hz" or wanted["shape"] != "constant"
    )
