"""Bags: what we write, others read; what others write, we read."""

from pathlib import Path

import numpy as np
import pytest
import yaml
from mcap.reader import make_reader
from mcap.stream_reader import StreamReader
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import CompressionFormat, CompressionMode, Reader, StoragePlugin, Writer

from dt_station_nodes.records import Bag, RecordError, load_run, run_from_bag
from dt_station_nodes.records.bagwriter import WriterOptions
from support import bags

SAMPLES = 120


@pytest.fixture(scope="module")
def ours(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return bags.write_bag(tmp_path_factory.mktemp("bags") / "ours", SAMPLES)


def foreign(folder: Path, plugin: StoragePlugin, version: int = 9, compression: CompressionMode | None = None) -> Path:
    """The same run, written by the rosbags library."""
    writer = Writer(folder, version=version, storage_plugin=plugin)
    if compression is not None:
        writer.set_compression(compression, CompressionFormat.ZSTD)
    with writer:
        connections = {
            topic: writer.add_connection(topic, kind, typestore=bags.STORE) for topic, kind in bags.TYPES.items()
        }
        for topic, _, time_ns, data in bags.station_messages(SAMPLES):
            writer.write(connections[topic], time_ns, data)
    return folder


def test_rosbags_reads_our_bag_without_our_workspace(ours: Path) -> None:
    expected = {(topic, time_ns): data for topic, _, time_ns, data in bags.station_messages(SAMPLES)}
    with AnyReader([ours]) as reader:
        assert reader.message_count == 4 * SAMPLES
        for connection, time_ns, raw in reader.messages():
            assert bytes(raw) == expected.pop((connection.topic, time_ns))
            if connection.topic == bags.STATE:
                message = reader.deserialize(raw, connection.msgtype)
                k = message.sequence
                assert message.pressure == bags.state_values(k)["pressure"]
    assert not expected


def test_rosbags_sees_type_hashes_and_quality_of_service(ours: Path) -> None:
    with Reader(ours) as reader:
        assert reader.ros_distro == "jazzy"
        for connection in reader.connections:
            assert connection.digest == bags.STORE.hash_rihs01(connection.msgtype)
            assert connection.ext.offered_qos_profiles[0].depth == 10


def test_mcap_validates_our_bag(ours: Path) -> None:
    path = ours / "ours_0.mcap"
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        assert summary.statistics.message_count == 4 * SAMPLES
        assert sum(1 for _ in reader.iter_messages()) == 4 * SAMPLES
        assert [a.name for a in reader.iter_attachments()] == ["models/paper.yaml"]
        assert {m.name for m in reader.iter_metadata()} >= {"dt_station", "dt_station_loss", "rosbag2"}
    with path.open("rb") as file:
        records = list(StreamReader(file, validate_crcs=True).records)
    assert type(records[-1]).__name__ == "Footer"


def test_metadata_is_that_of_rosbag2_version_9(ours: Path) -> None:
    info = yaml.safe_load((ours / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    assert info["version"] == 9
    assert info["storage_identifier"] == "mcap"
    assert info["message_count"] == 4 * SAMPLES
    assert info["relative_file_paths"] == ["ours_0.mcap"]
    assert info["files"][0]["message_count"] == 4 * SAMPLES
    assert info["duration"]["nanoseconds"] == (SAMPLES - 1) * bags.STEP_NS + 3000
    topic = info["topics_with_message_count"][0]["topic_metadata"]
    assert topic["offered_qos_profiles"][0]["reliability"] == "reliable"
    assert topic["type_description_hash"].startswith("RIHS01_")


FOREIGN = {
    "mcap": (StoragePlugin.MCAP, 9, None),
    "mcap compressed": (StoragePlugin.MCAP, 9, CompressionMode.STORAGE),
    "sqlite3": (StoragePlugin.SQLITE3, 9, None),
    "sqlite3 version 8": (StoragePlugin.SQLITE3, 8, None),
    "sqlite3 compressed messages": (StoragePlugin.SQLITE3, 9, CompressionMode.MESSAGE),
    "mcap compressed file": (StoragePlugin.MCAP, 9, CompressionMode.FILE),
}


@pytest.mark.parametrize("kind", FOREIGN)
def test_we_read_what_rosbags_writes(tmp_path: Path, kind: str) -> None:
    plugin, version, compression = FOREIGN[kind]
    path = foreign(tmp_path / "foreign", plugin, version, compression)
    with Bag(path) as bag:
        read = [(m.topic, m.log_time, m.data) for m in bag.messages()]
    assert read == [(topic, time_ns, data) for topic, _, time_ns, data in bags.station_messages(SAMPLES)]
    run = load_run(path)
    assert run.sample_time_s == 0.02
    assert run.signals["pressure_pa"].tolist() == [bags.state_values(k)["pressure"] for k in range(SAMPLES)]


@pytest.mark.parametrize("plugin", [StoragePlugin.MCAP, StoragePlugin.SQLITE3])
def test_we_read_a_bag_without_metadata(tmp_path: Path, plugin: StoragePlugin) -> None:
    path = foreign(tmp_path / "foreign", plugin)
    (path / "metadata.yaml").unlink()
    assert len(load_run(path)) == SAMPLES
    (file,) = path.iterdir()
    assert len(load_run(file)) == SAMPLES


def test_the_run_of_a_bag(ours: Path) -> None:
    run = load_run(ours)
    assert len(run) == SAMPLES
    assert run.start_s == 0.0
    assert run.signals["position_m"].tolist() == [bags.state_values(k)["position"] for k in range(SAMPLES)]
    applied = [bags.state_values(k)["servo_voltage"] for k in range(1, SAMPLES)]
    assert run.signals["servo_voltage_v"].tolist() == [*applied, 0.5 * (SAMPLES - 1)]
    early = run_from_bag(ours, to_s=0.1)
    assert early.signals["servo_voltage_v"].tolist() == applied[: len(early)]
    assert len(early) == 5
    assert run.signals["pressure_setpoint_pa"].tolist() == [100.0 + k for k in range(SAMPLES)]
    assert run.signals["position_setpoint_m"].tolist() == [0.001 * k for k in range(SAMPLES)]


def test_columns_are_those_of_plain_deserialisation(ours: Path) -> None:
    names = ["sequence", "position", "header.stamp.sec", "header.frame_id"]
    with Bag(ours) as bag:
        columns = bag.columns(bags.STATE, names)
        plain = [bag.deserialize(m) for m in bag.messages([bags.STATE])]
    assert columns["sequence"].tolist() == [m.sequence for m in plain]
    assert columns["position"].tolist() == [m.position for m in plain]
    assert columns["header.stamp.sec"].tolist() == [m.header.stamp.sec for m in plain]
    assert [name.decode() for name in columns["header.frame_id"]] == [m.header.frame_id for m in plain]


def test_a_window_of_messages(ours: Path) -> None:
    start, stop = bags.START_NS + 10 * bags.STEP_NS, bags.START_NS + 20 * bags.STEP_NS
    with Bag(ours) as bag:
        inside = [m.log_time for m in bag.messages([bags.STATE], start, stop)]
        assert inside == [bags.START_NS + k * bags.STEP_NS for k in range(10, 20)]
        assert len(bag.columns(bags.STATE, ["sequence"], start, stop)["sequence"]) == 10


def test_files_are_split_and_read_as_one(tmp_path: Path) -> None:
    options = WriterOptions(sync=False, split_bytes=8000, chunk_bytes=2000)
    path = bags.write_bag(tmp_path / "split", 500, options)
    assert len(list(path.glob("*.mcap"))) > 3
    assert len(load_run(path)) == 500
    with AnyReader([path]) as reader:
        assert sum(1 for _ in reader.messages()) == 2000
    with Bag(path) as bag:
        times = [m.log_time for m in bag.messages()]
        assert bag.attachments() == {"models/paper.yaml": b"name: paper\n"}
    assert times == sorted(times)


def test_files_are_split_by_time(tmp_path: Path) -> None:
    # the writer's clock in these bags is the number of the message
    path = bags.write_bag(tmp_path / "split", 500, WriterOptions(sync=False, split_seconds=400.0))
    assert len(list(path.glob("*.mcap"))) == 5
    assert len(load_run(path)) == 500


def test_split_files_keep_their_order_beyond_ten(tmp_path: Path) -> None:
    options = WriterOptions(sync=False, split_bytes=2500, chunk_bytes=500)
    path = bags.write_bag(tmp_path / "split", 500, options)
    assert (path / "split_10.mcap").is_file()
    (path / "metadata.yaml").unlink()
    assert np.all(np.diff(load_run(path).signals["pressure_setpoint_pa"]) == 1.0)


def test_an_existing_bag_is_never_overwritten(ours: Path) -> None:
    before = {file.name: file.read_bytes() for file in ours.iterdir()}
    with pytest.raises(RecordError, match="exists already"):
        bags.write_bag(ours, 3)
    assert {file.name: file.read_bytes() for file in ours.iterdir()} == before


def test_losses_and_contents_are_in_the_bag(ours: Path) -> None:
    with Bag(ours) as bag:
        assert bag.metadata["dt_station"]["version"] == "test"
        assert set(bag.metadata["dt_station_loss"]) == set(bags.TYPES)
        assert bag.attachments() == {"models/paper.yaml": b"name: paper\n"}


def test_lost_samples_make_no_run(tmp_path: Path) -> None:
    path = bags.write_bag(tmp_path / "gap", 50, skip={20, 21})
    with pytest.raises(RecordError, match="samples 20 to 21 are missing"):
        load_run(path)


def test_a_bag_of_several_runs_asks_which(tmp_path: Path) -> None:
    path = bags.write_bag(tmp_path / "two", 50, restart_at=30)
    with pytest.raises(RecordError, match="holds 2 runs"):
        load_run(path)

    assert len(run_from_bag(path, number=1)) == 30
    second = run_from_bag(path, number=2)
    assert len(second) == 20
    assert second.signals["pressure_setpoint_pa"].tolist() == [130.0 + k for k in range(20)]
    with pytest.raises(RecordError, match="no run 3"):
        run_from_bag(path, number=3)
