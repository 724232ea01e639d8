"""The demo and the live verbs, from the command line."""

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

pytestmark = pytest.mark.timeout(600)
CLI = [sys.executable, "-m", "dt_station_nodes.cli"]


def test_the_demo_leaves_bags_a_report_and_a_table(tmp_path):
    command = [*CLI, "demo", "--no-discover", "--json", "--out", str(tmp_path / "demo")]
    done = subprocess.run(command, capture_output=True, text=True, timeout=150, check=False)
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout)
    assert [Path(bag).name for bag in result["bags"]] == ["pid", "fuzzy"]
    assert all((Path(bag) / "metadata.yaml").is_file() for bag in result["bags"])
    assert Path(result["report"]).stat().st_size > 50_000
    assert result["missed_samples"] == 0
    assert result["realtime_factor"] > 1.0
    ours = {row["what"]: row["ours"] for row in result["rows"]}
    paper = {row["what"]: row["paper"] for row in result["rows"]}
    assert paper["position error index (8), pid"] == 1.3031
    assert 0.1 < ours["position error index (8), pid"] < ours["position error index (8), fuzzy"] < 10.0
    assert 0.3 < ours["pressure settling (2 %), optimised PI"] < 0.6
    assert ours["pressure settling (2 %), Ziegler-Nichols PI"] > ours["pressure settling (2 %), optimised PI"]
    assert ours["pressure overshoot, optimised PI"] < 1.0
    again = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert again.returncode == 2
    assert "--force" in again.stderr


def test_the_running_station_takes_orders_and_stops_on_a_signal(tmp_path):
    # a log folder of its own tells when the station is up
    command = [*CLI, "run", "paper", "--duration", "0", "--json", "--out", str(tmp_path / "run")]
    station = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:

        def order(*words, status=0):
            done = subprocess.run([*CLI, "set", *words, "--wait", "30"], capture_output=True, text=True, check=False)
            assert done.returncode == status, done.stderr
            return done

        changed = order("load", "--shape", "sine", "--amplitude", "0.5MPa", "--frequency", "0.5Hz", "--json")
        waveform = json.loads(changed.stdout)["waveform"]
        assert (waveform["shape"], waveform["amplitude"], waveform["offset"]) == ("sine", 5e5, 3e6)
        order("position", "--controller", "fuzzy")
        refused = order("position", "--controller", "magic", status=2)
        assert "magic" in refused.stderr
    finally:
        station.send_signal(signal.SIGTERM)
        out, err = station.communicate(timeout=60)
    assert station.returncode == 0, err
    result = json.loads(out)["statistics"]
    assert set(result["exit_status"].values()) == {0}
    assert result["bridge"]["samples"] > 10
    assert result["restarts"] == dict.fromkeys(result["restarts"], 0)


def test_interrupting_a_run_of_fixed_length_says_so(tmp_path):
    station = subprocess.Popen(
        [*CLI, "run", "paper", "--duration", "600s", "--out", str(tmp_path / "run")],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    end = time.monotonic() + 60.0
    while not (tmp_path / "run" / "shadow_compare.log").exists():
        assert time.monotonic() < end
        time.sleep(0.01)
    station.send_signal(signal.SIGTERM)
    _, err = station.communicate(timeout=60)
    assert station.returncode == 130
    assert "interrupted" in err
    assert "Traceback" not in err
