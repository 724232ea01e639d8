"""`dt-station doctor`: what this installation is made of, whether it works, and what to mend."""

import json as json_module
import os
import platform
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from importlib import import_module, metadata
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from . import dds_check
from .common import JsonOption, config_dir, emit_json, leave, version

LIBRARIES = ("numpy", "scipy", "numba", "control", "pydantic", "mcap", "rosbags", "matplotlib", "plotly", "pyarrow")
SHARED_MEMORY_BYTES = 64e6
DISK_BYTES = 1e9


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing looked at: its value, whether it is in order, and what to do where it is not."""

    name: str
    value: str
    ok: bool = True
    advice: str = ""

    def as_dict(self) -> dict[str, object]:
        """For --json."""
        return {"name": self.name, "value": self.value, "ok": self.ok, "advice": "" if self.ok else self.advice}


def _world() -> Path | None:
    """The prepared environment's folder; None where the packages run from a workspace of their own."""
    named = os.environ.get("DT_STATION_WORLD")
    return Path(named) if named else None


def environment() -> Iterator[Finding]:
    """Interpreter, ROS and middleware."""
    yield Finding("dt-station", version())
    yield Finding("python", f"{platform.python_version()} at {sys.executable}")
    distribution = os.environ.get("ROS_DISTRO")
    yield Finding(
        "ROS 2",
        f"{distribution}, sourced" if distribution else f"wheels, rclpy {_version('ros-rclpy')}",
        distribution in (None, "jazzy"),
        "the station is made for Jazzy; other distributions may work",
    )
    import rclpy

    yield Finding("middleware", str(rclpy.get_rmw_implementation_identifier()))
    yield Finding("domain", os.environ.get("ROS_DOMAIN_ID", "0"))
    yield Finding("discovery", os.environ.get("ROS_AUTOMATIC_DISCOVERY_RANGE", "SUBNET"))


def libraries() -> dict[str, str]:
    """Versions of the main libraries."""
    return {name: _version(name) for name in LIBRARIES}


def _version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return "missing"


def built() -> Iterator[Finding]:
    """Messages, executables, compiled kernels and configuration."""
    world = _world()
    again = f"remove {world} and start again" if world else "build the workspace again: cd ros2_ws && colcon build"
    try:
        messages = import_module("dt_station_msgs.msg")
        found = [name for name in dir(messages) if name[0].isupper() and not name.endswith("_")]
        yield Finding("messages", f"{len(found)}: {', '.join(found)}")
    except ImportError as error:
        yield Finding("messages", str(error), False, again)
    programs = sorted(path.name for path in _executables())
    yield Finding("executables", ", ".join(programs) or "none", bool(programs), again)
    cache = Path(os.environ.get("NUMBA_CACHE_DIR", ""))
    kernels = len(list(cache.rglob("*.nbc"))) if cache.name else 0
    yield Finding(
        "compiled kernels", f"{kernels} cached", kernels > 0 or not cache.name, "the first simulation compiles"
    )
    yield Finding("configuration", str(config_dir()))


def _executables() -> list[Path]:
    prefixes = [Path(entry) for entry in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if entry]
    folders = [prefix / "lib" / "dt_station_nodes" for prefix in prefixes]
    return [path for folder in folders if folder.is_dir() for path in folder.iterdir() if os.access(path, os.X_OK)]


def machine() -> Iterator[Finding]:
    """Cores, disk, and the shared memory that the middleware lays out for each process."""
    yield Finding("cores", str(len(os.sched_getaffinity(0))))
    disk = shutil.disk_usage(Path.cwd()).free
    yield Finding("free disk", f"{disk / 1e9:.1f} GB", disk > DISK_BYTES, "recordings need room; free some")
    shared = Path("/dev/shm")
    free = shutil.disk_usage(shared).free if shared.is_dir() and os.access(shared, os.W_OK) else 0
    enough = free > SHARED_MEMORY_BYTES
    yield Finding("shared memory", f"{free / 1e6:.0f} MB", enough, "give /dev/shm at least 64 MB (docker: --shm-size)")


def stages() -> dict[str, float]:
    """Seconds each stage of the preparation took, as its stamps say."""
    world = _world()
    if world is None:
        return {}
    found = {}
    for stamp in sorted((world / "stamps").glob("[!.]*")):
        found[stamp.name] = float(json_module.loads(stamp.read_text(encoding="utf-8"))["seconds"])
    return found


def revision() -> str:
    """The checkout's git revision, with + where files are changed; empty outside a checkout."""
    root = Path(os.environ.get("DT_STATION_ROOT", Path(__file__).parent))
    command = ["git", "-C", str(root), "describe", "--always", "--dirty=+", "--exclude=*"]
    try:
        return subprocess.run(command, capture_output=True, text=True, check=True, timeout=10).stdout.strip()
    except (OSError, subprocess.SubprocessError):
        return ""


def loopback(measure: Callable[[], dds_check.Loopback] = dds_check.measure) -> tuple[Finding, dict[str, Any]]:
    """Whether two processes hear each other, and how fast."""
    result = measure()
    text = (
        f"{result.returned} of {result.sent} came back, found each other after {result.discovery_s:.2f} s, "
        f"median {result.median_s * 1e3:.2f} ms, p99 {result.p99_s * 1e3:.2f} ms"
    )
    advice = "look for a firewall on the loopback interface, and at ROS_DOMAIN_ID and ROS_AUTOMATIC_DISCOVERY_RANGE"
    finding = Finding("two processes", result.error or text, result.healthy, advice)
    return finding, {**asdict(result), "healthy": result.healthy}


def doctor(json: JsonOption = False) -> None:
    """Report the environment, versions, build state and middleware health; exit status 1 where something is wrong.

    Example: dt-station doctor --json
    """
    findings = [*environment(), *built(), *machine()]
    heard, details = loopback()
    findings.append(heard)
    ok = all(finding.ok for finding in findings)
    versions, seconds = libraries(), stages()
    if json:
        emit_json(
            {
                "ok": ok,
                "findings": [finding.as_dict() for finding in findings],
                "versions": versions,
                "revision": revision(),
                "preparation_seconds": seconds,
                "dds": details,
            }
        )
    else:
        _show(findings, versions, seconds)
    if not ok:
        leave(1)


def _show(findings: list[Finding], versions: dict[str, str], seconds: dict[str, float]) -> None:
    table = Table(box=None, show_header=False, pad_edge=False)
    for finding in findings:
        mark = "[green]ok[/green]" if finding.ok else "[red]mend[/red]"
        text = finding.value if finding.ok else f"{finding.value}: {finding.advice}"
        table.add_row(mark, finding.name, text)
    table.add_row("", "libraries", ", ".join(f"{name} {number}" for name, number in versions.items()))
    if seconds:
        total = ", ".join(f"{name} {value:.1f} s" for name, value in seconds.items())
        table.add_row("", "preparation", total)
    if number := revision():
        table.add_row("", "revision", number)
    Console(highlight=False).print(table)
