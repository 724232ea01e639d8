"""Reading requirements.lock: one block a package, its pin and its hashes."""

import re
from collections.abc import Callable

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]*")

# What the message build imports or runs; installed first, so that the compiler starts while the rest downloads.
BUILD_TOOLS = frozenset(
    "catkin-pkg cmake coverage distlib docutils empy iniconfig lark-parser ninja numpy packaging pluggy pygments "
    "pyparsing pytest pytest-cov pytest-repeat pytest-rerunfailures python-dateutil pyyaml setuptools six "
    "exceptiongroup tomli typing-extensions".split()
)


def blocks(lock: str) -> dict[str, list[str]]:
    """Split a lock's text into the requirement blocks of each package, by normalised name."""
    found: dict[str, list[str]] = {}
    name = ""
    for line in lock.splitlines():
        if line.strip().startswith("--hash=") and name:
            found[name][-1] += f"\n{line}"
        elif line.strip() and not line.lstrip().startswith("#"):
            match = _NAME.match(line)
            if match is None:
                message = f"requirements.lock: not a pinned requirement: {line!r}"
                raise ValueError(message)
            name = re.sub(r"[-_.]+", "-", match[0]).lower()
            found.setdefault(name, []).append(line)
    return found


def select(lock: str, wanted: Callable[[str], bool]) -> str:
    """Return the lock's blocks whose package name is wanted, as a lock of their own."""
    return "\n".join(block for name, texts in blocks(lock).items() if wanted(name) for block in texts) + "\n"


def is_ros(name: str) -> bool:
    """Whether a package is part of ROS itself, and thus at hand where ROS is sourced."""
    return name.startswith("ros-")


def is_build_tool(name: str) -> bool:
    """Whether the message build needs the package."""
    return is_ros(name) or name.startswith("colcon-") or name in BUILD_TOOLS
