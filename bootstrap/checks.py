"""What the machine itself must have; said in one sentence before anything is downloaded."""

import platform
import re
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

from . import debian
from .errors import PreparationError
from .world import World

OLDEST_CMAKE = (3, 22)


def usable_cmake() -> bool:
    """Whether the machine's own cmake is new enough."""
    path = shutil.which("cmake")
    if path is None:
        return False
    try:
        answer = subprocess.run([path, "--version"], capture_output=True, text=True, timeout=20, check=False).stdout
    except OSError:
        return False
    match = re.search(r"(\d+)\.(\d+)", answer)
    return match is not None and (int(match[1]), int(match[2])) >= OLDEST_CMAKE


def compiler_missing() -> bool:
    """Whether there is neither a C nor a C++ compiler pair."""
    return not any(shutil.which(name) for name in ("g++", "clang++", "c++")) or not any(
        shutil.which(name) for name in ("gcc", "clang", "cc")
    )


def require_machine(world: World) -> None:
    """Raise PreparationError, naming everything that is missing, where this machine cannot become a station."""
    if platform.system() != "Linux":
        raise PreparationError(f"the station runs on Linux; this is {platform.system()}.")
    if world.ros is None and platform.machine() not in ("x86_64", "AMD64"):
        raise PreparationError(
            f"ROS 2 wheels exist for x86_64 only and this machine is {platform.machine()}; "
            "install ROS 2 Jazzy from apt, source its setup.bash and start again."
        )
    missing: list[str] = []
    packages: list[str] = []
    if compiler_missing():
        missing.append("a C and C++ compiler")
        packages.append("g++")
    if not world.has_headers() and not debian.obtainable():
        missing.append(f"the headers of Python {world.version[0]}.{world.version[1]}")
        packages.append("python3-dev" if _is_system(world.python) else f"the development files of {world.python}")
    if missing:
        raise PreparationError(f"this machine lacks {_listed(missing)}; {_install(packages)}.")


def _is_system(python: Path) -> bool:
    return python.is_relative_to("/usr/bin") or python.is_relative_to("/bin")


def _listed(items: Sequence[str]) -> str:
    return " and ".join(items)


def _install(packages: Sequence[str]) -> str:
    apt = [package for package in packages if " " not in package]
    steps = [f"install {package}" for package in packages if " " in package]
    if apt:
        steps.insert(0, f"on Debian or Ubuntu: sudo apt install {' '.join(apt)}")
    return "; ".join(steps)
