"""Starts a scenario's nodes as processes, watches them, restarts what fell, stops all of them in order."""

import contextlib
import signal
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType

import yaml

from ..core.errors import StationError
from .offspring import Child, Nursery
from .priority import priority_of
from .scenario import NAMESPACE, NodePlan, Scenario, plan
from .statistics import RunStatistics
from .watch import Observations, Watch

_RESTARTS = 5
_STOP_S = 5.0
_SETTLE_S = 10.0
_TAIL = 400


class RunError(Exception):
    """The graph could not be kept running; the sentence says which node and why."""


@dataclass(slots=True)
class _Process:
    plan: NodePlan
    handle: Child
    log: Path
    restarts: int = 0


Progress = Callable[[Observations], None]


class Supervisor:
    """One run as processes: `with Supervisor(scenario) as station: station.wait()`."""

    def __init__(
        self,
        scenario: Scenario,
        log_dir: Path | None = None,
        restart: bool = True,
        nursery: Nursery | None = None,
    ) -> None:
        self.scenario = scenario
        self._nursery, self._own_nursery = nursery, nursery is None
        self._plans = plan(scenario)
        self._restart = restart
        self._folder = tempfile.TemporaryDirectory(prefix="dt-station-") if log_dir is None else None
        self._logs = Path(self._folder.name) if self._folder is not None else Path(str(log_dir))
        self._processes: dict[str, _Process] = {}
        self._statuses: dict[str, int] = {}
        self.bridge = next((p.name for p in self._plans if p.executable == "daq_bridge"), None)
        self._shadow = next((p.name for p in self._plans if p.executable == "shadow_compare"), None)
        self._watch: Watch | None = None

    def __enter__(self) -> "Supervisor":
        self.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()

    @property
    def observed(self) -> Observations:
        """What the nodes said so far."""
        return self.watch.observed

    @property
    def watch(self) -> Watch:
        """The observing node of a started station."""
        if self._watch is None:
            raise RunError("the station was not started")
        return self._watch

    def start(self) -> None:
        """Start every node."""
        self._logs.mkdir(parents=True, exist_ok=True)
        if self._nursery is None:
            self._nursery = Nursery([each.executable for each in self._plans])
        self._watch = Watch()
        try:
            for each in self._plans:
                self._processes[each.name] = self._launch(each)
        except BaseException:
            self.stop()
            raise

    def wait(self, on_progress: Progress | None = None, timeout_s: float | None = None) -> None:
        """Until the run has ended. Raises RunError where a node fell for good; TimeoutError after `timeout_s`."""
        end = None if timeout_s is None else time.monotonic() + timeout_s
        while not self.step(on_progress=on_progress):
            if end is not None and time.monotonic() > end:
                raise TimeoutError(f"the run did not end within {timeout_s:g} s; last heard: {self._heard()}")
        self.watch.spin(_SETTLE_S, self._shadow_done)

    def step(self, duration_s: float = 0.1, on_progress: Progress | None = None) -> bool:
        """Listen and look after the processes for a moment; whether the run has ended."""
        ended = self.watch.spin(duration_s, self._ended)
        if on_progress is not None:
            on_progress(self.observed)
        if ended:
            return True
        self._look_after()
        return False

    def process_id(self, node: str) -> int:
        """Process id of a node, to look at or, in tests, to kill."""
        return self._processes[node].handle.pid

    def stop(self) -> RunStatistics:
        """Stop all nodes, the recorder last, and say how it went; safe to call twice."""
        recorders = [name for name, p in self._processes.items() if p.plan.executable == "recorder"]
        for group in ([name for name in self._processes if name not in recorders], recorders):
            self._stop_group(group)
        statistics = self._statistics()
        self._processes.clear()
        if self._watch is not None:
            self._watch.close()
        if self._nursery is not None and self._own_nursery:
            self._nursery.close()
            self._nursery = None
        if self._folder is not None:
            self._folder.cleanup()
        return statistics

    def _launch(self, each: NodePlan) -> _Process:
        parameters = self._logs / f"{each.name}.yaml"
        values = {name: value for name, value in each.parameters.items() if value != []}
        parameters.write_text(yaml.safe_dump({"/**": {"ros__parameters": values}}, allow_unicode=True), "utf-8")
        arguments = [each.executable, "--ros-args", "-r", f"__node:={each.name}", "-r", f"__ns:=/{NAMESPACE}"]
        log = self._logs / f"{each.name}.log"
        if self._nursery is None:
            raise RunError("the station was not started")
        priority = priority_of(each.executable, self.scenario.pace)
        handle = self._nursery.start([*arguments, "--params-file", str(parameters)], log, priority)
        return _Process(each, handle, log)

    def _look_after(self) -> None:
        for name, process in self._processes.items():
            status = process.handle.poll()
            if status is None or name in self._statuses:
                continue
            last_words = _tail(process.log)
            if status == 2:
                raise StationError(last_words.splitlines()[-1] if last_words else f"{name} refused its parameters")
            if name == self.bridge or not self._restart or process.restarts >= _RESTARTS:
                if not process.plan.required:
                    self._statuses[name] = status
                    continue
                raise RunError(f"{name} ended with status {status}{': ' if last_words else ''}{last_words[-_TAIL:]}")
            renewed = self._launch(process.plan)
            renewed.restarts = process.restarts + 1
            self._processes[name] = renewed
            return

    def _ended(self) -> bool:
        return self.bridge is not None and self.observed.value(self.bridge, "phase") == "ended"

    def _shadow_done(self) -> bool:
        if self._shadow is None or self.bridge is None:
            return True
        taken = self.observed.value(self.bridge, "samples", 0)
        if self._processes[self._shadow].restarts:
            # its count began anew, its place in the run did not
            return bool(self.observed.value(self._shadow, "sequence", -1) >= taken - 1)
        summary = self.observed.summary
        return bool(summary.get("samples", 0) + summary.get("missed", 0) >= taken)

    def _heard(self) -> str:
        return (
            "; ".join(f"{name}: {health.message}" for name, health in sorted(self.observed.health.items())) or "nothing"
        )

    def _stop_group(self, names: Sequence[str]) -> None:
        for sent in (signal.SIGINT, signal.SIGTERM, signal.SIGKILL):
            living = [name for name in names if self._processes[name].handle.poll() is None]
            for name in living:
                with contextlib.suppress(ProcessLookupError):
                    self._processes[name].handle.send_signal(sent)
            end = time.monotonic() + _STOP_S
            for name in living:
                self._processes[name].handle.wait(max(0.0, end - time.monotonic()))
        for name in names:
            status = self._processes[name].handle.poll()
            self._statuses.setdefault(name, -signal.SIGKILL if status is None else status)

    def _statistics(self) -> RunStatistics:
        observed = self._watch.observed if self._watch is not None else Observations()
        bridge = observed.health.get(self.bridge or "")
        return RunStatistics(
            self.scenario.name,
            False,
            dict(bridge.values) if bridge is not None else {},
            dict(observed.summary),
            dict(self._statuses),
            {name: process.restarts for name, process in self._processes.items()},
            {name: {"level": h.level, "message": h.message} for name, h in sorted(observed.health.items())},
        )


def _tail(log: Path) -> str:
    with contextlib.suppress(OSError):
        return log.read_text("utf-8", "replace").strip()[-4000:]
    return ""
