"""SIGINT and SIGTERM as a wish to stop, granted between two callbacks.

rclpy's own handlers shut the context down under whatever callback is running, which ends in errors or, once in a
while, in an abort. Here the context stays whole until the loop has seen the wish.
"""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType, TracebackType
from typing import Any

_SIGNALS = (signal.SIGINT, signal.SIGTERM)


class StopSignal:
    """`with StopSignal() as stop: while not stop.wanted: ...`"""

    def __init__(self) -> None:
        self.wanted = False
        self._before: dict[signal.Signals, Any] = {}

    def __enter__(self) -> "StopSignal":
        if threading.current_thread() is not threading.main_thread():
            return self
        for each in _SIGNALS:
            self._before[each] = signal.signal(each, self._on_signal)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for each, handler in self._before.items():
            signal.signal(each, handler)

    def _on_signal(self, _number: int, _frame: FrameType | None) -> None:
        self.wanted = True


@contextmanager
def uninterrupted() -> Iterator[None]:
    """What is inside is not cut short: a wish to stop that comes meanwhile is a KeyboardInterrupt at its end.

    Raised anywhere, as Python does by itself, it may be raised inside rclpy's C++, which aborts.
    """
    with StopSignal() as stop:
        yield
    if stop.wanted:
        raise KeyboardInterrupt
