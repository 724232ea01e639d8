"""Short pauses and, where permitted, precedence: what keeps a period on a busy machine."""

import contextlib
import gc
import os

_PRIORITY = "DT_STATION_PRIORITY"


def quieten_collector() -> None:
    """Keep the garbage collector's pauses short: what exists now is never looked at again."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(20_000, 20, 50)


def priority_of(executable: str, pace: str) -> dict[str, str]:
    """Environment that asks for real-time priority: for the nodes of the loop, the clock above the rest."""
    if pace != "realtime" or os.environ.get(_PRIORITY) == "0":
        return {}
    ranks = {"daq_bridge": 12, "load_generator": 11, "pressure_controller": 10, "position_controller": 10}
    return {_PRIORITY: str(ranks[executable])} if executable in ranks else {}


def claim_priority(default: str = "") -> str:
    """Ask for a real-time priority where DT_STATION_PRIORITY is set and permitted; says what was granted.

    `DT_STATION_PRIORITY=0` forbids it for a whole station.
    """
    wanted = os.environ.get(_PRIORITY, default)
    if not wanted or wanted == "0":
        return "normal"
    with contextlib.suppress(OSError, AttributeError, ValueError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(int(wanted)))
        return f"fifo {wanted}"
    with contextlib.suppress(OSError):
        return f"nice {os.nice(-10)}"
    return "normal"
