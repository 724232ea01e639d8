"""Kill -9 of the process that writes, at ten random moments: every message older than a second is saved."""

import random
import subprocess
import sys
import time
from pathlib import Path

from dt_station_nodes.records import Bag
from dt_station_nodes.records.recovery import recover

KILLS = 10
PROGRAM = """
import sys, time
from pathlib import Path
from support import bags
from dt_station_nodes.records.bagwriter import BagWriter, WriterOptions
from dt_station_nodes.records.writerthread import WriterThread
messages = [data for topic, _, _, data in bags.station_messages(200) if topic == bags.STATE]
thread = WriterThread(BagWriter(Path(sys.argv[1]), WriterOptions(chunk_seconds=0.1)))
number = thread.topic(bags.recorded(bags.STATE))
thread.start()
print("started", flush=True)
k = 0
while True:
    thread.put(number, k, time.time_ns(), messages[k % 200])
    k += 1
    time.sleep(0.002)
"""


def test_a_killed_writer_loses_no_more_than_the_last_chunk(tmp_path: Path) -> None:
    choose = random.Random(3)
    paths = [tmp_path / f"killed{i}" for i in range(KILLS)]
    environment = {"PYTHONPATH": ":".join([str(Path(__file__).parents[2]), *sys.path])}
    running = [
        subprocess.Popen([sys.executable, "-c", PROGRAM, str(path)], stdout=subprocess.PIPE, env=environment)
        for path in paths
    ]
    killed_ns = []
    try:
        for process in running:
            assert process.stdout is not None
            assert process.stdout.readline() == b"started\n"
        time.sleep(1.0)
        for process in running:
            time.sleep(0.1 * choose.random())
            process.kill()
            killed_ns.append(time.time_ns())
    finally:
        for process in running:
            process.kill()
            process.wait()
            assert process.stdout is not None
            process.stdout.close()
    for path, moment in zip(paths, killed_ns, strict=True):
        found = recover(path, path.with_name(path.name + "-saved"))
        assert found.torn
        (topic,) = found.topics
        assert topic.missing == 0
        with Bag(found.out) as bag:
            saved = list(bag.messages())
        assert [m.sequence for m in saved] == list(range(len(saved)))
        assert moment - saved[-1].log_time < 1_000_000_000
