"""Reading bags: bulk decoding beside plain rosbags deserialisation, in one run, and memory over a day at 50 Hz.

    python benchmarks/records.py [--hours 24] [--keep FOLDER]

Writes a bag of one day (object/state, twin/state, both commands: 4.3 million samples a topic), reads it in streaming,
and prints samples per second, their ratio, and the peak memory of a process that does nothing else; then the time and
the peak memory of the verbs compare and export on the whole day.
"""

import argparse
import json
import resource
import shutil
import struct
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

STATE, TWIN, LOAD, POSITION = (
    "/station/object/state",
    "/station/twin/state",
    "/station/load/command",
    "/station/position/command",
)
TYPES = {
    STATE: "dt_station_msgs/msg/PlantState",
    TWIN: "dt_station_msgs/msg/PlantState",
    LOAD: "dt_station_msgs/msg/ValveCommand",
    POSITION: "dt_station_msgs/msg/ValveCommand",
}
FIELD = {"dt_station_msgs/msg/PlantState": "position", "dt_station_msgs/msg/ValveCommand": "voltage"}
STEP_NS = 20_000_000
MEMORY_MB = 500
AIM = 5.0


def write_day(folder: Path, hours: float) -> int:
    """A bag with that many hours at 50 Hz; returns the number of samples."""
    from dt_station_nodes.records.bagwriter import BagWriter, RecordedTopic, WriterOptions
    from dt_station_nodes.records.definitions import installed_definition, type_hash
    from dt_station_nodes.records.rosbag2 import TopicInfo

    samples = round(hours * 3600 * 50)
    writer = BagWriter(folder, WriterOptions(sync=False, chunk_seconds=1e9, chunk_bytes=1 << 18))
    numbers = {}
    for topic, kind in TYPES.items():
        text = installed_definition(kind)
        numbers[topic] = writer.topic(RecordedTopic(TopicInfo(topic, kind, 0, "", type_hash(kind, text)), text))
    state = struct.Struct("<4siIIB3xQddddII")
    command = struct.Struct("<4siIIB3xQddBB2x")
    wave = np.sin(np.arange(5000) * 0.01)
    noise = np.random.default_rng(1).normal(scale=1e-4, size=5000)
    values = (wave + noise).tolist()
    start = 1_700_000_000_000_000_000
    for k in range(samples):
        stamp = start + k * STEP_NS
        seconds, nanoseconds = divmod(stamp, 1_000_000_000)
        x = values[k % 5000]
        head = (b"\0\1\0\0", seconds, nanoseconds, 1, 0, k)
        writer.write(numbers[STATE], k, stamp, state.pack(*head, x, x * 1e6, x * 5, -x, 0, 0))
        writer.write(numbers[LOAD], k, stamp + 1000, command.pack(*head, x * 5, 2.5e6, 1, 0))
        writer.write(numbers[POSITION], k, stamp + 2000, command.pack(*head, -x, 0.1, 2, 0))
        writer.write(numbers[TWIN], k, stamp + 3000, state.pack(*head, x + 1e-3, x * 1e6, x * 5, -x, 0, 0))
        if k % 500 == 0:
            writer.tick(float(k))
    writer.close()
    return samples


def read_bulk(folder: Path, limit: int) -> tuple[int, float]:
    """Samples read in bulk, at most about `limit`, and the sum of a field so that nothing is left out."""
    from dt_station_nodes.records import Bag

    counts, total = dict.fromkeys(TYPES, 0), 0.0
    with Bag(folder) as bag:
        for topic, _, table in bag.tables_of(list(TYPES)):
            total += float(np.sum(table[FIELD[TYPES[topic]]], dtype=np.float64))
            counts[topic] += len(table)
            if counts[topic] >= limit:
                break
    return sum(counts.values()), total


def read_plain(folder: Path, limit: int) -> tuple[int, float]:
    """The same with the rosbags library, one message at a time."""
    from rosbags.highlevel import AnyReader

    count, total = 0, 0.0
    with AnyReader([folder]) as reader:
        for connection, _, raw in reader.messages():
            total += getattr(reader.deserialize(raw, connection.msgtype), FIELD[connection.msgtype])
            count += 1
            if count >= limit * len(TYPES):
                break
    return count, total


def measure(what: str, folder: str, limit: int) -> dict[str, float]:
    """Run one reader in a process of its own: seconds and peak memory are its alone."""
    done = subprocess.run(
        [sys.executable, __file__, "--measure", what, folder, "--limit", str(limit)],
        check=True,
        capture_output=True,
        text=True,
    )
    return json.loads(done.stdout)


def run_verb(arguments: list[str]) -> tuple[float, float]:
    """A verb of dt-station in a process of its own: seconds and peak memory, MB."""
    script = (
        "import resource, sys; from dt_station_nodes.cli.app import main; status = main(sys.argv[1:]); "
        "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024, file=sys.stderr); sys.exit(status)"
    )
    start = time.perf_counter()
    done = subprocess.run(
        [sys.executable, "-c", script, *arguments, "--json"], check=True, capture_output=True, text=True
    )
    return time.perf_counter() - start, float(done.stderr.split()[-1])


def measured(what: str, folder: str, limit: int) -> None:
    import rosbags.highlevel

    import dt_station_nodes.records

    assert rosbags.highlevel
    assert dt_station_nodes.records
    reader = {"bulk": read_bulk, "plain": read_plain}[what]
    start = time.perf_counter()
    count, total = reader(Path(folder), limit)
    seconds = time.perf_counter() - start
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(json.dumps({"samples": count, "seconds": seconds, "sum": total, "peak_mb": peak}))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--hours", type=float, default=24.0)
    parser.add_argument("--keep", metavar="FOLDER", help="leave the bag there, and take it from there if it exists")
    parser.add_argument("--limit", type=int, default=200_000, help="samples a topic for the comparison")
    parser.add_argument("--measure", nargs=2, metavar=("READER", "BAG"), help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.measure:
        measured(*arguments.measure, arguments.limit)
        return 0
    folder = Path(arguments.keep) if arguments.keep else Path(tempfile.mkdtemp(prefix="dt-station-")) / "day"
    try:
        if not folder.exists():
            start = time.perf_counter()
            samples = write_day(folder, arguments.hours)
            size = sum(file.stat().st_size for file in folder.iterdir()) / 1e6
            print(f"wrote {samples} samples a topic, {size:.0f} MB, in {time.perf_counter() - start:.0f} s")
        plain = measure("plain", str(folder), arguments.limit)
        bulk = measure("bulk", str(folder), arguments.limit)
        again = measure("plain", str(folder), arguments.limit)
        seconds = min(plain["seconds"], again["seconds"])
        ratio = bulk["samples"] / bulk["seconds"] / (plain["samples"] / seconds)
        print(f"plain rosbags: {plain['samples'] / seconds:.0f} samples/s ({plain['samples']:.0f} samples)")
        print(f"bulk:          {bulk['samples'] / bulk['seconds']:.0f} samples/s ({bulk['samples']:.0f} samples)")
        print(f"ratio:         {ratio:.1f}, the check of the whole file's checksum included")
        whole = measure("bulk", str(folder), 1 << 62)
        print(
            f"whole bag:     {whole['samples']:.0f} samples in {whole['seconds']:.1f} s, "
            f"{whole['samples'] / whole['seconds']:.0f} samples/s, peak {whole['peak_mb']:.0f} MB (at most {MEMORY_MB})"
        )
        ratio = whole["samples"] / whole["seconds"] / (plain["samples"] / seconds)
        print(f"ratio:         {ratio:.1f} of plain rosbags on the whole bag (aim {AIM:g})")
        peaks = [whole["peak_mb"]]
        for verb in (["compare", str(folder)], ["export", str(folder)], ["export", str(folder), "--format", "parquet"]):
            seconds, peak = run_verb([*verb, *(["--out", str(folder) + "-table", "--force"] * (verb[0] == "export"))])
            peaks.append(peak)
            print(f"{verb[0] + ' ' + verb[-1] * (len(verb) > 2):15}{seconds:.0f} s, peak {peak:.0f} MB")
        shutil.rmtree(str(folder) + "-table", ignore_errors=True)
        return 0 if ratio >= 1.0 and max(peaks) < MEMORY_MB else 1
    finally:
        if not arguments.keep:
            shutil.rmtree(folder.parent, ignore_errors=True)


if __name__ == "__main__":
    sys.exit(main())
