"""Running a scenario from a verb: progress, Ctrl-C, SIGTERM, and errors as sentences."""

import os
import signal
import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .common import Failure, console, progress

if TYPE_CHECKING:
    from ..nodes.offspring import Nursery
    from ..nodes.scenario import Scenario
    from ..nodes.statistics import RunStatistics

# below 102 every port of a domain lies under Linux' ephemeral ports
_DOMAINS = range(20, 60)


@contextmanager
def sigterm_as_interrupt() -> Iterator[None]:
    """SIGTERM unwinds like Ctrl-C, so that nothing started stays behind."""

    def interrupt(*_: Any) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def run_station(
    scenario: "Scenario",
    *,
    composed: bool = False,
    log_dir: Path | None = None,
    nursery: "Nursery | None" = None,
    label: str = "",
) -> "RunStatistics":
    """Run a scenario to its end with a progress bar. Raises Failure where the graph could not be kept running.

    A scenario without duration runs until Ctrl-C, which then is its regular end.
    """
    from ..nodes.offspring import NurseryError
    from ..nodes.supervisor import RunError, Supervisor

    endless = scenario.duration_s == 0.0
    total = None if endless else scenario.duration_s / scenario.sample_time_s
    with sigterm_as_interrupt(), progress(label or scenario.name, total) as advance:
        try:
            if composed:
                return _composed(scenario, endless)
            with Supervisor(scenario, log_dir, nursery=nursery) as station:
                try:
                    station.wait(_advance(advance, station.bridge))
                except KeyboardInterrupt:
                    if not endless:
                        raise
                return station.stop()
        except (RunError, NurseryError) as error:
            raise Failure(str(error)) from None


def _composed(scenario: "Scenario", endless: bool) -> "RunStatistics":
    from ..nodes.composition import Composition

    with Composition(scenario) as station:
        try:
            station.wait()
        except KeyboardInterrupt:
            if not endless:
                raise
        return station.stop()


def _advance(advance: Any, bridge: str | None) -> Callable[[Any], None]:
    seen = 0

    def on_progress(observed: Any) -> None:
        nonlocal seen
        samples = int(observed.value(bridge or "", "samples", 0))
        if samples != seen:
            advance(samples - seen)
            seen = samples

    return on_progress


def explain(statistics: "RunStatistics") -> None:
    """The figures of a run for a person, on standard error."""
    bridge, shadow = statistics.bridge, statistics.shadow
    if not bridge:
        console.print("the run ended before its first report")
        return
    lines = [
        f"{bridge['samples']} samples, {bridge['missed_samples']} missed, {bridge['overruns']} late by half a period",
        f"{bridge['realtime_factor']:.3g} times real time ({bridge['pace']}, {bridge['sample_time_s'] * 1e3:g} ms)",
        "measurement to command: "
        + ", ".join(f"{name} {bridge[f'latency_{name}_s'] * 1e3:.3g} ms" for name in ("p50", "p99", "max")),
    ]
    if shadow:
        lines += [
            f"twin {shadow['model']}: {shadow['samples']} samples compared, {shadow['missed']} without partner",
            *(
                f"  {channel}: ISE {shadow[f'{channel}_ise']:.4g} {unit}^2 s, "
                f"RMS {shadow[f'{channel}_rms']:.4g} {unit}, fit {shadow[f'{channel}_fit']:.2f} %"
                for channel, unit in (("pressure", "Pa"), ("position", "m"))
            ),
        ]
    for line in lines:
        console.print(line)
    for name, count in statistics.restarts.items():
        if count:
            console.print(f"[yellow]{name} was restarted {count} times[/yellow]")


@contextmanager
def private_domain() -> Iterator[None]:
    """A ROS domain of the run's own, unless the user has chosen one: two demos side by side do not mix.

    The holder is a socket name, so that the domain is free again however this process ends.
    """
    if os.environ.get("ROS_DOMAIN_ID"):
        yield
        return
    holder = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    changed = {}
    for domain in _DOMAINS:
        with suppress(OSError):
            holder.bind(f"\0dt_station/domain/{domain}")
            changed = {"ROS_DOMAIN_ID": str(domain), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
            break
    before = {name: os.environ.get(name) for name in changed}
    os.environ.update(changed)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value
        holder.close()
