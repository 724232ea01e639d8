"""What a bare Debian or Ubuntu leaves out of Python, from its own packages, unpacked inside the checkout.

Nothing is installed and no rights are needed; apt checks the packages' signatures as ever.
"""

import os
import shutil
from collections.abc import Callable, Mapping
from pathlib import Path

from .errors import PreparationError
from .processes import Processes
from .world import World

Show = Callable[[str], None]


def obtainable() -> bool:
    """Whether this machine can fetch and unpack a Debian package."""
    return shutil.which("apt-get") is not None and shutil.which("dpkg-deb") is not None


def unpack(package: str, target: Path, log: Path, processes: Processes, env: Mapping[str, str], show: Show) -> None:
    """Fetch a Debian package and unpack it as the folder `target`. Raises PreparationError."""
    download = target.with_name(f"{target.name}-{os.getpid()}")
    shutil.rmtree(target, ignore_errors=True)
    try:
        download.mkdir(parents=True)
        processes.run(["apt-get", "download", package], log, env, show, cwd=download)
        archives = list(download.glob("*.deb"))
        if not archives:
            raise PreparationError(f"apt did not give {package} (see {log}).")
        processes.run(["dpkg-deb", "-x", str(archives[0]), str(download / "unpacked")], log, env, show)
        (download / "unpacked").rename(target)
    finally:
        shutil.rmtree(download, ignore_errors=True)


def fetch_headers(world: World, processes: Processes, env: Mapping[str, str], show: Show) -> None:
    """Unpack Python.h and its kin for the world's interpreter. Raises PreparationError with the way out."""
    version = f"{world.version[0]}.{world.version[1]}"
    try:
        unpack(f"libpython{version}-dev", world.own_headers, world.logs / "headers.log", processes, env, show)
    except PreparationError as error:
        if processes.stopped:
            raise
        raise PreparationError(
            f"{error}\nthis machine lacks the headers of Python {version}; on Debian or Ubuntu: "
            "sudo apt update; sudo apt install python3-dev"
        ) from error
    if not world.has_headers():
        raise PreparationError(f"libpython{version}-dev holds no Python.h; install the headers of {world.python}.")


def fetch_pip(world: World, processes: Processes, env: Mapping[str, str], show: Show) -> Path:
    """Unpack the pip that Debian keeps for its venv; returns the wheel. Raises PreparationError with the way out."""
    target = world.state / "pip"
    try:
        unpack("python3-pip-whl", target, world.logs / "pip.log", processes, env, show)
        return next((target / "usr" / "share" / "python-wheels").glob("pip-*.whl"))
    except (PreparationError, OSError, StopIteration) as error:
        if processes.stopped:
            raise
        raise PreparationError(
            f"{world.python} has neither pip nor ensurepip; on Debian or Ubuntu: "
            "sudo apt update; sudo apt install python3-venv"
        ) from error
