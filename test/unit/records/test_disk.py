"""Troubles with the disk: the run goes on, what is lost is counted, what is written stays whole."""

import errno
import os
import resource
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path

import pytest

from dt_station_nodes.records import Bag, RecordError
from dt_station_nodes.records.bagwriter import BagWriter, WriterOptions
from dt_station_nodes.records.losses import LOSS, parse_loss
from dt_station_nodes.records.writerthread import WriterThread
from support import bags

SAMPLES = 300
OPTIONS = WriterOptions(sync=False, chunk_seconds=0.0)


class Disk:
    """Stands for os.pwrite on a file system with so much room; truncation gives room back."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, room: int) -> None:
        self.room = room
        self._write = os.pwrite
        monkeypatch.setattr("dt_station_nodes.records.mcapwriter.os.pwrite", self.write)

    def write(self, fd: int, data: bytes, offset: int) -> int:
        used = sum(file.stat().st_size for file in Path(f"/proc/self/fd/{fd}").resolve().parent.iterdir())
        grown = max(0, offset + len(data) - os.fstat(fd).st_size)
        left = max(0, self.room - used)
        if grown > left:
            # a real disk takes what fits before it complains
            part = len(data) - (grown - left)
            if part > 0:
                self._write(fd, data[:part], offset)
                return part
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return self._write(fd, data, offset)


def record(writer: BagWriter, samples: int = SAMPLES, on_sample: Callable[[int], None] | None = None) -> int:
    """Write a run, a chunk every ten samples; returns the number of messages offered."""
    numbers = {topic: writer.topic(bags.recorded(topic)) for topic in bags.TYPES}
    offered = 0
    for topic, k, time_ns, data in bags.station_messages(samples):
        writer.write(numbers[topic], k, time_ns, data)
        offered += 1
        if offered % 40 == 0:
            writer.tick(float(k))
            if on_sample is not None:
                on_sample(k)
    return offered


def held_and_lost(folder: Path) -> tuple[int, int]:
    """Messages in a bag, and those it says the disk did not take."""
    with Bag(folder) as bag:
        held = sum(1 for _ in bag.messages())
        return held, sum(parse_loss(text).unwritten for text in bag.metadata[LOSS].values())


@pytest.mark.parametrize("room", [30_000, 40_000, 55_000, 80_000])
def test_a_full_disk_ends_in_a_whole_bag_that_counts_its_loss(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, room: int
) -> None:
    Disk(monkeypatch, room)
    writer = BagWriter(tmp_path / "bag", OPTIONS)
    offered = record(writer, 600)
    assert "No space left" in writer.problem
    writer.close()
    held, lost = held_and_lost(tmp_path / "bag")
    assert 0 < held < offered
    assert held + lost == offered


def test_recording_goes_on_when_there_is_room_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    disk = Disk(monkeypatch, 30_000)
    writer = BagWriter(tmp_path / "bag", OPTIONS)
    problems = set()

    def watch(k: int) -> None:
        problems.add(bool(writer.problem))
        if k > SAMPLES // 2:
            disk.room = 10**9

    offered = record(writer, SAMPLES, watch)
    assert not writer.problem
    assert problems == {True, False}
    writer.close()
    held, lost = held_and_lost(tmp_path / "bag")
    assert lost > 0
    assert held + lost == offered
    with Bag(tmp_path / "bag") as bag:
        last = max(m.sequence for m in bag.messages([bags.STATE]))
    assert last == SAMPLES - 1


def test_a_disk_full_from_the_start_is_tried_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    disk = Disk(monkeypatch, 0)
    with pytest.raises(RecordError, match="No space left"):
        BagWriter(tmp_path / "impatient", OPTIONS)
    writer = BagWriter(tmp_path / "bag", OPTIONS, patient=True)
    assert "No space left" in writer.problem

    def watch(k: int) -> None:
        if k > SAMPLES // 2:
            disk.room = 10**9

    offered = record(writer, SAMPLES, watch)
    writer.close()
    held, lost = held_and_lost(tmp_path / "bag")
    assert held > 0
    assert held + lost == offered


def test_a_limit_on_the_size_of_files(tmp_path: Path) -> None:
    """The kernel's own refusal, in a process of its own."""
    program = (
        "import sys; from pathlib import Path; from test_disk import *;"
        "w = BagWriter(Path(sys.argv[1]), OPTIONS); n = record(w); print(n, w.problem); w.close()"
    )
    folder = tmp_path / "bag"
    done = subprocess.run(
        [sys.executable, "-c", program, str(folder)],
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join([str(Path(__file__).parent), *sys.path])},
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (40_000, 40_000)),
    )
    offered, problem = done.stdout.split(maxsplit=1)
    assert "too large" in problem
    held, lost = held_and_lost(folder)
    assert 0 < held < int(offered)
    assert held + lost == int(offered)


@pytest.mark.skipif(os.geteuid() == 0, reason="root writes anywhere; the read-only mount below stands for it")
def test_a_folder_without_permission(tmp_path: Path) -> None:
    tmp_path.chmod(0o555)
    writer = BagWriter(tmp_path / "bag", OPTIONS, patient=True)
    assert "Permission denied" in writer.problem


def test_a_read_only_file_system(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> int:
        raise OSError(errno.EROFS, os.strerror(errno.EROFS))

    monkeypatch.setattr("dt_station_nodes.records.mcapwriter.os.open", refuse)
    writer = BagWriter(tmp_path / "bag", OPTIONS, patient=True)
    offered = record(writer)
    assert "Read-only file system" in writer.problem
    assert sum(loss.unwritten for loss in writer.loss) == offered


def test_a_disk_that_stands_still_holds_nobody_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    go_on, write = threading.Event(), os.pwrite
    first = [True]

    def stuck(fd: int, data: bytes, offset: int) -> int:
        if not first[0]:
            assert go_on.wait(30.0)
        first[0] = False
        return write(fd, data, offset)

    monkeypatch.setattr("dt_station_nodes.records.mcapwriter.os.pwrite", stuck)
    thread = WriterThread(BagWriter(tmp_path / "bag", OPTIONS), queue_bytes=20_000)
    numbers = {topic: thread.topic(bags.recorded(topic)) for topic in bags.TYPES}
    thread.start()
    taken = refused = 0
    for topic, k, time_ns, data in bags.station_messages(SAMPLES):
        # never blocks: everything is offered while the disk stands still
        if thread.put(numbers[topic], k, time_ns, data):
            taken += 1
        else:
            refused += 1
    assert not go_on.is_set()
    assert refused > 0
    assert thread.status().dropped == refused
    go_on.set()
    info = thread.close()
    assert info is not None
    assert info.count == taken
    with Bag(tmp_path / "bag") as bag:
        losses = [parse_loss(text) for text in bag.metadata[LOSS].values()]
        assert sum(1 for _ in bag.messages()) == taken
    assert sum(loss.received for loss in losses) == taken + refused
    assert sum(loss.dropped for loss in losses) == refused
    assert sum(loss.missing for loss in losses) == refused


def test_a_fault_of_the_writer_is_seen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    thread = WriterThread(BagWriter(tmp_path / "bag", OPTIONS))
    monkeypatch.setattr(threading, "excepthook", lambda _: None)
    monkeypatch.setattr(BagWriter, "tick", lambda *_: 1 / 0)
    thread.start()
    assert thread.close() is None
    assert "ZeroDivisionError" in thread.status().problem


def test_lost_messages_are_counted_from_their_numbers(tmp_path: Path) -> None:
    thread = WriterThread(BagWriter(tmp_path / "bag", OPTIONS))
    number = thread.topic(bags.recorded(bags.STATE))
    thread.start()
    for _, k, time_ns, data in bags.station_messages(50):
        if _ == bags.STATE and k not in (10, 11, 30):
            thread.put(number, k, time_ns, data)
    thread.close()
    with Bag(tmp_path / "bag") as bag:
        loss = parse_loss(bag.metadata[LOSS][bags.STATE])
    assert (loss.received, loss.lost) == (47, 3)
