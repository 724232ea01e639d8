"""Recorder and replayer over real DDS: whole bags, torn bags, and a replay that gives the same bits."""

import contextlib
import random
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from dt_station_nodes.cli.app import main
from dt_station_nodes.records import Bag, RecordError, TornError, load_run
from dt_station_nodes.records.losses import LOSS, parse_loss
from dt_station_nodes.records.recovery import recover
from support import bags

Start = Callable[..., "subprocess.Popen[bytes]"]
KILLS = 3
WAIT_S = 40.0


@pytest.fixture
def start(ros_domain: int) -> Iterator[Start]:
    """Starts nodes as processes; whatever still runs at the end is killed."""
    running: list[subprocess.Popen[bytes]] = []

    def launch(executable: str, *parameters: str, name: str = "") -> "subprocess.Popen[bytes]":
        command = [sys.executable, "-m", "dt_station_nodes.nodes", executable, "--ros-args"]
        command += ["-r", f"__node:={name or executable}", "-r", "__ns:=/station"]
        for parameter in parameters:
            command += ["-p", parameter]
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
        running.append(process)
        return process

    yield launch
    # killed nodes stay visible in DDS for a while, and count as readers: end them in good order
    for sent in (signal.SIGINT, signal.SIGKILL):
        for process in running:
            if process.poll() is None:
                process.send_signal(sent)
        for process in running:
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(5.0)
    for process in running:
        if process.stderr is not None:
            process.stderr.close()


@pytest.fixture(scope="module")
def original(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return bags.write_bag(tmp_path_factory.mktemp("original") / "original", 400)


def messages(path: Path, topic: str) -> list[tuple[int, bytes]]:
    # serialized messages are padded to a multiple of four between processes
    with Bag(path) as bag:
        return [(m.sequence, m.data.ljust(-(-len(m.data) // 4) * 4, b"\0")) for m in bag.messages([topic])]


def test_a_replay_is_recorded_bit_for_bit(tmp_path: Path, start: Start, original: Path) -> None:
    recorder = start("recorder", f"out:={tmp_path / 'copy'}", "sync:=false")
    replayer = start("replayer", f"bag:={original}", "rate:=20.0", "least_readers:=1")
    assert replayer.wait(WAIT_S) == 0
    recorder.send_signal(signal.SIGINT)
    assert recorder.wait(WAIT_S) == 0
    for topic in bags.TYPES:
        assert messages(tmp_path / "copy", topic) == messages(original, topic)
    with Bag(tmp_path / "copy") as bag:
        losses = {topic: parse_loss(text) for topic, text in bag.metadata[LOSS].items()}
        assert bag.metadata["dt_station"]["dt_station_version"]
        assert "parameters/replayer.yaml" in bag.attachments()
    assert all(loss.missing == 0 for loss in losses.values())
    assert losses[bags.STATE].received == 400
    assert load_run(tmp_path / "copy").sample_time_s == 0.02


def test_chosen_topics_are_played_under_other_names(tmp_path: Path, start: Start, original: Path) -> None:
    recorder = start("recorder", f"out:={tmp_path / 'copy'}", "sync:=false")
    replayer = start(
        "replayer",
        f"bag:={original}",
        "topics:=[object/state]",
        "remap:=[object/state=/station/twin/state]",
        "rate:=0.0",
        "from_s:=2.0",
        "to_s:=4.0",
    )
    assert replayer.wait(WAIT_S) == 0
    recorder.send_signal(signal.SIGTERM)
    assert recorder.wait(WAIT_S) == 0
    assert [number for number, _ in messages(tmp_path / "copy", bags.TWIN)] == list(range(100, 200))
    assert messages(tmp_path / "copy", bags.STATE) == []


def test_twin_and_shadow_follow_a_replay_in_lockstep(tmp_path: Path, start: Start, original: Path) -> None:
    out = tmp_path / "followed"
    recorder = start("recorder", f"out:={out}", "sync:=false")
    # each takes part once those who need its output are there, as under a supervisor
    others = [
        start("twin_simulator", "model:=paper", 'wait_for_readers:=["twin/state:3"]'),
        start("shadow_compare", 'wait_for_readers:=["shadow/residual:2"]'),
    ]
    replayer = start("replayer", f"bag:={original}", "rate:=5.0", "followers:=[twin, shadow]", "least_readers:=3")
    assert replayer.wait(WAIT_S) == 0
    for process in (*others, recorder):
        process.send_signal(signal.SIGINT)
        assert process.wait(WAIT_S) == 0
    for topic in (bags.TWIN, "/station/shadow/residual"):
        assert [number for number, _ in messages(out, topic)] == list(range(400))
    # the recorded outputs are those that the same classes give offline, bit for bit
    assert main(["verify", str(out)]) == 0


def test_an_existing_bag_is_refused_with_status_2(start: Start, original: Path) -> None:
    recorder = start("recorder", f"out:={original}")
    assert recorder.wait(WAIT_S) == 2
    assert recorder.stderr is not None
    said = recorder.stderr.read().decode()
    assert "exists already" in said
    assert "Traceback" not in said


@pytest.mark.parametrize(
    ("parameters", "expected"),
    [
        (["bag:=/nowhere"], "there is no bag"),
        (["bag:={bag}", "topics:=[nothing]"], "nothing to play"),
        (["bag:={bag}", "remap:=[x]"], "OLD=NEW"),
        (["bag:={bag}", "from_s:=5.0", "to_s:=1.0"], "not after"),
    ],
)
def test_a_replay_that_cannot_be(start: Start, original: Path, parameters: list[str], expected: str) -> None:
    replayer = start("replayer", *(word.format(bag=original) for word in parameters))
    assert replayer.wait(WAIT_S) == 2
    assert replayer.stderr is not None
    said = replayer.stderr.read().decode()
    assert expected in said
    assert "Traceback" not in said


def test_a_full_disk_is_reported_and_the_run_goes_on(tmp_path: Path, start: Start) -> None:
    """A limit on file sizes stands for a full disk; the recorder keeps running and says what it lost."""
    samples, limit = 2000, 100_000
    original = bags.write_bag(tmp_path / "long", samples)
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, hard))
    try:
        recorder = start("recorder", f"out:={tmp_path / 'small'}", "sync:=false", "chunk_s:=0.1")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    watcher = start("recorder", f"out:={tmp_path / 'watcher'}", "sync:=false", name="watcher")
    replayer = start("replayer", f"bag:={original}", "rate:=10.0", "least_readers:=2")
    assert replayer.wait(WAIT_S) == 0
    for process in (recorder, watcher):
        process.send_signal(signal.SIGINT)
        assert process.wait(WAIT_S) == 0
    with Bag(tmp_path / "small") as bag:
        held = {topic: len(messages(tmp_path / "small", topic)) for topic in bags.TYPES}
        losses = {topic: parse_loss(bag.metadata[LOSS][topic]) for topic in bags.TYPES}
    for topic in bags.TYPES:
        assert losses[topic].unwritten > 0
        assert held[topic] + losses[topic].missing == losses[topic].received + losses[topic].lost == samples
    with Bag(tmp_path / "watcher") as bag:
        said = [bag.deserialize(m).status[0] for m in bag.messages(["/diagnostics"])]  # type: ignore[attr-defined]
    assert any("File too large" in s.message and s.name.endswith("recorder") and s.level == 2 for s in said)
    assert (tmp_path / "small" / "small_0.mcap").stat().st_size <= limit


def test_a_killed_recorder_loses_no_more_than_the_last_chunk(tmp_path: Path, start: Start, original: Path) -> None:
    """Kill -9 at random moments while messages come in at 250 Hz."""
    choose = random.Random(5)
    start("replayer", f"bag:={original}", "rate:=5.0", "loop:=true", "exit_at_end:=false")
    known = {topic: dict(messages(original, topic)) for topic in bags.TYPES}
    for trial in range(KILLS):
        out = tmp_path / f"killed{trial}"
        recorder = start("recorder", f"out:={out}", "sync:=false", "chunk_s:=0.2", name=f"recorder{trial}")
        deadline = time.monotonic() + WAIT_S
        while not (out / f"{out.name}_0.mcap").is_file() and time.monotonic() < deadline:
            time.sleep(0.01)
        time.sleep(0.3 + choose.random())
        killed_ns = time.time_ns()
        recorder.kill()
        recorder.wait()
        with pytest.raises(RecordError) as error:
            Bag(out)
        assert isinstance(error.value, TornError)
        found = recover(out, tmp_path / f"saved{trial}")
        with Bag(tmp_path / f"saved{trial}") as bag:
            saved = list(bag.messages(list(bags.TYPES)))
        for message in saved:
            assert message.data.rstrip(b"\0") == known[message.topic][message.sequence].rstrip(b"\0")
        assert found.torn
        if saved:
            assert killed_ns - max(message.log_time for message in saved) < 1_000_000_000
