"""Damaged bags: a sentence and exit status 2, never a wrong number; and what is whole is saved."""

import random
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from rosbags.rosbag2 import StoragePlugin, Writer

from dt_station_nodes.cli.app import main
from dt_station_nodes.records import Bag, RecordError, TornError, load_run
from dt_station_nodes.records.bagwriter import WriterOptions
from dt_station_nodes.records.recovery import recover
from support import bags

TRUNCATIONS = 200
FLIPS = 200
SAMPLES = 400
CHUNK = 20

Messages = list[tuple[str, int, bytes]]


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    options = WriterOptions(sync=False, chunk_bytes=1)
    folder = bags.write_bag(tmp_path_factory.mktemp("whole") / "whole", SAMPLES, options, per_tick=CHUNK)
    return (folder / "whole_0.mcap").read_bytes()


@pytest.fixture(scope="module")
def truth() -> Messages:
    return [(topic, time_ns, data) for topic, _, time_ns, data in bags.station_messages(SAMPLES)]


def read(path: Path) -> Messages:
    with Bag(path) as bag:
        return [(m.topic, m.log_time, m.data) for m in bag.messages()]


def saved(path: Path, out: Path) -> Messages:
    shutil.rmtree(out, ignore_errors=True)
    recover(path, out)
    return read(out)


def test_two_hundred_truncations(tmp_path: Path, whole: bytes, truth: Messages) -> None:
    random_sizes = random.Random(1).sample(range(len(whole)), TRUNCATIONS)
    path, refused = tmp_path / "torn.mcap", 0
    flushed = 4 * CHUNK
    for i, size in enumerate(random_sizes):
        path.write_bytes(whole[:size])
        with pytest.raises(RecordError, match="torn.mcap") as error:
            read(path)
        assert "\n" not in str(error.value)
        refused += 1
        if i % 4:
            continue
        try:
            got = saved(path, tmp_path / "out")
        except RecordError:
            # before the end of the first chunk there is nothing to save
            assert size < whole.index(b"zstd") + 3000
            continue
        assert got == truth[: len(got)]
        assert len(got) % flushed == 0
    assert refused == TRUNCATIONS


def test_two_hundred_flipped_bits(tmp_path: Path, whole: bytes, truth: Messages) -> None:
    choose, path, refused = random.Random(2), tmp_path / "flipped.mcap", 0
    known = set(truth)
    for i in range(FLIPS):
        data = bytearray(whole)
        data[choose.randrange(len(data))] ^= 1 << choose.randrange(8)
        path.write_bytes(data)
        with pytest.raises(RecordError, match="flipped.mcap"):
            read(path)
        refused += 1
        if i % 8 == 0:
            got = saved(path, tmp_path / "out")
            assert set(got) <= known
            assert len(got) >= len(truth) - 4 * CHUNK
    assert refused == FLIPS


def test_a_torn_bag_says_what_is_missing(tmp_path: Path, whole: bytes) -> None:
    path = tmp_path / "torn.mcap"
    path.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(TornError, match=r"\d+ chunks with \d+ messages of \d+\.\d s are whole, \d+ bytes after"):
        read(path)


def test_a_recovered_bag_says_what_is_missing(tmp_path: Path, whole: bytes) -> None:
    path = tmp_path / "torn.mcap"
    path.write_bytes(whole[: len(whole) // 2])
    found = recover(path, tmp_path / "out")
    assert found.torn
    assert not found.complete
    assert "missing" in found.sentence()
    with Bag(tmp_path / "out") as bag:
        assert bag.metadata["dt_station"]["dt_station_recovery"] == found.sentence()
        assert bag.metadata["dt_station"]["version"] == "test"
        assert bag.attachments() == {"models/paper.yaml": b"name: paper\n"}
    run = load_run(tmp_path / "out")
    assert len(run) == found.messages // 4


def test_a_damaged_chunk_costs_only_itself(tmp_path: Path, whole: bytes, truth: Messages) -> None:
    middle = whole.index(b"zstd", len(whole) // 2) + 100
    (tmp_path / "a.mcap").write_bytes(whole[:middle] + b"\xff" * 50 + whole[middle + 50 :])
    found = recover(tmp_path / "a.mcap", tmp_path / "out")
    assert found.damaged_chunks == 1
    assert found.messages == len(truth) - 4 * CHUNK
    assert sum(topic.missing for topic in found.topics) == 4 * CHUNK


def test_the_definitions_survive_the_loss_of_the_first_chunk(tmp_path: Path, whole: bytes, truth: Messages) -> None:
    first = whole.index(b"zstd") + 100
    torn = whole[:first] + b"\xff" * 50 + whole[first + 50 : len(whole) * 3 // 4]
    (tmp_path / "a.mcap").write_bytes(torn)
    got = saved(tmp_path / "a.mcap", tmp_path / "out")
    assert got == truth[4 * CHUNK : 4 * CHUNK + len(got)]
    assert len(got) > len(truth) // 2


def test_a_whole_bag_is_recovered_whole(tmp_path: Path, truth: Messages) -> None:
    folder = bags.write_bag(tmp_path / "bag", SAMPLES)
    (folder / "metadata.yaml").unlink()
    found = recover(folder, tmp_path / "out")
    assert found.complete
    assert read(tmp_path / "out") == truth
    assert read(folder) == truth


def _empty(folder: Path) -> None:
    (folder / "bag_0.mcap").write_bytes(b"")


def _other_file(folder: Path) -> None:
    (folder / "bag_0.mcap").write_bytes(b"this is no bag at all" * 100)


def _missing(folder: Path) -> None:
    (folder / "bag_0.mcap").unlink()


def _metadata(change: Callable[[str], str]) -> Callable[[Path], None]:
    def apply(folder: Path) -> None:
        path = folder / "metadata.yaml"
        path.write_text(change(path.read_text()))

    return apply


BROKEN: dict[str, Callable[[Path], None]] = {
    "empty file": _empty,
    "another file": _other_file,
    "file missing": _missing,
    "metadata empty": _metadata(lambda text: ""),
    "metadata no YAML": _metadata(lambda text: "a: [" + text),
    "metadata a list": _metadata(lambda text: "- 1\n- 2\n"),
    "metadata without topics": _metadata(lambda text: text.replace("topics_with_message_count", "topics")),
    "metadata counts wrong": _metadata(lambda text: text.replace("message_count: 50", "message_count: 49")),
    "metadata total wrong": _metadata(lambda text: text.replace("message_count: 200", "message_count: 201", 1)),
    "metadata names other topics": _metadata(lambda text: text.replace("/station/object/state", "/station/other")),
    "metadata names another storage": _metadata(lambda text: text.replace("identifier: mcap", "identifier: tape")),
    "no bag": lambda folder: [file.unlink() for file in folder.iterdir()] and None,
}


@pytest.mark.parametrize("case", BROKEN)
@pytest.mark.parametrize("verb", ["compare", "export", "verify", "replay"])
def test_broken_bags_give_one_sentence_and_status_2(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], case: str, verb: str
) -> None:
    folder = bags.write_bag(tmp_path / "bag", 50)
    BROKEN[case](folder)
    out = ["--out", str(tmp_path / "out")] if verb in ("compare", "export") else []
    assert main([verb, str(folder), *out]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert len(said.err.strip().splitlines()) == 1
    assert "bag" in said.err
    assert "Traceback" not in said.err
    assert not (tmp_path / "out").exists()


def foreign(folder: Path, definition: str | None = None, rihs01: str | None = None, topic: str = bags.STATE) -> Path:
    kind = bags.TYPES[bags.STATE]
    text, _ = bags.STORE.generate_msgdef(kind, ros_version=2)
    with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connection = writer.add_connection(
            topic, kind, msgdef=definition(text) if definition else text, rihs01=rihs01 or bags.STORE.hash_rihs01(kind)
        )
        for name, _, time_ns, data in bags.station_messages(20):
            if name == bags.STATE:
                writer.write(connection, time_ns, data)
    return folder


WRONG: dict[str, tuple[Callable[[str], str], str]] = {
    "a field more": (lambda text: text.replace("float64 pressure", "float64 pressure\nfloat64 more", 1), "fit"),
    "a field less": (lambda text: text.replace("float64 load_voltage\n", "", 1), "fit"),
    "another size": (lambda text: text.replace("float64 position", "float32 position", 1), "not float64"),
    "no definition": (lambda text: "gibberish !!", "definition"),
    "an unknown type": (
        lambda text: text.replace("std_msgs/Header header", "std_msgs/Nothing header", 1),
        "missing|fit",
    ),
    "renamed": (lambda text: text.replace("float64 pressure", "float64 druck", 1), "no field 'pressure'"),
    "no number": (lambda text: text.replace("float64 pressure", "uint64 pressure", 1), "not float64"),
}


@pytest.mark.parametrize("case", WRONG)
def test_wrong_definitions_are_refused(tmp_path: Path, case: str) -> None:
    change, expected = WRONG[case]
    path = foreign(tmp_path / "foreign", change, "RIHS01_" + "0" * 64)
    # what the file itself says must be refused whatever metadata.yaml says
    (path / "metadata.yaml").unlink()
    with pytest.raises(RecordError, match=expected) as error:
        load_run(path)
    assert "\n" not in str(error.value)


def test_swapped_fields_are_found_by_the_hash(tmp_path: Path, whole: bytes) -> None:
    folder = bags.write_bag(tmp_path / "bag", 20, swap=("position", "pressure"))
    with pytest.raises(RecordError, match="not the one the bag was recorded with"):
        load_run(folder)


def test_a_foreign_bag_without_our_topics_is_named_as_such(tmp_path: Path) -> None:
    with pytest.raises(RecordError, match="no topic object/state"):
        load_run(foreign(tmp_path / "foreign", topic="/elsewhere/state"))


@pytest.mark.parametrize("content", [b"", b"x", b"\x89MCAP0\r\n", b"\x89MCAP0\r\n" * 2, bytes(1000)])
@pytest.mark.parametrize("suffix", [".mcap", ".db3"])
def test_files_that_are_no_bags(tmp_path: Path, content: bytes, suffix: str) -> None:
    path = tmp_path / f"x{suffix}"
    path.write_bytes(content)
    with pytest.raises(RecordError, match="x."):
        load_run(path)
    with pytest.raises(RecordError):
        recover(path, tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.fixture
def torn(tmp_path: Path, whole: bytes) -> Path:
    folder = tmp_path / "torn"
    folder.mkdir()
    (folder / "torn_0.mcap").write_bytes(whole[: len(whole) // 2])
    return folder


def test_the_verb_recover(tmp_path: Path, torn: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "saved"
    assert main(["export", str(torn), "--out", str(tmp_path / "no")]) == 2
    assert "dt-station recover" in capsys.readouterr().err
    assert main(["recover", str(torn), "--out", str(out), "--json"]) == 0
    assert '"torn": true' in capsys.readouterr().out
    assert main(["recover", str(torn), "--out", str(out)]) == 2
    assert main(["recover", str(torn), "--out", str(out), "--force"]) == 0
    assert main(["recover", str(torn), "--out", str(torn), "--force"]) == 2
    assert main(["export", str(out), "--out", str(tmp_path / "yes")]) == 0
