"""Child processes of the preparation: output into a log, stopped together when the preparation stops."""

import contextlib
import os
import signal
import subprocess
import threading
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from .errors import PreparationError

TAIL_LINES = 25


class Processes:
    """Starts commands and can stop all that run, each with its own children."""

    def __init__(self) -> None:
        self._running: set[subprocess.Popen[str]] = set()
        self._guard = threading.Lock()
        self._stopped = False
        self.inherited: tuple[int, ...] = ()  # open files that the commands hold as well, such as a lock

    @property
    def stopped(self) -> bool:
        """Whether everything was told to stop."""
        return self._stopped

    def run(
        self,
        command: Sequence[str],
        log: Path,
        env: Mapping[str, str],
        show: Callable[[str], None],
        cwd: Path | None = None,
    ) -> None:
        """Run a command, its output appended to the log and shown line by line. Raises PreparationError if it fails."""
        log.parent.mkdir(parents=True, exist_ok=True)
        with self._guard:
            if self._stopped:
                raise PreparationError("stopped")
            process = subprocess.Popen(
                list(command),
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                text=True,
                errors="replace",
                env=dict(env),
                cwd=cwd,
                start_new_session=True,
                pass_fds=self.inherited,
            )
            self._running.add(process)
        lines: list[str] = []
        try:
            with log.open("a", encoding="utf-8") as file:
                file.write(f"$ {' '.join(command)}\n")
                for line in process.stdout or ():
                    file.write(line)
                    lines.append(line)
                    if line.strip():
                        show(line)
            status = process.wait()
        finally:
            with self._guard:
                self._running.discard(process)
        if status:
            tail = "".join(lines[-TAIL_LINES:]).rstrip()
            name = Path(command[0]).name
            raise PreparationError(f"{tail}\n{name} failed with exit status {status}; its whole output is in {log}.")

    def stop(self) -> None:
        """End every running command and all its children; start no more."""
        with self._guard:
            self._stopped = True
            running = list(self._running)
        for process in running:
            _signal(process, signal.SIGTERM)
        for process in running:
            try:
                process.wait(timeout=2.0)
            except subprocess.TimeoutExpired:
                _signal(process, signal.SIGKILL)


def _signal(process: "subprocess.Popen[str]", number: int) -> None:
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(process.pid, number)
