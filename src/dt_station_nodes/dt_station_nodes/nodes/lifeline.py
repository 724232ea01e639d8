"""No orphans: a supervised node ends when its supervisor does, however that ended."""

import contextlib
import ctypes
import os
import signal

VARIABLE = "DT_STATION_SUPERVISOR"
_PR_SET_PDEATHSIG = 1


def die_with_parent() -> None:
    """Have Linux send SIGTERM when the supervisor named in the environment is gone. Nothing without one."""
    supervisor = os.environ.get(VARIABLE)
    if supervisor is None or os.getppid() != int(supervisor):
        return
    with contextlib.suppress(OSError, AttributeError):
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)
    if os.getppid() != int(supervisor):
        # it ended between the two looks
        raise SystemExit(0)
