"""How every node process starts, spins and ends."""

import contextlib
import sys
import time
from collections.abc import Callable, Sequence
from typing import Protocol

import rclpy
from rclpy.context import Context
from rclpy.duration import Duration
from rclpy.executors import Executor, ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from ..core.errors import StationError
from .dds_profile import use_profile
from .departure import end_after
from .priority import claim_priority, quieten_collector
from .stopping import StopSignal

NAMESPACE = "station"
# also how long a signal may wait to be seen
_IDLE_S = 0.1
_DRAIN = 3
_ACKNOWLEDGED_S = 1.0
_QUIET_S = 0.3
_ARRIVED_S = 0.02
_LETS_GO_S = 2.0


class Ticker(Protocol):
    """What has to happen at a time, not on a message."""

    def deadline_ns(self) -> int | None:
        """When `tick` is next wanted, on time.perf_counter_ns; None: not before some message."""
        ...

    def tick(self) -> None:
        """Do what is due."""
        ...


class Part(Protocol):
    """The station's half of a node: made with it, closed before it."""

    @property
    def ticker(self) -> Ticker | None:
        """What has to happen at a time, if anything."""
        ...

    def close(self) -> None:
        """Bring everything to rest; safe to call twice."""
        ...


Factory = Callable[[Node], Part]


def make_executor(context: Context) -> Executor:
    """The events executor where this rclpy has it: first in first out, and a third of the CPU."""
    try:
        from rclpy.experimental import EventsExecutor
    except ImportError:
        return SingleThreadedExecutor(context=context)
    return EventsExecutor(context=context)


def spin(
    executor: Executor, context: Context, tickers: Sequence[Ticker], until: Callable[[], bool] | None = None
) -> None:
    """Run callbacks and tickers until the context is shut down or `until` says so."""
    while context.ok() and not (until is not None and until()):
        deadlines = [deadline for ticker in tickers if (deadline := ticker.deadline_ns()) is not None]
        if not deadlines:
            executor.spin_once(timeout_sec=_IDLE_S)
            continue
        wait_ns = min(deadlines) - time.perf_counter_ns()
        if wait_ns > 0:
            executor.spin_once(timeout_sec=min(wait_ns * 1e-9, _IDLE_S))
            continue
        # What has already arrived came in time: a tick must not overtake it.
        for _ in range(_DRAIN):
            executor.spin_once(timeout_sec=0)
        for ticker in tickers:
            deadline = ticker.deadline_ns()
            if deadline is not None and deadline <= time.perf_counter_ns():
                ticker.tick()


def deliver(node: Node, executor: Executor, keeps_all: bool, answers: bool = False) -> None:
    """Before a node ends: its readers have what it sent, and one that `keeps_all` has taken what it was sent.

    One that `answers` deals with what has already arrived.
    """
    if not node.context.ok():
        return
    if answers:
        _listen(executor, _ARRIVED_S)
    # One time for all: readers that are ending too may never acknowledge, and who stops us does not wait for ever.
    end = time.monotonic() + _ACKNOWLEDGED_S
    for publisher in node.publishers:
        publisher.wait_for_all_acked(Duration(seconds=max(end - time.monotonic(), 0.01)))
    if keeps_all:
        _listen(executor, _QUIET_S)


def _listen(executor: Executor, duration_s: float) -> None:
    end = time.monotonic() + duration_s
    while time.monotonic() < end:
        executor.spin_once(timeout_sec=duration_s / 10)


def run_node(name: str, factory: Factory, args: Sequence[str] | None = None) -> int:
    """`main` of a node: 0 after SIGINT or SIGTERM, 1 after a fault, 2 after a mistake in its parameters."""
    claim_priority()
    use_profile()
    node: Node | None = None
    part: Part | None = None
    executor: Executor | None = None
    status, initialised = 0, False
    try:
        with StopSignal() as stop:
            context = rclpy.get_default_context()
            own = list(sys.argv if args is None else args)
            rclpy.init(args=own, signal_handler_options=SignalHandlerOptions.NO)
            initialised = True
            node = Node(name, namespace=NAMESPACE)
            part = factory(node)
            executor = make_executor(context)
            executor.add_node(node)
            quieten_collector()
            try:
                spin(executor, context, [part.ticker] if part.ticker is not None else [], lambda: stop.wanted)
                deliver(node, executor, getattr(part, "keeps_all", False), answers=part.ticker is None)
            finally:
                # still inside, so that a second Ctrl-C cannot keep the object's valves open
                part.close()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except StationError as error:
        print(f"{name}: {error}", file=sys.stderr)
        status = 2
    except OSError as error:
        print(f"{name}: {error}", file=sys.stderr)
        status = 1
    except Exception as error:
        if type(error).__module__.startswith("rclpy."):
            # after a signal the context is gone, and so is the interest in what fails without it
            if rclpy.ok() or not initialised:
                print(f"{name}: {error}", file=sys.stderr)
                status = 2
        else:
            status = 1
            raise
    finally:
        end(node, part, executor, status)
    return status


def end(node: Node | None, part: Part | None, executor: Executor | None, status: int) -> None:
    """Close a node for good. Where the middleware does not let go of it in time, its process ends with `status`."""
    if part is not None:
        part.close()
    # All that counts is delivered and closed by now: who waits for us must not wait for that.
    cancel = end_after(_LETS_GO_S, status)
    with contextlib.suppress(KeyboardInterrupt, Exception):
        if executor is not None and node is not None:
            executor.remove_node(node)
            executor.shutdown()
        if node is not None:
            node.destroy_node()
        rclpy.try_shutdown()
    cancel()
