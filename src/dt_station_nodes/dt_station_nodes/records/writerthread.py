"""The recorder's own thread: takes messages from a bounded queue so that a slow disk never holds the loop up."""

import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from .bagwriter import BagWriter, RecordedTopic
from .rosbag2 import BagInfo
from .sequences import SequenceCounter

_POLL_S = 0.05
_SLOW_S = 1.0
_BURST = 256


@dataclass(frozen=True, slots=True)
class WriterStatus:
    """How the recording goes."""

    problem: str
    queued_bytes: int
    received: int
    lost: int
    dropped: int
    unwritten: int
    slowest_write_s: float


class WriterThread:
    """Feeds a BagWriter from `put`, which never blocks. Only this thread touches the writer once it runs."""

    def __init__(self, writer: BagWriter, queue_bytes: int = 1 << 26) -> None:
        self._writer, self._limit = writer, queue_bytes
        self._queue: deque[tuple[int, int, int, bytes] | Callable[[], object]] = deque()
        self._queued = self._written = 0
        self._counters: list[SequenceCounter] = []
        self._dropped: list[int] = []
        self._stop = threading.Event()
        self._slowest = self._latest = 0.0
        self._info: BagInfo | None = None
        self._fault = ""
        self._thread = threading.Thread(target=self._run, name="bag writer", daemon=True)

    def start(self) -> None:
        """Begin writing."""
        self._thread.start()

    def topic(self, topic: RecordedTopic) -> int:
        """Register a topic; returns its number for `put`."""
        self._counters.append(SequenceCounter())
        self._dropped.append(0)
        self._queue.append(lambda: self._writer.topic(topic))
        return len(self._counters) - 1

    def put(self, topic: int, sequence: int, time_ns: int, data: bytes) -> bool:
        """Queue a message of the topic numbered so; False where the queue is full and it is dropped."""
        self._counters[topic].add(sequence)
        if self._queued - self._written + len(data) > self._limit:
            self._dropped[topic] += 1
            return False
        self._queued += len(data)
        self._queue.append((topic, sequence, time_ns, data))
        return True

    def attach(self, name: str, media_type: str, data: bytes, time_ns: int) -> None:
        """Queue a file to keep in the bag."""
        self._queue.append(lambda: self._writer.attach(name, media_type, data, time_ns))

    def context(self, values: dict[str, str]) -> None:
        """Queue more of what the bag says about itself."""
        self._queue.append(lambda: self._writer.context(values))

    def status(self) -> WriterStatus:
        """The state now."""
        problem = self._fault or self._writer.problem
        if not problem and self._latest > _SLOW_S:
            problem = f"the disk is slow: the last write took {self._latest:.1f} s"
        return WriterStatus(
            problem,
            self._queued - self._written,
            sum(counter.received for counter in self._counters),
            sum(counter.lost for counter in self._counters),
            sum(self._dropped),
            sum(loss.unwritten for loss in self._writer.loss),
            self._slowest,
        )

    def close(self, timeout_s: float | None = None) -> BagInfo | None:
        """Write what is queued, finish the bag and return what it says; None where that takes too long."""
        self._stop.set()
        self._thread.join(timeout_s)
        return self._info

    def _run(self) -> None:
        try:
            while not self._stop.wait(_POLL_S):
                self._drain()
            self._drain()
            self._note_losses()
            self._info = self._writer.close()
        except Exception as error:
            # nobody waits for this thread: what ended it must be seen where its figures are
            self._fault = f"the bag writer failed: {type(error).__name__}: {error}"
            raise

    def _drain(self) -> None:
        count = 0
        while self._queue:
            job = self._queue.popleft()
            if callable(job):
                job()
                continue
            self._writer.write(*job)
            self._written += len(job[3])
            count += 1
            if count % _BURST == 0:
                self._tick()
        self._tick()

    def _tick(self) -> None:
        self._note_losses()
        start = time.monotonic()
        self._writer.tick(start)
        self._latest = time.monotonic() - start
        self._slowest = max(self._slowest, self._latest)

    def _note_losses(self) -> None:
        # topics still in the queue are not known to the writer yet
        for loss, counter, dropped in zip(self._writer.loss, self._counters, self._dropped, strict=False):
            loss.received, loss.lost, loss.dropped = counter.received, counter.lost, dropped
