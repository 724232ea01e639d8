"""`shadow` from end to end: real processes over DDS, one bag, the figures it prints."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.comparison import score
from dt_station_nodes.core.models import ModelSpec, PlantModel
from dt_station_nodes.nodes.configuration import find_config
from dt_station_nodes.records import load_run, write_csv
from support.rigs import rig

pytestmark = pytest.mark.timeout(180)


def shadow(*arguments):
    command = [sys.executable, "-m", "dt_station_nodes.cli", "shadow", *map(str, arguments), "--json"]
    done = subprocess.run(command, capture_output=True, text=True, env=os.environ, timeout=150, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_a_run_of_both_channels_comes_through_unchanged(tmp_path):
    k = np.arange(300)
    load, servo = np.where(k % 100 < 50, 1.0, 3.0), 0.5 * np.sin(0.05 * k)
    run = rig("paper", 0.02).simulate(load, servo)
    write_csv(run, tmp_path / "run.csv")
    run = load_run(tmp_path / "run.csv")
    result = shadow(tmp_path / "run.csv", "--model", "paper", "--out", tmp_path / "out")
    assert result["missed"] == 0
    assert result["repeats_offline"] is True
    assert [row["channel"] for row in result["rows"]] == ["pressure", "position"]

    spec = ModelSpec.from_yaml(find_config("models", "paper").read_text(encoding="utf-8"))
    model = PlantModel(spec, 0.02)
    start = model.initial_state(run.signals["position_m"][0], run.signals["pressure_pa"][0])
    voltages = (run.signals[channel.voltage_signal] for channel in Channel)
    alone = model.simulate(*voltages, run.signals["pressure_pa"], start)
    for row, measured, simulated in zip(
        result["rows"],
        (run.signals["pressure_pa"], run.signals["position_m"]),
        (alone.pressure_pa, alone.position_m),
        strict=True,
    ):
        wanted = score(measured, simulated, 0.02)
        assert row["samples"] == 300
        assert row["rms"] == pytest.approx(wanted.rms, rel=1e-12)
        assert row["fit_percent"] == pytest.approx(wanted.fit_percent, rel=1e-9)
    assert all(os.path.exists(path) for path in result["files"].values())
    recorded = load_run(result["files"]["bag"])
    assert len(recorded) >= len(run) - 1
    assert np.array_equal(recorded.signals["pressure_pa"][:299], run.signals["pressure_pa"][:299])


@pytest.mark.measured
def test_the_crane_shows_the_published_gap_of_a_linear_model(measured_data, tmp_path):
    result = shadow(
        measured_data / "hydraulic_crane.mat",
        "--map",
        "crane_validation",
        "--model",
        "crane",
        "--out",
        tmp_path / "out",
    )
    assert result["repeats_offline"] is True
    assert [row["channel"] for row in result["rows"]] == ["pressure"]
    linear = result["published"][0]
    assert linear["low"] == 39
    assert linear["ours"] == pytest.approx(39, abs=4)


@pytest.mark.measured
def test_emps_shows_the_published_gap_of_a_linear_model(measured_data, tmp_path):
    result = shadow(measured_data / "emps.mat", "--map", "emps", "--model", "emps_free_run", "--out", tmp_path / "out")
    assert result["repeats_offline"] is True
    assert result["samples"] == 24841
    linear = result["published"][0]
    assert linear["low"] <= linear["ours"] <= linear["high"]
