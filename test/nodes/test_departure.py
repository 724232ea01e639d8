"""A process that ends at a set time, come what may."""

import subprocess
import sys

HELD = """
import ctypes
from dt_station_nodes.nodes.departure import end_after
cancel = end_after({delay}, 7)
{then}
"""
# PyDLL keeps the interpreter's lock for the whole of the call
HOLDS_THE_LOCK = "ctypes.PyDLL(None).sleep(60)"


def ended(delay, then):
    code = HELD.format(delay=delay, then=then)
    return subprocess.run([sys.executable, "-c", code], timeout=30, check=False).returncode


def test_a_thread_that_keeps_the_interpreters_lock_does_not_put_it_off():
    assert ended(0.2, HOLDS_THE_LOCK) == 7


def test_it_waits_for_its_time():
    assert ended(60.0, "") == 0


def test_it_can_be_called_off():
    assert ended(0.1, "cancel(); ctypes.PyDLL(None).usleep(500_000)") == 0
