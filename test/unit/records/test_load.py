"""Tables in, runs out; bad tables give one sentence."""

import os
from pathlib import Path

import numpy as np
import pytest
import scipy.io
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from dt_station_nodes.core.run import SIGNALS, Run
from dt_station_nodes.records import DataMap, RecordError, load_map, load_run, write_csv

ROOT = Path(__file__).parents[3]
DATA = Path(os.environ.get("DT_STATION_DATA", ROOT.parent / "shared" / "data"))
measured = pytest.mark.skipif(not DATA.is_dir(), reason="measured data absent; set DT_STATION_DATA")

numbers = st.floats(-1e300, 1e300, allow_nan=False)


@settings(max_examples=25, deadline=None)
@given(table=arrays(np.float64, (7, 6), elements=numbers), step=st.sampled_from([0.02, 0.001, 4.0, 1 / 3]))
def test_csv_round_trip_is_exact(tmp_path_factory: pytest.TempPathFactory, table: np.ndarray, step: float) -> None:
    path = tmp_path_factory.mktemp("csv") / "run.csv"
    write_csv(Run(step, dict(zip(SIGNALS, table.T, strict=True))), path)
    back = load_run(path)
    assert back.sample_time_s == pytest.approx(step, rel=1e-12)
    for name, column in zip(SIGNALS, table.T, strict=True):
        assert back.signals[name].tobytes() == np.ascontiguousarray(column).tobytes()


def test_sample_time_comes_back_as_the_short_number() -> None:
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run.csv"
        write_csv(Run(0.02, {"position_m": np.zeros(5000)}, start_s=3.0), path)
        run = load_run(path)
    assert run.sample_time_s == 0.02
    assert run.start_s == 3.0


def write(path: Path, rows: list[str], header: str = "time_s,servo_voltage_v,position_m") -> Path:
    path.write_text("\n".join([header, *rows]) + "\n")
    return path


GOOD = [f"{k * 0.02!r},1.0,{k * 0.5}" for k in range(10)]

BAD_TABLES = {
    "missing time": (["1,2,3"] * 3, "servo_voltage_v,position_m,x", ["'time_s'"]),
    "no signal": (["1,2,3"] * 3, "time_s,a,b", ["none of the columns"]),
    "wrong unit": (list(GOOD), "time_ms,servo_voltage_v,position_m", ["'time_s'", "'time_ms' has another unit"]),
    "misnamed": (list(GOOD), "time_s,servo_voltage_v,x", ["no column 'position_m'", "has x instead"]),
    "nan": ([*GOOD[:4], "0.08,nan,1", *GOOD[5:]], None, ["'servo_voltage_v'", "row 5"]),
    "inf": ([*GOOD[:4], "0.08,1,-inf", *GOOD[5:]], None, ["'position_m'", "row 5"]),
    "text": ([*GOOD[:4], "0.08,1,oops", *GOOD[5:]], None, ["'position_m'", "row 5", "'oops'"]),
    "empty cell": ([*GOOD[:4], "0.08,,1", *GOOD[5:]], None, ["'servo_voltage_v'", "row 5", "empty"]),
    "short row": ([*GOOD[:4], "0.08,1"], None, ["'position_m'", "row 5"]),
    "backwards": ([*GOOD[:4], "0.05,1,1", *GOOD[5:]], None, ["'time_s'", "row 5", "not increasing"]),
    "repeated": ([*GOOD[:4], GOOD[3], *GOOD[5:]], None, ["'time_s'", "row 5", "not increasing"]),
    "jitter": ([*GOOD[:4], "0.085,1,1", *GOOD[5:]], None, ["'time_s'", "row 5", "jittery"]),
    "lost row": ([*GOOD[:4], *GOOD[5:]], None, ["'time_s'", "row 5", "jittery"]),
    "no rows": ([], None, ["no rows"]),
    "one row": (GOOD[:1], None, ["at least 2"]),
}


@pytest.mark.parametrize("case", BAD_TABLES)
def test_bad_csv_names_file_column_and_row(tmp_path: Path, case: str) -> None:
    rows, header, expected = BAD_TABLES[case]
    path = write(tmp_path / "bad.csv", rows, *([header] if header else []))
    with pytest.raises(RecordError) as error:
        load_run(path)
    for text in ["bad.csv", *expected]:
        assert text in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("content", [b"", b"\n", b"\x00\x01\xff\xfe", b"\xff\xfe\x00\x00time"])
def test_files_that_are_no_csv(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "x.csv"
    path.write_bytes(content)
    with pytest.raises(RecordError, match="x.csv"):
        load_run(path)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(RecordError, match="no such file"):
        load_run(tmp_path / "nothing.csv")


MAP = """
format: mat
time: {column: t, unit: ms}
signals:
  position_m: {column: y, unit: mm, scale: 2.0, offset: 1.0}
  pressure_pa: {column: p, unit: bar}
  load_voltage_v: {column: u, unit: "1"}
"""


def write_mat(path: Path, **changes: object) -> Path:
    table: dict[str, object] = {
        "t": np.arange(50) * 20.0,
        "y": np.arange(50.0).reshape(-1, 1),
        "p": np.ones((1, 50)),
        "u": np.arange(50),
    }
    scipy.io.savemat(path, {k: v for k, v in {**table, **changes}.items() if v is not None})
    return path


def test_a_map_converts_units(tmp_path: Path) -> None:
    run = load_run(write_mat(tmp_path / "a.mat"), DataMap.from_yaml(MAP))
    assert run.sample_time_s == 0.02
    np.testing.assert_allclose(run.signals["position_m"], (2 * np.arange(50) + 1) * 1e-3, rtol=1e-15)
    assert np.all(run.signals["pressure_pa"] == 1e5)
    assert run.unit("load_voltage_v") == "1"
    assert run.unit("position_m") == "m"


def test_a_foreign_csv_with_other_separators(tmp_path: Path) -> None:
    path = tmp_path / "f.csv"
    path.write_text('"u";"y";\n' + "\n".join(f"{k};{2 * k};" for k in range(5)))
    text = "format: csv\nsample_time_s: 4\nrows: [1, 4]\nsignals:\n"
    run = load_run(path, DataMap.from_yaml(text + "  position_m: {column: y, unit: V, keep_unit: true}"))
    assert run.sample_time_s == 4.0
    assert run.signals["position_m"].tolist() == [2.0, 4.0, 6.0]
    assert run.unit("position_m") == "V"


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"y": None}, ["no column 'y'"]),
        ({"y": np.array([1.0, np.nan] * 25)}, ["'y'", "row 2"]),
        ({"y": np.ones(49)}, ["49 rows"]),
        ({"y": np.ones((50, 2))}, ["'y'", "no vector"]),
        ({"y": "text"}, ["'y'"]),
        ({"t": np.r_[0, np.arange(49) * 20.0]}, ["'t'", "row 2"]),
    ],
)
def test_bad_mat_names_file_column_and_row(tmp_path: Path, changes: dict[str, object], expected: list[str]) -> None:
    path = write_mat(tmp_path / "bad.mat", **changes)
    with pytest.raises(RecordError) as error:
        load_run(path, DataMap.from_yaml(MAP))
    for text in ["bad.mat", *expected]:
        assert text in str(error.value)


@pytest.mark.parametrize("compress", [False, True])
def test_every_truncation_of_a_mat_is_refused(tmp_path: Path, compress: bool) -> None:
    scipy.io.savemat(tmp_path / "whole.mat", {"t": np.arange(50) * 20.0, "y": np.ones(50)}, do_compression=compress)
    whole = (tmp_path / "whole.mat").read_bytes()
    text = "format: mat\ntime: {column: t, unit: ms}\nsignals:\n  position_m: {column: y, unit: m}"
    for size in range(0, len(whole), 7):
        path = tmp_path / "torn.mat"
        path.write_bytes(whole[:size])
        with pytest.raises(RecordError, match="torn.mat"):
            load_run(path, DataMap.from_yaml(text))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", "needs the keys"),
        ("a: [", "no valid YAML"),
        (MAP.replace("mat", "xls"), "format"),
        (MAP.replace("unit: ms", "unit: mm"), "wrong unit"),
        (MAP.replace("unit: bar", "unit: mm"), "wrong unit"),
        (MAP.replace("position_m", "velocity"), "unknown signal"),
        (MAP + "sample_time_s: 1\n", "not both"),
        (MAP + "rows: [5, 5]\n", "empty"),
        (MAP + "colour: red\n", "colour"),
        (MAP.replace("2.0", ".nan"), "scale"),
    ],
)
def test_bad_maps_say_where(text: str, expected: str) -> None:
    with pytest.raises(RecordError) as error:
        DataMap.from_yaml(text, "m.yaml")
    assert expected in str(error.value)
    assert str(error.value).startswith("m.yaml:")
    assert "\n" not in str(error.value)


@measured
@pytest.mark.parametrize(
    ("name", "file", "rows", "step"),
    [
        ("emps", "emps.mat", 24841, 0.001),
        ("emps_pulses", "emps_pulses.mat", 24841, 0.001),
        ("crane", "hydraulic_crane.mat", 1024, 0.05),
        ("crane_estimation", "hydraulic_crane.mat", 512, 0.05),
        ("crane_validation", "hydraulic_crane.mat", 512, 0.05),
        ("tanks", "cascaded_tanks.csv", 1024, 4.0),
        ("tanks_validation", "cascaded_tanks.csv", 1024, 4.0),
    ],
)
def test_the_shipped_maps_read_the_measured_data(name: str, file: str, rows: int, step: float) -> None:
    run = load_run(DATA / file, load_map(ROOT / "config" / "maps" / f"{name}.yaml"))
    assert len(run) == rows
    assert run.sample_time_s == step
    assert len(run.channels()) == 1


@pytest.mark.parametrize("cell", ["", "nan"])
def test_a_setpoint_column_without_a_number_is_no_setpoint(tmp_path, cell):
    rows = "".join(f"{0.02 * k:.2f},{cell},0.5,{1e6 + k},\n" for k in range(5))
    path = tmp_path / "open.csv"
    header = "time_s,pressure_setpoint_pa,load_voltage_v,pressure_pa,position_setpoint_m\n"
    path.write_text(header + rows)
    assert set(load_run(path).signals) == {"load_voltage_v", "pressure_pa"}
    path.write_text(header + rows.replace(f"0.04,{cell},", "0.04,2e6,"))
    with pytest.raises(RecordError, match="pressure_setpoint_pa.*row 1"):
        load_run(path)


def test_a_truncated_mat_file_is_said_to_be_so(tmp_path: Path) -> None:
    whole = tmp_path / "whole.mat"
    scipy.io.savemat(whole, {"t": np.arange(5000) * 0.01, "x": np.arange(5000.0)})
    data = whole.read_bytes()
    table = DataMap.model_validate(
        {"format": "mat", "time": {"column": "t", "unit": "s"}, "signals": {"position_m": {"column": "x", "unit": "m"}}}
    )
    (tmp_path / "torn.mat").write_bytes(data[: len(data) // 3])
    with pytest.raises(RecordError, match="torn.mat.*truncated"):
        load_run(tmp_path / "torn.mat", table)
