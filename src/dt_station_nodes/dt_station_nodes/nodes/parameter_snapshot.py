"""The parameters of every node of the station, read once as they appear; changes are on /parameter_events."""

from collections.abc import Callable
from functools import partial
from typing import Any

import yaml
from rcl_interfaces.srv import GetParameters, ListParameters
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.parameter import parameter_value_to_python

_POLL_S = 1.0


class ParameterSnapshot:
    """Calls `keep` with a node's name and its parameters as YAML, for each node of the own namespace."""

    def __init__(self, node: Node, keep: Callable[[str, str], None]) -> None:
        self._node, self._keep = node, keep
        self._asked: dict[str, tuple[Any, Any]] = {}
        self._found: dict[str, dict[str, Any]] = {}
        self._open: dict[str, int] = {}
        self._timer = node.create_timer(_POLL_S, self._look, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _look(self) -> None:
        here = self._node.get_namespace()
        names = {name for name, space in self._node.get_node_names_and_namespaces() if space == here}
        for name in sorted(names - set(self._asked)):
            path = f"{here.rstrip('/')}/{name}"
            clients = (
                self._node.create_client(ListParameters, f"{path}/list_parameters"),
                self._node.create_client(GetParameters, f"{path}/get_parameters"),
            )
            self._asked[name] = clients
        for name, (lister, getter) in list(self._asked.items()):
            if lister is not None and lister.service_is_ready() and getter.service_is_ready():
                self._asked[name] = (None, getter)
                lister.call_async(ListParameters.Request()).add_done_callback(partial(self._listed, name))
        for name in set(self._asked) - names:
            # a node that comes back is asked again
            del self._asked[name]
            self._found.pop(name, None)
            self._open.pop(name, None)

    def _listed(self, name: str, future: Any) -> None:
        self._ask(name, sorted(future.result().result.names))

    def _ask(self, name: str, names: list[str]) -> None:
        _, getter = self._asked.get(name, (None, None))
        if getter is not None:
            getter.call_async(GetParameters.Request(names=names)).add_done_callback(partial(self._got, name, names))

    def _got(self, name: str, names: list[str], future: Any) -> None:
        values = future.result().values
        found = self._found.setdefault(name, {})
        for key, value in zip(names, values, strict=False):
            python = parameter_value_to_python(value)
            found[key] = list(python) if hasattr(python, "tolist") else python
        if len(values) < len(names) and len(names) > 1:
            # one parameter without a value spoils the answer for all: ask for each
            self._open[name] = len(names)
            for single in names:
                self._ask(name, [single])
            return
        self._open[name] = self._open.get(name, 1) - 1
        if self._open[name] <= 0:
            self._keep(name, yaml.safe_dump(dict(sorted(found.items())), sort_keys=False, allow_unicode=True))
