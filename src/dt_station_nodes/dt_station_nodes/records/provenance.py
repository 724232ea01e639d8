"""Where and with what a bag was recorded."""

import os
import platform
from collections.abc import Mapping
from importlib import metadata
from pathlib import Path

_PACKAGES = ("numpy", "numba", "scipy", "mcap", "rosbags")


def version() -> str:
    """Version of the station's package, or 'development' in a bare checkout."""
    for name in ("dt_station_nodes", "dt-station-nodes"):
        try:
            return metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return "development"


def git_revision() -> str:
    """The commit of the checkout this code lies in; empty for an installed package."""
    for parent in Path(__file__).resolve().parents:
        folder = parent / ".git"
        if not folder.is_dir():
            continue
        try:
            head = (folder / "HEAD").read_text(encoding="ascii").strip()
            if not head.startswith("ref: "):
                return head
            reference = head.removeprefix("ref: ")
            loose = folder / reference
            if loose.is_file():
                return loose.read_text(encoding="ascii").strip()
            packed = (folder / "packed-refs").read_text(encoding="ascii").splitlines()
            return next((line.split()[0] for line in packed if line.endswith(" " + reference)), "")
        except (OSError, UnicodeDecodeError):
            return ""
    return ""


def provenance(extra: Mapping[str, str]) -> dict[str, str]:
    """Versions and places as a flat map of strings."""
    found = {
        "dt_station_version": version(),
        "git_revision": git_revision(),
        "python": platform.python_version(),
        "platform": platform.platform(),
        "ros_distro": os.environ.get("ROS_DISTRO", "jazzy"),
        "rmw": os.environ.get("RMW_IMPLEMENTATION", ""),
    }
    for package in _PACKAGES:
        try:
            found[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            continue
    return {**found, **extra}
