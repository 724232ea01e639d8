"""The progress of the preparation on standard error; plain lines where it is not a terminal."""

import os
import shutil
import sys
import time
from typing import TextIO

from .stages import Stage

FRAMES = "|/-\\"


class TerminalDisplay:
    """One line a running stage, redrawn in place; a finished stage leaves its line with its seconds."""

    def __init__(self, total: int, stream: TextIO = sys.stderr) -> None:
        self.stream = stream
        self.total = total
        self.done = 0
        self.live = stream.isatty() and os.environ.get("TERM", "dumb") != "dumb"
        self.running: dict[str, tuple[Stage, float, str]] = {}
        self.drawn = 0

    def started(self, stage: Stage) -> None:
        """A stage begins."""
        self.running[stage.name] = (stage, time.monotonic(), "")
        if not self.live:
            self._print(f"  ... {stage.title}")
        self.refresh()

    def line(self, stage: Stage, text: str) -> None:
        """Remember a stage's newest line of output."""
        if stage.name in self.running:
            self.running[stage.name] = (stage, self.running[stage.name][1], " ".join(text.split()))

    def finished(self, stage: Stage, seconds: float) -> None:
        """A stage is done."""
        self.running.pop(stage.name, None)
        self.done += 1
        self._erase()
        self._print(f"  [{self.done}/{self.total}] {stage.title}: {seconds:.1f} s")
        self.refresh()

    def refresh(self) -> None:
        """Redraw the running stages."""
        if not self.live:
            return
        self._erase()
        width = shutil.get_terminal_size().columns - 1
        now = time.monotonic()
        for stage, start, text in list(self.running.values()):
            frame = FRAMES[int(now * 8) % len(FRAMES)]
            self._print(f"  {frame} {stage.title} {now - start:4.0f} s  {text}"[:width])
            self.drawn += 1
        self.stream.flush()

    def close(self) -> None:
        """Leave nothing half-drawn."""
        self._erase()
        self.stream.flush()

    def _erase(self) -> None:
        if self.drawn:
            self.stream.write(f"\x1b[{self.drawn}F\x1b[J")
            self.drawn = 0

    def _print(self, text: str) -> None:
        self.stream.write(text + "\n")
        if not self.live:
            self.stream.flush()
