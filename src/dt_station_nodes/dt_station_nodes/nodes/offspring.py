"""Node processes seen from the supervisor: started through the nursery, signalled and awaited."""

import json
import os
import queue
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

from . import lifeline

_START_S = 120.0


class NurseryError(Exception):
    """The process that starts the nodes did not start or has died."""


class Child:
    """One node process."""

    def __init__(self, pid: int, statuses: dict[int, int], nursery: subprocess.Popen[bytes]) -> None:
        self.pid = pid
        self._statuses = statuses
        self._nursery = nursery

    def poll(self) -> int | None:
        """Exit status once it has ended; negative: the signal that ended it."""
        status = self._statuses.get(self.pid)
        if status is None and self._nursery.poll() is not None:
            # the nursery is gone and its children with it
            return -signal.SIGKILL
        return status

    def send_signal(self, sent: signal.Signals) -> None:
        """Signal it unless it has ended."""
        if self.poll() is None:
            os.kill(self.pid, sent)

    def wait(self, timeout_s: float) -> int | None:
        """Exit status, or None if it still lives after the time."""
        end = time.monotonic() + timeout_s
        while (status := self.poll()) is None and time.monotonic() < end:
            time.sleep(0.005)
        return status


class Nursery:
    """Starts nodes by forking; keep one for several runs to start the later ones at once."""

    def __init__(self, executables: Sequence[str]) -> None:
        # one thread of linear algebra each: the nodes' matrices are tiny, and forking wants no threads
        environment = {
            **os.environ,
            "OPENBLAS_NUM_THREADS": "1",
            "OMP_NUM_THREADS": "1",
            lifeline.VARIABLE: str(os.getpid()),
        }
        self._process = subprocess.Popen(
            [sys.executable, "-m", f"{__package__}.nursery", *sorted(set(executables))],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=environment,
            start_new_session=True,
        )
        self._statuses: dict[int, int] = {}
        self._started: queue.Queue[int] = queue.Queue()
        self._listener = threading.Thread(target=self._listen, daemon=True)
        self._listener.start()

    def start(self, arguments: Sequence[str], log: Path, environment: Mapping[str, str] | None = None) -> Child:
        """Start one node: its executable and arguments, and what its environment has besides. Raises NurseryError."""
        wanted = {"argv": list(arguments), "log": str(log), "environment": dict(environment or {})}
        request = json.dumps(wanted) + "\n"
        try:
            assert self._process.stdin is not None
            self._process.stdin.write(request.encode())
            self._process.stdin.flush()
        except (OSError, ValueError):
            raise NurseryError("the process that starts the nodes has died; run dt-station doctor") from None
        end = time.monotonic() + _START_S
        while time.monotonic() < end:
            try:
                return Child(self._started.get(timeout=0.1), self._statuses, self._process)
            except queue.Empty:
                if self._process.poll() is not None:
                    raise NurseryError("the process that starts the nodes has died; run dt-station doctor") from None
        raise NurseryError("the process that starts the nodes does not answer; run dt-station doctor")

    def close(self) -> None:
        """End it and whatever it started; safe to call twice."""
        if self._process.stdin is not None and not self._process.stdin.closed:
            self._process.stdin.close()
        try:
            self._process.wait(10.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._listener.join(1.0)
        if self._process.stdout is not None:
            self._process.stdout.close()

    def _listen(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            facts = json.loads(line)
            if "status" in facts:
                self._statuses[facts["pid"]] = facts["status"]
            else:
                self._started.put(facts["pid"])
