"""Rows of an uneven clock on an even grid: what is there stays, what is missing for long is said."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dt_station_nodes.records import DataMap, RecordError, load_run
from dt_station_nodes.records.resampling import on_even_grid

STEP_S = 0.02
MAP = """
format: csv
time: {column: t, unit: ms}
resample_s: 0.02
signals:
  servo_voltage_v: {column: u, unit: V}
  position_m: {column: y, unit: mm}
"""


def columns(seconds: np.ndarray, *lost: int) -> dict[str, np.ndarray]:
    """A straight line over time, some of its values lost, beside a whole parabola."""
    line = 3.0 - 2.0 * seconds
    line[list(lost)] = np.nan
    return {"t": seconds, "line": line, "parabola": seconds**2}


@given(st.integers(0, 2**32 - 1))
def test_straight_lines_survive_any_jitter_and_lost_values(seed: int) -> None:
    rng = np.random.default_rng(seed)
    seconds = STEP_S * (np.arange(100) + rng.uniform(-0.4, 0.4, 100))
    start, even = on_even_grid(columns(seconds, 0, 7, 50, 51, 99), "t", STEP_S, "a.csv")
    grid = start + STEP_S * np.arange(len(even["line"]))
    assert start == seconds[1]
    assert seconds[98] - STEP_S < grid[-1] <= seconds[98] + 1e-6
    np.testing.assert_allclose(even["line"], 3.0 - 2.0 * grid, atol=1e-12)
    np.testing.assert_allclose(even["parabola"], grid**2, atol=STEP_S**2)


def test_rows_that_are_even_stay_as_they_are() -> None:
    given_columns = columns(STEP_S * np.arange(50))
    start, even = on_even_grid(given_columns, "t", STEP_S, "a.csv")
    assert start == 0.0
    for name in ("line", "parabola"):
        np.testing.assert_allclose(even[name], given_columns[name], atol=1e-12)


@pytest.mark.parametrize(
    ("seconds", "lost", "step_s", "expected"),
    [
        (np.arange(50) * STEP_S, range(20, 26), STEP_S, ["'line'", "rows 20 to 27", "0.14 s", "rows: [start, stop]"]),
        (np.r_[np.arange(9), np.arange(20, 40)] * STEP_S, (), STEP_S, ["rows 9 to 10", "0.24 s"]),
        (np.arange(50) * STEP_S, (), 5 * STEP_S, ["'t'", "every 0.02 s", "resample_s: 0.02"]),
        (np.r_[0.0, np.arange(49)] * STEP_S, (), STEP_S, ["'t'", "row 2", "not increasing"]),
        (np.arange(50) * STEP_S, range(50), STEP_S, ["'line'", "0 values"]),
    ],
)
def test_what_cannot_be_bridged_is_said(seconds: np.ndarray, lost: range, step_s: float, expected: list[str]) -> None:
    with pytest.raises(RecordError) as error:
        on_even_grid(columns(seconds, *lost), "t", step_s, "a.csv")
    for text in ["a.csv", *expected]:
        assert text in str(error.value)
    assert "\n" not in str(error.value)


def test_a_logger_that_jitters_and_leaves_cells_blank_is_read_with_its_map(tmp_path: Path) -> None:
    path = tmp_path / "logger.csv"
    rows = [f"{20 * k + (k % 3)},{'' if k == 4 else 5},{k}" for k in range(30) if k != 11]
    path.write_text("\n".join(["t,u,y", *rows]) + "\n")
    run = load_run(path, DataMap.from_yaml(MAP))
    assert run.sample_time_s == STEP_S
    assert len(run) == 30
    assert np.all(run.signals["servo_voltage_v"] == 5.0)
    np.testing.assert_allclose(run.signals["position_m"], 1e-3 * np.arange(30), atol=1.5e-4)
    with pytest.raises(RecordError, match="the cell is empty"):
        load_run(path, DataMap.from_yaml(MAP.replace("resample_s: 0.02\n", "")))
    with pytest.raises(RecordError, match="needs time"):
        DataMap.from_yaml(MAP.replace("time: {column: t, unit: ms}", "sample_time_s: 0.02"))
