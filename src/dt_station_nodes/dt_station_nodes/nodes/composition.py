"""A scenario in one process: one context, one executor, every node of it. The same halves, the same topics."""

import contextlib
import os
import time
from types import TracebackType
from typing import Any

import rclpy
from rclpy.context import Context
from rclpy.node import Node
from rclpy.parameter import Parameter as RosParameter
from rclpy.signals import SignalHandlerOptions

from ..core.metronome import Pace
from .dds_profile import use_profile
from .priority import claim_priority, quieten_collector
from .registry import factory
from .scenario import NAMESPACE, NodePlan, Scenario, plan
from .spinning import Part, make_executor, spin
from .statistics import RunStatistics
from .watch import Observations, observe

_SETTLE_S = 10.0


class Composition:
    """One run in this process: `with Composition(scenario) as station: station.wait()`."""

    def __init__(self, scenario: Scenario) -> None:
        self.scenario = scenario
        self.observed = Observations()
        self._plans = plan(scenario)
        self._context = Context()
        self._nodes: list[Node] = []
        self.parts: dict[str, Any] = {}
        self._policy: tuple[int, os.sched_param] | None = None

    def __enter__(self) -> "Composition":
        if self.scenario.pace == Pace.REALTIME.value:
            # threads started from here on inherit it
            self._policy = (os.sched_getscheduler(0), os.sched_getparam(0)) if hasattr(os, "sched_getparam") else None
            claim_priority("10")
        use_profile()
        rclpy.init(args=[], context=self._context, signal_handler_options=SignalHandlerOptions.NO)
        self._executor = make_executor(self._context)
        try:
            for each in self._plans:
                self._add(each)
            watch = self._node("dt_station_watch", [])
            observe(watch, self.observed)
        except BaseException:
            self.stop()
            raise
        quieten_collector()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()

    def wait(self, timeout_s: float | None = None) -> None:
        """Until the run has ended. Raises TimeoutError after `timeout_s`."""
        end = None if timeout_s is None else time.monotonic() + timeout_s
        bridge = next((part for name, part in self.parts.items() if self._executable(name) == "daq_bridge"), None)
        tickers = [part.ticker for part in self.parts.values() if part.ticker is not None]
        late = False

        def over() -> bool:
            nonlocal late
            late = end is not None and time.monotonic() > end
            return late or (bridge is not None and bridge.ended)

        spin(self._executor, self._context, tickers, over)
        if late:
            raise TimeoutError(f"the run did not end within {timeout_s:g} s")
        settled = time.monotonic() + _SETTLE_S
        spin(self._executor, self._context, [], lambda: self._settled(bridge) or time.monotonic() > settled)

    def stop(self) -> RunStatistics:
        """Bring everything to rest, and say how it went; safe to call twice."""
        bridge = next((part for name, part in self.parts.items() if self._executable(name) == "daq_bridge"), None)
        for part in self.parts.values():
            part.close()
        statuses = dict.fromkeys(self.parts, 0)
        if self._context.ok():
            for node in self._nodes:
                self._executor.remove_node(node)
            self._executor.shutdown()
            for node in self._nodes:
                node.destroy_node()
            rclpy.shutdown(context=self._context)
        if self._policy is not None:
            with contextlib.suppress(OSError):
                os.sched_setscheduler(0, *self._policy)
        values = {} if bridge is None else bridge.statistics.health(bridge.running, bridge.ended).values
        return RunStatistics(
            self.scenario.name, True, dict(values), dict(self.observed.summary), statuses, dict.fromkeys(statuses, 0)
        )

    def _add(self, each: NodePlan) -> None:
        overrides = [RosParameter(name, value=value) for name, value in each.parameters.items() if value != []]
        part: Part = factory(each.executable)(self._node(each.name, overrides))
        self.parts[each.name] = part

    def _node(self, name: str, overrides: list[RosParameter]) -> Node:
        node = Node(
            name,
            namespace=NAMESPACE,
            context=self._context,
            use_global_arguments=False,
            parameter_overrides=overrides,
            enable_rosout=False,
        )
        self._nodes.append(node)
        self._executor.add_node(node)
        return node

    def _executable(self, name: str) -> str:
        return next(each.executable for each in self._plans if each.name == name)

    def _settled(self, bridge: Any) -> bool:
        if bridge is None or not any(each.executable == "shadow_compare" for each in self._plans):
            return True
        summary = self.observed.summary
        return bool(summary.get("samples", 0) + summary.get("missed", 0) >= bridge.statistics.samples)
