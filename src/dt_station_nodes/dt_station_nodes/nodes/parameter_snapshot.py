"""The parameters of every node of the station, read once as they appear; changes are on /parameter_events."""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from rcl_interfaces.srv import GetParameters, ListParameters
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.parameter import parameter_value_to_python

_POLL_S = 0.1
_PATIENCE_S = 1.0
_ACQUAINTED_S = 0.3
_RUNNING_S = 1.5
_QUIET_S = 0.3


@dataclass
class _Inquiry:
    """A node being asked: an answer that reaches nobody yet is lost in DDS, so it is asked again.

    `question` numbers what was asked last: a late answer to an earlier one is none. `left` are the names still to
    be got, `singly` one by one.
    """

    lister: Any
    getter: Any
    ready_since: float
    asked: float = -_PATIENCE_S
    question: int = 0
    done: bool = False
    listed: bool = False
    singly: bool = False
    left: list[str] = field(default_factory=list)
    found: dict[str, Any] = field(default_factory=dict)


class ParameterSnapshot:
    """Calls `keep` with a node's name and its parameters, for each node of the own namespace.

    `running` says whether the station runs already, so that nobody may be held up.
    """

    def __init__(
        self,
        node: Node,
        keep: Callable[[str, Mapping[str, Any]], None],
        running: Callable[[], bool] = lambda: False,
    ) -> None:
        self._node, self._keep, self._running = node, keep, running
        self._inquiries: dict[str, _Inquiry] = {}
        self._newest = time.monotonic()
        self._timer = node.create_timer(_POLL_S, self._look, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def settled(self) -> bool:
        """Whether all nodes seen have answered, and no new one has appeared for a moment."""
        quiet = time.monotonic() - self._newest > _QUIET_S
        return quiet and len(self._inquiries) > 1 and all(each.done for each in self._inquiries.values())

    def _look(self) -> None:
        try:
            self._ask_around()
        except Exception:
            # a signal may end the context between two lines
            if self._node.context.ok():
                raise

    def _ask_around(self) -> None:
        here = self._node.get_namespace()
        names = {name for name, space in self._node.get_node_names_and_namespaces() if space == here}
        for name in sorted(names - set(self._inquiries)):
            self._newest = time.monotonic()
            path = f"{here.rstrip('/')}/{name}"
            self._inquiries[name] = _Inquiry(
                self._node.create_client(ListParameters, f"{path}/list_parameters"),
                self._node.create_client(GetParameters, f"{path}/get_parameters"),
                self._newest,
            )
        for name in set(self._inquiries) - names:
            # a node that comes back is asked again
            gone = self._inquiries.pop(name)
            self._node.destroy_client(gone.lister)
            self._node.destroy_client(gone.getter)
        now = time.monotonic()
        for name, inquiry in self._inquiries.items():
            ready = inquiry.lister.service_is_ready() and inquiry.getter.service_is_ready()
            if not ready:
                inquiry.ready_since = now
            # a node that does not know its client yet holds its answer, and everything else, for a tenth of a second
            needed = _RUNNING_S if self._running() else _ACQUAINTED_S
            acquainted = ready and now - inquiry.ready_since >= needed
            if not inquiry.done and acquainted and now - inquiry.asked > _PATIENCE_S:
                self._ask(name, inquiry)

    def _ask(self, name: str, inquiry: _Inquiry) -> None:
        """Ask for what is left, or for the names first."""
        inquiry.asked = time.monotonic()
        inquiry.question += 1
        if not inquiry.listed:
            answer = inquiry.lister.call_async(ListParameters.Request())
            answer.add_done_callback(partial(self._listed, name, inquiry, inquiry.question))
            return
        # one at a time: a client keeps no more than ten answers
        names = inquiry.left[:1] if inquiry.singly else list(inquiry.left)
        answer = inquiry.getter.call_async(GetParameters.Request(names=names))
        answer.add_done_callback(partial(self._got, name, inquiry, inquiry.question, names))

    def _listed(self, name: str, inquiry: _Inquiry, question: int, future: Any) -> None:
        if question != inquiry.question:
            return
        inquiry.listed, inquiry.left = True, sorted(future.result().result.names)
        self._ask(name, inquiry)

    def _got(self, name: str, inquiry: _Inquiry, question: int, names: list[str], future: Any) -> None:
        if question != inquiry.question:
            return
        values = future.result().values
        if len(values) < len(names) and len(names) > 1:
            # one parameter without a value spoils the answer for all
            inquiry.singly = True
            self._ask(name, inquiry)
            return
        for key, value in zip(names, values, strict=False):
            python = parameter_value_to_python(value)
            inquiry.found[key] = list(python) if hasattr(python, "tolist") else python
        inquiry.left = inquiry.left[len(names) :]
        if inquiry.left:
            self._ask(name, inquiry)
            return
        inquiry.done, inquiry.question = True, 0
        self._keep(name, dict(sorted(inquiry.found.items())))
