"""The preparation as a graph of stages: each has a key of what it was made from, and a stamp once it is done.

A stage whose stamp holds its key is up to date. A stamp is removed before its stage runs and written, by renaming,
after it: whatever moment the preparation is stopped at, the next start redoes what was not finished.
"""

import hashlib
import json
import os
import queue
import threading
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol


@dataclass(frozen=True, slots=True)
class Stage:
    """One step of the preparation; `action` gets a callable that shows a line of progress."""

    name: str
    title: str
    key: str
    action: Callable[[Callable[[str], None]], None]
    needs: tuple[str, ...] = ()


class Display(Protocol):
    """What shows the progress."""

    def started(self, stage: Stage) -> None:
        """A stage begins."""

    def line(self, stage: Stage, text: str) -> None:
        """A stage's newest line of output."""

    def finished(self, stage: Stage, seconds: float) -> None:
        """A stage is done."""

    def refresh(self) -> None:
        """Called several times a second."""


class Stamps:
    """The stamps of one world, a small file a stage: key and seconds."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def key(self, name: str) -> str | None:
        """Return the key a stage was last finished with."""
        try:
            return str(json.loads((self.folder / name).read_text(encoding="utf-8"))["key"])
        except (OSError, ValueError, KeyError, TypeError):
            return None

    def remove(self, name: str) -> None:
        """Forget that a stage was finished."""
        (self.folder / name).unlink(missing_ok=True)

    def write(self, stage: Stage, seconds: float) -> None:
        """Remember that a stage is finished."""
        self.folder.mkdir(parents=True, exist_ok=True)
        temporary = self.folder / f".{stage.name}.{os.getpid()}"
        temporary.write_text(json.dumps({"key": stage.key, "seconds": round(seconds, 2)}), encoding="utf-8")
        temporary.replace(self.folder / stage.name)


def digest(*parts: str | bytes) -> str:
    """Return a key made of parts; where one part ends matters."""
    total = hashlib.sha256()
    for part in parts:
        data = part.encode() if isinstance(part, str) else part
        total.update(f"{len(data)}:".encode() + data)
    return total.hexdigest()[:24]


def files_digest(root: Path, paths: Iterable[Path]) -> str:
    """Return a key of files' names and contents."""
    return digest(*(part for path in sorted(paths) for part in (str(path.relative_to(root)), path.read_bytes())))


def stale(stages: Sequence[Stage], stamps: Stamps) -> list[Stage]:
    """Return the stages to run: those not up to date, and those that need one of these."""
    names: set[str] = set()
    for stage in stages:
        if stamps.key(stage.name) != stage.key or names.intersection(stage.needs):
            names.add(stage.name)
    return [stage for stage in stages if stage.name in names]


def run(todo: Sequence[Stage], stamps: Stamps, display: Display, cancel: Callable[[], None]) -> None:
    """Run stages, each as soon as what it needs is done; at the first failure, or Ctrl-C, stop the others and raise."""
    waiting = {stage.name: stage for stage in todo}
    running: dict[str, threading.Thread] = {}
    results: queue.Queue[tuple[Stage, float, BaseException | None]] = queue.Queue()

    def work(stage: Stage) -> None:
        start = time.monotonic()
        try:
            stamps.remove(stage.name)
            stage.action(lambda text: display.line(stage, text))
            stamps.write(stage, time.monotonic() - start)
            results.put((stage, time.monotonic() - start, None))
        except BaseException as error:
            results.put((stage, time.monotonic() - start, error))

    try:
        while waiting or running:
            for stage in _ready(waiting, running):
                del waiting[stage.name]
                running[stage.name] = threading.Thread(target=work, args=(stage,), daemon=True)
                display.started(stage)
                running[stage.name].start()
            try:
                stage, seconds, error = results.get(timeout=0.1)
            except queue.Empty:
                display.refresh()
                continue
            running.pop(stage.name).join()
            if error is not None:
                raise error
            display.finished(stage, seconds)
    except BaseException:
        cancel()
        for thread in running.values():
            thread.join(timeout=5.0)
        raise


def _ready(waiting: Mapping[str, Stage], running: Mapping[str, threading.Thread]) -> list[Stage]:
    open_names = waiting.keys() | running.keys()
    return [stage for stage in waiting.values() if not open_names.intersection(stage.needs)]
