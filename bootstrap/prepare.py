"""Runs the outdated stages under a lock, with progress, and turns failures into exit statuses."""

import fcntl
import signal
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import NoReturn

from .checks import require_machine
from .display import TerminalDisplay
from .errors import PreparationError
from .processes import Processes
from .stages import Stage, Stamps, run
from .world import World


class Terminated(BaseException):
    """The preparation was told to end (SIGTERM, SIGHUP)."""


def prepare(world: World, outdated: Callable[[], list[Stage]], stamps: Stamps, processes: Processes) -> int:
    """Make the world ready; returns an exit status: 0 ready, 1 failed, 130 interrupted."""
    endings = (signal.SIGTERM, signal.SIGHUP)
    for number in endings:
        signal.signal(number, _terminate)
    try:
        make_ready(world, outdated, stamps, processes)
        return 0
    except PreparationError as error:
        _say(str(error))
        return 1
    except OSError as error:
        _say(f"{error.filename or world.home}: {error.strerror}.")
        return 1
    except (KeyboardInterrupt, Terminated):
        _say("interrupted; start again and it goes on from where it was.")
        return 130
    finally:
        for number in endings:
            signal.signal(number, signal.SIG_DFL)


def make_ready(world: World, outdated: Callable[[], list[Stage]], stamps: Stamps, processes: Processes) -> None:
    """Run what is outdated, alone in this checkout. Raises PreparationError."""
    world.home.mkdir(parents=True, exist_ok=True)
    with alone(world) as lock:
        processes.inherited = (lock,)  # should this process be killed, the lock is held until its commands have ended
        todo = outdated()  # another start may have done it while this one waited
        if todo:
            require_machine(world)
            _run(world, todo, stamps, processes)


def _run(world: World, todo: list[Stage], stamps: Stamps, processes: Processes) -> None:
    where = f"with ROS 2 {world.ros}" if world.ros else "private, from wheels"
    version = ".".join(map(str, world.version))
    print(f"Preparing the station's environment (Python {version}, {where}) in {world.home}", file=sys.stderr)
    display = TerminalDisplay(len(todo))
    start = time.monotonic()
    try:
        run(todo, stamps, display, processes.stop)
    finally:
        display.close()
    _remember_python(world)
    print(f"Ready after {time.monotonic() - start:.1f} s.", file=sys.stderr)


def _remember_python(world: World) -> None:
    """Spare the entry script its search the next time."""
    temporary = world.memo.with_suffix(".new")
    temporary.write_text(f"{world.python}\n", encoding="utf-8")
    temporary.replace(world.memo)


@contextmanager
def alone(world: World) -> Iterator[int]:
    """Hold the checkout's lock, an open file; wait, and say so, while another start prepares."""
    with (world.state / "lock").open("w", encoding="utf-8") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            _say("another start is preparing this checkout; waiting for it.")
            fcntl.flock(lock, fcntl.LOCK_EX)
        yield lock.fileno()


def _terminate(number: int, frame: FrameType | None) -> NoReturn:
    raise Terminated


def _say(text: str) -> None:
    print(f"dt-station: {text}", file=sys.stderr)
