"""The demo's figures and page from made-up runs."""

import numpy as np
import pytest

from dt_station_nodes.cli.demo_report import write_report
from dt_station_nodes.cli.demo_table import DemoRun, index, pressure_steps, table
from dt_station_nodes.core.run import Run
from dt_station_nodes.nodes.statistics import RunStatistics

BRIDGE = {"missed_samples": 0, "latency_p99_s": 1e-3}


def run(position_error_m=0.0):
    time = 0.02 * np.arange(1200)
    setpoint = np.where(time % 4.0 < 2.0, 4.5e6, 1.5e6)
    level, pressure = 1.0e6, np.empty(1200)
    for k in range(1200):
        pressure[k] = level
        level += (setpoint[k] - level) * (1.0 - np.exp(-0.02 / 0.1))
    signals = {
        "pressure_setpoint_pa": setpoint,
        "position_setpoint_m": np.full(1200, 0.01),
        "load_voltage_v": np.zeros(1200),
        "servo_voltage_v": np.zeros(1200),
        "pressure_pa": pressure,
        "position_m": np.full(1200, 0.01 - position_error_m),
    }
    return Run(0.02, signals)


def demo_run(error_m):
    made = run(error_m)
    return DemoRun("made up", made, made, RunStatistics("paper", False, dict(BRIDGE), {}, {}, {}))


def test_the_index_is_the_papers_sum_over_800_samples():
    assert index(run(1e-3)) == pytest.approx(800.0)


def test_settling_and_overshoot_are_those_of_the_mean_edge():
    figures = pressure_steps(run())
    assert figures.settling_s == pytest.approx(0.1 * np.log(50.0), abs=0.02)
    assert figures.overshoot_percent == pytest.approx(0.0, abs=1e-6)


def test_the_page_holds_the_table_and_needs_nothing_else(tmp_path):
    runs = {"pid": demo_run(1e-4), "fuzzy": demo_run(2e-4), "ziegler_nichols": demo_run(0.0)}
    rows = table(runs)
    assert {row["what"]: row["ours"] for row in rows}["index ratio, fuzzy to pid"] == pytest.approx(4.0)
    found = {"sentence": "hysteresis <found>", "report": tmp_path / "discovery" / "report.html"}
    page = write_report(tmp_path / "report.html", runs, rows, found).read_text()
    assert page.count("<svg") == 3
    assert "hysteresis &lt;found&gt;" in page
    assert 'href="discovery/report.html"' in page
    assert "http://" not in page.replace("http://www.w3.org", "").replace("http://purl.org", "").replace(
        "http://creativecommons.org", ""
    )
    assert write_report(tmp_path / "again.html", runs, rows, found).read_text() == page
