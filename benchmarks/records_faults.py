"""Kill -9 of the recorder, of any node, and of the whole graph at random moments: what a bag loses.

    python benchmarks/records_faults.py [--recorder 60] [--node 25] [--graph 15] [--seed 1]

A witness, a second recorder that is not killed, says what the killed one must have: every message up to one second
before the kill. Prints counts; exit status 1 if a single one of those is missing or differs.
"""

import argparse
import contextlib
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

ALLOWED_S = 1.0
SETTLE_S = 0.4
ENOUGH = 300
PATIENCE = 4


@dataclass
class Tally:
    """Kills, bags that had to be recovered, messages that had to be there, those that were, and the worst loss (s)."""

    kills: int = 0
    torn: int = 0
    due: int = 0
    missing: int = 0
    worst_s: float = 0.0

    def line(self, what: str) -> str:
        return (
            f"{what:12} {self.kills:4} kills, {self.torn:4} torn bags, {self.due:8} messages due, "
            f"{self.missing} missing, longest loss {self.worst_s * 1e3:.0f} ms"
        )


def recorder(folder: Path, name: str) -> subprocess.Popen:
    command = [sys.executable, "-m", "dt_station_nodes.nodes", "recorder", "--ros-args", "-r", f"__node:={name}"]
    command += ["-r", "__ns:=/station", "-p", f"out:={folder}", "-p", "sync:=false"]
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, start_new_session=True)


def station(log: Path):
    from dt_station_nodes.nodes.scenario import Scenario
    from dt_station_nodes.nodes.supervisor import Supervisor

    scenario = Scenario.load("paper").model_copy(update={"pace": "realtime", "duration_s": 0.0})
    shutil.rmtree(log, ignore_errors=True)
    supervisor = Supervisor(scenario, log_dir=log)
    supervisor.start()
    while supervisor.observed.value("daq_bridge", "phase") != "running":
        supervisor.step(0.1)
    return supervisor


def wait_for(folder: Path, alive, timeout_s: float = 60.0) -> None:
    """Until a recorder has written messages of the station."""
    from dt_station_nodes.records import RecordError
    from dt_station_nodes.records.salvage import survey

    end = time.monotonic() + timeout_s
    while time.monotonic() < end:
        alive()
        with contextlib.suppress(RecordError):
            if survey(folder / f"{folder.name}_0.mcap").messages > ENOUGH:
                return
    raise TimeoutError(f"{folder} holds no messages")


def held(folder: Path, scratch: Path) -> tuple[dict[tuple[str, bytes], int], bool]:
    """Station messages of a bag, recovered if it is torn, with their log times."""
    from dt_station_nodes.records import Bag, RecordError
    from dt_station_nodes.records.recovery import recover

    torn = False
    try:
        bag = Bag(folder)
    except RecordError:
        torn = True
        shutil.rmtree(scratch, ignore_errors=True)
        recover(folder, scratch)
        bag = Bag(scratch)
    with bag:
        topics = [t for t, stored in bag.topics.items() if stored.info.msgtype.startswith("dt_station_msgs/")]
        return {(m.topic, m.data): m.log_time for m in bag.messages(topics)}, torn


def judge(tally: Tally, witness: Path, victim: Path, scratch: Path, killed_ns: int, recorder_killed: bool) -> None:
    """What the witness has, from when the victim heard a topic to the kill, must be saved.

    Up to one second before the kill of the recorder. Where a node was killed instead, its topics fall silent, and its
    successor's first messages reach whoever DDS lets hear it first: these are left out.
    """
    seen, _ = held(witness, scratch)
    saved, torn = held(victim, scratch)
    tally.torn += torn
    if not saved:
        raise RuntimeError(f"{victim} holds nothing")
    limit = killed_ns - round((ALLOWED_S if recorder_killed else SETTLE_S / 2) * 1e9)
    for topic in {topic for topic, _ in saved}:
        own = [(key, at) for key, at in seen.items() if key[0] == topic]
        # both recorders' log times differ by what the machine makes them wait: order, not time, says what came first
        heard = [key in saved for key, _ in own]
        if not any(heard):
            continue
        again = next((i for i, (key, at) in enumerate(own) if at > killed_ns and key in saved), len(own))
        last = len(heard) - heard[::-1].index(True)
        due = {key for key, at in own[heard.index(True) :] if at < limit}
        if not recorder_killed:
            due |= {key for key, _ in own[again:last]}
        tally.due += len(due)
        lost = due - set(saved)
        tally.missing += len(lost)
        for key in lost:
            print(f"  missing on {topic}: {(seen[key] - killed_ns) * 1e-6:.0f} ms after the kill", flush=True)
    if recorder_killed:
        tally.worst_s = max(tally.worst_s, (killed_ns - max(saved.values())) * 1e-9)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--recorder", type=int, default=60, help="kills of the recorder")
    parser.add_argument("--node", type=int, default=25, help="kills of one of the nodes")
    parser.add_argument("--graph", type=int, default=15, help="kills of all processes at once")
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    choose = random.Random(arguments.seed)
    share = {"recorder": arguments.recorder, "node": arguments.node, "whole graph": arguments.graph}
    tallies = {what: Tally() for what in share}
    folder = Path(tempfile.mkdtemp(prefix="dt-station-"))
    running: list[subprocess.Popen] = []
    supervisor = station(folder / "log")
    try:
        for what, count in share.items():
            for trial in range(count):
                stem = f"{what.replace(' ', '-')}{trial}"
                witness, victim = folder / f"{stem}-witness", folder / f"{stem}-victim"
                running = [recorder(witness, f"witness{trial}"), recorder(victim, f"victim{trial}")]
                alive = lambda station=supervisor: station.step(0.1)  # noqa: E731
                wait_for(witness, alive)
                wait_for(victim, alive)
                end = time.monotonic() + 1.0 + choose.random() * 1.5
                while time.monotonic() < end:
                    supervisor.step(0.02)
                names = [name for name in supervisor.scenario.nodes if name != "daq_bridge"]
                targets = {
                    "recorder": [running[1].pid],
                    "node": [supervisor.process_id(choose.choice(names))],
                    "whole graph": [
                        running[1].pid,
                        *(supervisor.process_id(name) for name in supervisor.scenario.nodes),
                    ],
                }[what]
                killed_ns = time.time_ns()
                for target in targets:
                    with contextlib.suppress(ProcessLookupError):
                        os.kill(target, signal.SIGKILL)
                if what == "whole graph":
                    supervisor.stop()
                elif what == "node":
                    for _ in range(30):
                        supervisor.step(0.05)
                for process in running:
                    with contextlib.suppress(ProcessLookupError):
                        process.send_signal(signal.SIGINT)
                    process.wait(30)
                tallies[what].kills += 1
                judge(tallies[what], witness, victim, folder / "scratch", killed_ns, what != "node")
                for done in (witness, victim):
                    shutil.rmtree(done)
                # a supervisor gives up a node that falls again and again
                if what == "whole graph" or (what == "node" and trial % PATIENCE == PATIENCE - 1):
                    supervisor.stop()
                    supervisor = station(folder / "log")
            print(tallies[what].line(what), flush=True)
    finally:
        for process in running:
            if process.poll() is None:
                process.kill()
        supervisor.stop()
        shutil.rmtree(folder, ignore_errors=True)
    total = Tally(*(sum(getattr(t, name) for t in tallies.values()) for name in ("kills", "torn", "due", "missing")))
    total.worst_s = max(tally.worst_s for tally in tallies.values())
    print(total.line("all"))
    return 1 if total.missing else 0


if __name__ == "__main__":
    sys.exit(main())
