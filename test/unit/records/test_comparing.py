"""Comparison and export: figures against their definitions, tables against the bag."""

import json
import math
from pathlib import Path

import numpy as np
import pyarrow.parquet
import pytest

from dt_station_nodes.cli.app import main
from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.run import Run
from dt_station_nodes.records import Bag, RecordError, load_run, write_csv
from dt_station_nodes.records.columns import columns_of
from dt_station_nodes.records.comparing import _shifted, best_delay, compare_bag, compare_runs
from support import bags

STEP = 0.02


def wave(delay: float = 0.0, n: int = 1000) -> np.ndarray:
    return np.sin(2 * np.pi * 0.5 * (STEP * np.arange(n) - delay))


def run(values: np.ndarray, source: str = "a") -> Run:
    return Run(STEP, {"position_m": values}, source=source)


def test_figures_are_those_of_their_definitions() -> None:
    a, b = wave(), wave() + 0.1
    gap = compare_runs(run(a), run(b), None, None, 0.0).channels[Channel.POSITION]
    assert gap.ise == pytest.approx(0.01 * STEP * len(a))
    assert gap.rms == pytest.approx(0.1)
    assert gap.fit_percent == pytest.approx(100 * (1 - 0.1 / np.std(a)), rel=1e-6)


@pytest.mark.parametrize("delay", [0.04, 0.05, -0.033, 0.2])
def test_a_delay_is_taken_out(delay: float) -> None:
    gap = compare_runs(run(wave(delay)), run(wave()), None, None, 0.5).channels[Channel.POSITION]
    assert gap.delay_s == pytest.approx(delay, abs=0.002)
    assert gap.aligned_rms < 0.05 * gap.rms


def test_no_delay_is_found_in_what_has_none() -> None:
    assert best_delay(wave(), wave(), 25) == 0.0
    assert best_delay(np.arange(100.0), np.zeros(100), 25) == 0.0


@pytest.mark.parametrize("delay", [0.3, -2.75, 4.0])
def test_long_runs_are_shifted_a_stretch_at_a_time(delay: float) -> None:
    values = wave(n=150_000)
    rows = np.arange(len(values))
    whole = np.interp(rows - delay, rows, values, np.nan, np.nan)
    np.testing.assert_array_equal(_shifted(values, delay), whole)


def test_messages_out_of_order_are_put_in_order(tmp_path: Path) -> None:
    with Bag(bags.write_bag(tmp_path / "bag", 60)) as bag:
        whole = columns_of(bag, bags.STATE, ["sequence", "stamp_ns", "position"])
        original = bag.tables

        def backwards(topic: str) -> list[tuple[np.ndarray, np.ndarray]]:
            found = list(original(topic))
            log_time = np.concatenate([log for log, _ in found])
            table = np.concatenate([rows for _, rows in found])
            return [(log_time[::-1], table[::-1])]

        bag.tables = lambda topic, *_: backwards(topic)  # type: ignore[method-assign]
        again = columns_of(bag, bags.STATE, ["sequence", "stamp_ns", "position"])
        for name, values in whole.items():
            np.testing.assert_array_equal(again[name], values)
        with pytest.raises(RecordError, match="no field 'nothing'"):
            columns_of(bag, bags.STATE, ["nothing"])


def test_a_window() -> None:
    a, b = wave(), wave()
    b[500:] += 1.0
    assert compare_runs(run(a), run(b), None, 10.0, 0.0).channels[Channel.POSITION].rms == 0.0
    late = compare_runs(run(a), run(b), 10.0, None, 0.0).channels[Channel.POSITION]
    assert late.samples == 500
    assert late.rms == pytest.approx(1.0)
    with pytest.raises(RecordError, match="0 samples in common"):
        compare_runs(run(a), run(b), 50.0, None, 0.0)


def test_runs_of_other_kinds_are_refused() -> None:
    with pytest.raises(RecordError, match="sampled every"):
        compare_runs(run(wave()), Run(0.01, {"position_m": wave()}), None, None, 0.0)
    with pytest.raises(RecordError, match="no channel in common"):
        compare_runs(run(wave()), Run(STEP, {"pressure_pa": wave()}), None, None, 0.0)


def test_object_and_twin_of_a_bag(tmp_path: Path) -> None:
    found = compare_bag(bags.write_bag(tmp_path / "bag", 60), None, None, 0.5)
    assert found.missed == 0
    assert all(gap.rms == 0.0 and gap.samples == 60 for gap in found.channels.values())


def test_the_verb_compare(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bag = bags.write_bag(tmp_path / "bag", 60)
    write_csv(load_run(bag), tmp_path / "run.csv")
    arguments = [str(bag), str(tmp_path / "run.csv"), "--from", "0.2", "--to", "1.0", "--json"]
    assert main(["compare", *arguments, "--out", str(tmp_path / "out")]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["channels"]["position"]["samples"] == 40
    assert said["channels"]["pressure"]["ise"] == 0.0
    assert (tmp_path / "out" / "residuals.png").stat().st_size > 0
    assert main(["compare", *arguments, "--out", str(tmp_path / "out")]) == 2


@pytest.mark.parametrize("kind", ["csv", "parquet"])
def test_a_run_is_exported_to_the_last_bit(tmp_path: Path, kind: str) -> None:
    bag = bags.write_bag(tmp_path / "bag", 60)
    assert main(["export", str(bag), "--format", kind, "--out", str(tmp_path / "out")]) == 0
    expected = load_run(bag)
    if kind == "csv":
        back = {name: load_run(tmp_path / "out" / "run.csv").signals[name] for name in expected.signals}
    else:
        table = pyarrow.parquet.read_table(tmp_path / "out" / "run.parquet")
        back = {name: table[name].to_numpy() for name in expected.signals}
        assert table["time_s"].to_numpy().tolist() == expected.time_s.tolist()
    for name, values in expected.signals.items():
        assert back[name].tobytes() == values.tobytes()


@pytest.mark.parametrize("kind", ["csv", "parquet"])
def test_topics_are_exported_whole(tmp_path: Path, kind: str) -> None:
    bag = bags.write_bag(tmp_path / "bag", 60)
    arguments = ["export", str(bag), "--topic", "all", "--format", kind, "--out", str(tmp_path / "out")]
    assert main(arguments) == 0
    files = sorted(path.name for path in (tmp_path / "out").iterdir() if not path.name.startswith("."))
    assert files == sorted(f"{topic.strip('/').replace('/', '.')}.{kind}" for topic in bags.TYPES)
    if kind == "parquet":
        table = pyarrow.parquet.read_table(tmp_path / "out" / "station.object.state.parquet")
        assert table["position"].to_pylist() == [bags.state_values(k)["position"] for k in range(60)]
        assert table["header.frame_id"].to_pylist() == ["object"] * 60


def test_a_stretch_with_a_gap_beside_it_is_exported(tmp_path: Path) -> None:
    bag = bags.write_bag(tmp_path / "gap", 60, skip={20})
    assert main(["export", str(bag), "--out", str(tmp_path / "no")]) == 2
    assert main(["export", str(bag), "--from", "0.42", "--out", str(tmp_path / "yes")]) == 0
    run_back = load_run(tmp_path / "yes" / "run.csv")
    assert len(run_back) == 39
    assert math.isclose(run_back.start_s, 0.42)
