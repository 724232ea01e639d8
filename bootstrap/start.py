"""Prepare what is not up to date, then replace this process by the command line."""

import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

from .plan import plan
from .processes import Processes
from .stages import Stage, Stamps, stale
from .world import World, current_world, variables

ROOT = Path(__file__).resolve().parents[1]
INSTALLING = {"tools", "packages"}


def main(arguments: Sequence[str]) -> int:
    """Run `./dt-station ARGUMENTS`; returns, with an exit status, only where the preparation failed."""
    world = current_world(ROOT, os.environ)
    processes = Processes()
    stamps = Stamps(world.home / "stamps")
    if outdated(world, stamps, processes):
        from .prepare import prepare

        status = prepare(world, lambda: outdated(world, stamps, processes), stamps, processes)
        if status:
            return status
    _become(world, arguments)


def _become(world: World, arguments: Sequence[str]) -> NoReturn:
    env = variables(world, os.environ)
    python = str(world.venv_python)
    sys.stdout.flush()
    os.execve(python, [python, "-m", "dt_station_nodes.cli", *arguments], env)


def outdated(world: World, stamps: Stamps, processes: Processes) -> list[Stage]:
    """Return the stages to run before the command line can."""
    if not os.access(world.venv_python, os.X_OK):
        stamps.remove("venv")
    stages = plan(world, processes, os.environ)
    todo = stale(stages, stamps)
    if any(stage.name in INSTALLING for stage in todo) and not world.uv.is_file():
        stamps.remove("uv")  # it could not be had the last time; perhaps now
        todo = stale(stages, stamps)
    return todo
