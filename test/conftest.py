"""Every test session has a ROS domain of its own and leaves no process behind."""

import contextlib
import os
import signal
import socket
import sys
import time
import uuid
from collections.abc import Iterator
from pathlib import Path

import hypothesis
import pytest

# The same examples everywhere, and a busy machine is no failure.
hypothesis.settings.register_profile("station", deadline=None, derandomize=True)
hypothesis.settings.load_profile("station")

SESSION = uuid.uuid4().hex
MARK = f"DT_STATION_TEST_SESSION={SESSION}".encode()
DOMAINS = range(60, 100)  # below 102 every port of a domain lies under Linux' ephemeral ports
HELPERS_OF_THE_INTERPRETER = (b"resource_tracker", b"forkserver")
ROOT = Path(__file__).resolve().parents[1]


def claim_domain() -> tuple[int, socket.socket]:
    """Return a domain id no other session holds, and the socket that holds it until this process ends."""
    for domain in DOMAINS:
        holder = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        try:
            holder.bind(f"\0dt_station/test/domain/{domain}")
        except OSError:
            holder.close()
            continue
        return domain, holder
    message = f"all test domains {DOMAINS.start} to {DOMAINS.stop - 1} are in use; wait for other test sessions to end"
    raise RuntimeError(message)


DOMAIN, _HOLDER = claim_domain()
# Set at import, before a test module can start a node or a process.
os.environ.update(
    DT_STATION_TEST_SESSION=SESSION,
    ROS_DOMAIN_ID=str(DOMAIN),
    ROS_AUTOMATIC_DISCOVERY_RANGE="LOCALHOST",
    PYTHONHASHSEED="0",
    MPLBACKEND="Agg",
)
os.environ.setdefault("DT_STATION_DATA", str(ROOT.parent / "shared" / "data"))


def left_behind() -> dict[int, str]:
    """Return process id and command line of every living process that this session started, itself apart."""
    found = {}
    for entry in Path("/proc").iterdir():
        if not entry.name.isdigit() or int(entry.name) == os.getpid():
            continue
        with contextlib.suppress(OSError):
            if MARK not in (entry / "environ").read_bytes().split(b"\0"):
                continue
            command = (entry / "cmdline").read_bytes().replace(b"\0", b" ").strip()
            if command and not any(helper in command for helper in HELPERS_OF_THE_INTERPRETER):
                found[int(entry.name)] = command.decode(errors="replace")
    return found


def stop_worker_pool() -> None:
    """End joblib's idle workers: they outlive the call that started them on purpose."""
    loky = sys.modules.get("joblib.externals.loky.reusable_executor")
    executor = getattr(loky, "_executor", None)
    if executor is not None:
        executor.shutdown(wait=True, kill_workers=True)


@pytest.fixture(autouse=True, scope="module")
def no_process_left_behind() -> Iterator[None]:
    """Fail the module, and clean up, when a process that its tests started still lives two seconds after them."""
    yield
    stop_worker_pool()
    deadline = time.monotonic() + 2.0
    while (left := left_behind()) and time.monotonic() < deadline:
        time.sleep(0.02)
    for process in left:
        with contextlib.suppress(ProcessLookupError):
            os.kill(process, signal.SIGKILL)
    assert not left, f"processes left behind: {left}"


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark what lives in real time, and put the long discoveries on measured data first: cores end together then."""
    for item in items:
        measured = item.path.name.startswith("test_measured")
        live = item.path.relative_to(ROOT / "test").parts[0] in ("nodes", "system") and not measured
        if live or item.get_closest_marker("timing"):
            item.add_marker("live")
    items.sort(key=lambda item: not item.path.name.startswith("test_measured"))


@pytest.fixture(scope="session")
def ros_domain() -> int:
    """Return the session's private ROS domain id, already in the environment."""
    return DOMAIN


@pytest.fixture(scope="session")
def measured_data() -> Path:
    """Return the folder of measured data, or skip the test."""
    folder = Path(os.environ["DT_STATION_DATA"])
    if not folder.is_dir():
        pytest.skip(f"no measured data at {folder}; set DT_STATION_DATA to its folder")
    return folder
