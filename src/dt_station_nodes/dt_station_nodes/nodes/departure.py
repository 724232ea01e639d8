"""A process's end at a set time, which no thread can put off, not even one that keeps the interpreter's lock.

rclpy destroys a node's entities with that lock held, and Fast DDS may block there for good
(a participant that leaves while others do): a thread of Python's own would never get its turn.
"""

import ctypes
import os
import sys
import threading
from collections.abc import Callable

_CLOCK_MONOTONIC = 1
_SIGEV_THREAD = 2
# struct sigevent of Linux has 64 bytes on every architecture
_REST_BYTES = 64 - 2 * ctypes.sizeof(ctypes.c_int) - 3 * ctypes.sizeof(ctypes.c_void_p)


class _Notice(ctypes.Structure):
    _fields_ = (
        ("value", ctypes.c_void_p),
        ("signal", ctypes.c_int),
        ("kind", ctypes.c_int),
        ("function", ctypes.c_void_p),
        ("attributes", ctypes.c_void_p),
        ("rest", ctypes.c_byte * _REST_BYTES),
    )


class _Time(ctypes.Structure):
    _fields_ = (("seconds", ctypes.c_long), ("nanoseconds", ctypes.c_long))


class _Times(ctypes.Structure):
    _fields_ = (("interval", _Time), ("value", _Time))


def end_after(delay_s: float, status: int) -> Callable[[], None]:
    """End this process with `status` (0 to 255) in `delay_s` seconds, whatever it does by then.

    Returns what calls it off. Where the system has no timer that starts a thread of its own, one of Python's does it.
    """
    if sys.platform == "linux":
        cancel = _timed(delay_s, status)
        if cancel is not None:
            return cancel
    late = threading.Timer(delay_s, os._exit, (status,))
    late.daemon = True
    late.start()
    return late.cancel


def _timed(delay_s: float, status: int) -> Callable[[], None] | None:
    try:
        # timer_create lies in librt before glibc 2.34
        library = ctypes.CDLL("librt.so.1")
        leave = ctypes.cast(ctypes.CDLL(None)._exit, ctypes.c_void_p)
        notice = _Notice(value=status, kind=_SIGEV_THREAD, function=leave.value)
        timer = ctypes.c_void_p()
        if library.timer_create(_CLOCK_MONOTONIC, ctypes.byref(notice), ctypes.byref(timer)) != 0:
            return None
        seconds = int(delay_s)
        times = _Times(value=_Time(seconds, int((delay_s - seconds) * 1e9)))
        if library.timer_settime(timer, 0, ctypes.byref(times), None) != 0:
            return None
    except (OSError, AttributeError):
        return None

    def cancel() -> None:
        library.timer_delete(timer)

    return cancel
