"""A process that has imported everything once and forks a node whenever asked: seven nodes start as fast as one.

It reads requests from standard input, one JSON object a line: {"argv": [executable, ...], "log": file,
"environment": {...}}, and writes to standard output {"pid": n} for each, and {"pid": n, "status": s} when
one ends (s < 0: a signal). When standard input closes it stops what still runs and ends.
"""

import contextlib
import ctypes
import gc
import json
import os
import select
import signal
import sys
import time
from typing import Any

from . import lifeline, registry

_STOPPING = (signal.SIGINT, signal.SIGTERM)
_PR_SET_NAME = 15
_GRACE_S = 3.0


def preload(executables: list[str]) -> None:
    """Import what the nodes need, before the first fork."""
    import rclpy.node
    from diagnostic_msgs.msg import DiagnosticArray
    from rcl_interfaces.msg import ParameterEvent

    from dt_station_msgs import msg

    with contextlib.suppress(ImportError):
        import rclpy.experimental  # noqa: F401
    kinds = [getattr(msg, name) for name in dir(msg) if isinstance(getattr(msg, name), type)]
    for kind in (*kinds, DiagnosticArray, ParameterEvent):
        with contextlib.suppress(AttributeError):
            type(kind).__import_type_support__()
    for executable in executables:
        with contextlib.suppress(registry.UnknownNodeError):
            main = registry.entry(executable)
            warm = getattr(sys.modules[main.__module__], "preload", None)
            if warm is not None:
                warm()


def _become(request: dict[str, Any]) -> int:
    os.setsid()
    signal.set_wakeup_fd(-1)
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    for each in _STOPPING:
        signal.signal(each, signal.default_int_handler)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, _STOPPING)
    sink = os.open(request["log"], os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
    null = os.open(os.devnull, os.O_RDONLY)
    for source, target in ((null, 0), (sink, 1), (sink, 2)):
        os.dup2(source, target)
    name = request["argv"][0]
    with contextlib.suppress(OSError, AttributeError):
        ctypes.CDLL(None).prctl(_PR_SET_NAME, name.encode()[:15], 0, 0, 0)
    os.environ.update(request.get("environment", {}))
    lifeline.die_with_parent()
    from .__main__ import main

    return main(request["argv"])


def _fork(request: dict[str, Any]) -> int:
    os.environ[lifeline.VARIABLE] = str(os.getpid())
    # a child told to stop before it can listen would not have heard
    signal.pthread_sigmask(signal.SIG_BLOCK, _STOPPING)
    child = os.fork()
    if child:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, _STOPPING)
        return child
    status = 1
    try:
        status = _become(request)
    except SystemExit as exit_:
        status = exit_.code if isinstance(exit_.code, int) else 1
    except KeyboardInterrupt:
        status = 0
    except BaseException:
        import traceback

        traceback.print_exc()
    finally:
        with contextlib.suppress(Exception):
            sys.stdout.flush()
            sys.stderr.flush()
        os._exit(status)


def _say(**facts: Any) -> None:
    with contextlib.suppress(BrokenPipeError):
        os.write(1, (json.dumps(facts) + "\n").encode())


def _reap(living: set[int]) -> None:
    while living:
        child, status = os.waitpid(-1, os.WNOHANG)
        if child == 0:
            return
        living.discard(child)
        _say(pid=child, status=os.waitstatus_to_exitcode(status))


def serve() -> int:
    """Answer requests until standard input closes."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # a child's end interrupts the wait for requests
    reader, writer = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
    signal.set_wakeup_fd(writer)
    signal.signal(signal.SIGCHLD, lambda *_: None)
    lifeline.die_with_parent()
    preload(sys.argv[1:])
    gc.collect()
    gc.freeze()
    living: set[int] = set()
    pending = b""
    while True:
        ready, _, _ = select.select([0, reader], [], [])
        if reader in ready:
            os.read(reader, 4096)
            _reap(living)
        if 0 not in ready:
            continue
        data = os.read(0, 65536)
        if not data:
            break
        *lines, pending = (pending + data).split(b"\n")
        for line in lines:
            child = _fork(json.loads(line))
            living.add(child)
            _say(pid=child)
    for sent in (signal.SIGINT, signal.SIGKILL):
        for child in living:
            with contextlib.suppress(ProcessLookupError):
                os.kill(child, sent)
        end = time.monotonic() + _GRACE_S
        while living and time.monotonic() < end:
            with contextlib.suppress(ChildProcessError):
                _reap(living)
            time.sleep(0.02)
    return 0


if __name__ == "__main__":
    raise SystemExit(serve())
