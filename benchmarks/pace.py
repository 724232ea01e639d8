"""How fast the whole graph runs, beside a plain rclpy graph of the same shape in the same run.

    python benchmarks/pace.py [--seconds 5] [--rates 50 200 500 1000] [--long 300] [--json]

Real time: missed samples (a command not in before the next sample) at each rate, as separate processes and
composed in one process, with and without real-time priority. Lockstep: times faster than real time at 20 ms.
`--long` holds 20 ms for so many seconds with all nodes as processes, and says how long the machine itself stood still
meanwhile, and how many samples were excused (late because the bridge was, their commands in a quarter of a period
after it). Run it on a quiet machine; it says how busy the machine was.
"""

import argparse
import contextlib
import json
import os
import statistics as stats
import subprocess
import sys
from pathlib import Path

from rich.console import Console
from rich.table import Table

from dt_station_nodes.cli.station import private_domain
from dt_station_nodes.nodes.composition import Composition
from dt_station_nodes.nodes.offspring import Nursery
from dt_station_nodes.nodes.scenario import Scenario, plan
from dt_station_nodes.nodes.supervisor import Supervisor

HERE = Path(__file__).resolve().parent
PRIORITY = "DT_STATION_PRIORITY"
# pinned to a core, above everybody on it: whatever keeps it from waking every 2 ms keeps the station too
STANDSTILL = """
import os, select, sys, time
os.sched_setaffinity(0, {int(sys.argv[1])})
try:
    os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(90))
except OSError:
    pass
longest, last = 0.0, time.perf_counter()
while not select.select([0], [], [], 0.002)[0]:
    now = time.perf_counter()
    longest, last = max(longest, now - last - 0.002), now
print(longest)
"""


def plain(rate: float, seconds: float, priority: bool) -> dict:
    """The plain graph, with the same real-time priority in all its processes or none."""
    command = [sys.executable, str(HERE / "pace_plain.py"), "--rate", str(rate), "--seconds", str(seconds)]
    command += ["--priority"] if priority else []
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


def ours(scenario: Scenario, nursery: Nursery | None) -> dict:
    if nursery is None:
        with Composition(scenario) as station:
            station.wait(600.0)
            bridge = station.stop().bridge
    else:
        with Supervisor(scenario, nursery=nursery) as station:
            station.wait(timeout_s=scenario.duration_s + 60.0)
            bridge = station.stop().bridge
    return {
        "samples": bridge["samples"],
        "missed": bridge["missed_samples"],
        "p50_s": bridge["latency_p50_s"],
        "p99_s": bridge["latency_p99_s"],
        "max_s": bridge["latency_max_s"],
        "factor": bridge["realtime_factor"],
        "overruns": bridge["overruns"],
        "excused": bridge["excused_samples"],
        "late_max_s": bridge["late_max_s"],
    }


@contextlib.contextmanager
def standstills(found: dict):
    """Adds the longest standstill of the machine meanwhile, s: what the highest priority on each core had to wait."""
    processes = [
        subprocess.Popen([sys.executable, "-c", STANDSTILL, str(core)], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        for core in sorted(os.sched_getaffinity(0))
    ]
    try:
        yield
    finally:
        longest = [float(process.communicate(b"\n")[0] or "nan") for process in processes]
        found["standstill_s"] = max(longest)


def with_priority(wanted: bool, measure) -> dict:
    before = os.environ.pop(PRIORITY, None)
    if not wanted:
        os.environ[PRIORITY] = "0"
    try:
        return measure()
    finally:
        os.environ.pop(PRIORITY, None)
        if before is not None:
            os.environ[PRIORITY] = before


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=5.0, help="length of each real-time run")
    parser.add_argument("--rates", type=float, nargs="*", default=[50.0, 200.0, 500.0, 1000.0], help="Hz")
    parser.add_argument("--long", type=float, default=0.0, help="seconds at 20 ms as separate processes")
    parser.add_argument("--json", action="store_true")
    given = parser.parse_args()
    base = Scenario.load("paper")
    rows = []

    def add(what: str, rate: float, found: dict) -> None:
        rows.append({"what": what, "rate_hz": rate, "load": os.getloadavg()[0], **found})
        print(f"{what}, {rate:g} Hz: {found['missed']} of {found['samples']} missed", file=sys.stderr)

    with private_domain():
        nursery = Nursery([each.executable for each in plan(base)])
        try:
            for rate in given.rates:
                scenario = base.changed(sample_time_s=1.0 / rate, duration_s=given.seconds, pace="realtime")
                add("plain rclpy, processes", rate, plain(rate, given.seconds, False))
                add("plain rclpy, processes, priority", rate, plain(rate, given.seconds, True))
                for what, place in (("station, processes", nursery), ("station, composed", None)):
                    for priority in (False, True):
                        label = what + (", priority" if priority else "")
                        add(label, rate, with_priority(priority, lambda s=scenario, p=place: ours(s, p)))
            lockstep = base.changed(pace="lockstep", duration_s=24.0)
            for what, place in (("lockstep, processes", nursery), ("lockstep, composed", None)):
                found = [ours(lockstep, place) for _ in range(3)]
                middle = stats.median(each["factor"] for each in found)
                add(what, 50.0, next(each for each in found if each["factor"] == middle))
            if given.long:
                machine: dict[str, float] = {}
                with standstills(machine):
                    found = ours(base.changed(duration_s=given.long), nursery)
                add("station, processes, priority, long", 50.0, {**found, **machine})
        finally:
            nursery.close()
    reference = {(row["rate_hz"], "priority" in row["what"]): row for row in rows if row["what"].startswith("plain")}
    for row in rows:
        row["missed_percent"] = 100.0 * row["missed"] / max(1, row["samples"])
        beside = reference.get((row["rate_hz"], "priority" in row["what"]))
        if beside is not None and row["what"].startswith("station") and beside["p99_s"]:
            row["p99_ratio"] = row["p99_s"] / beside["p99_s"]
    if given.json:
        print(json.dumps({"rows": rows}, indent=2))
        return
    table = Table("graph", "rate Hz", "missed %", "p50 ms", "p99 ms", "max ms", "p99, of plain", "x real time", "load")
    for row in rows:
        table.add_row(
            row["what"],
            f"{row['rate_hz']:g}",
            f"{row['missed_percent']:.3f}",
            *("-" if row[key] is None else f"{1e3 * row[key]:.2f}" for key in ("p50_s", "p99_s", "max_s")),
            f"{row['p99_ratio']:.2f}" if "p99_ratio" in row else "",
            f"{row['factor']:.1f}" if "factor" in row else "",
            f"{row['load']:.1f}",
        )
    Console().print(table)
    for row in rows:
        if "standstill_s" in row:
            late_ms, stood_ms = 1e3 * row["late_max_s"], 1e3 * row["standstill_s"]
            print(f"{row['what']}: {row['missed']} of {row['samples']} missed, {row['excused']} excused")
            print(f"  latest sample {late_ms:.1f} ms late; longest standstill of the machine {stood_ms:.1f} ms")


if __name__ == "__main__":
    main()
