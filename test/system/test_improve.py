"""Experiments on the running station: each judged on its own samples, and the running twin takes what was found."""

import json

import pytest

from dt_station_nodes.cli.app import main
from dt_station_nodes.records import load_run

pytestmark = pytest.mark.timeout(600)


def test_the_running_twin_takes_what_experiments_found_and_its_gap_falls(tmp_path, capfd):
    arguments = "improve paper --rig relief_hysteresis --pace lockstep --seconds 10 --budget 3 --json".split()
    assert main([*arguments, "--out", str(tmp_path / "out")]) == 0
    outcome = json.loads(capfd.readouterr().out)
    tables = [load_run(each["table"]).signals["pressure_pa"] for each in outcome["rounds"]]
    assert len(tables) >= 2
    assert all(len(table) == 500 for table in tables)
    # which sample an experiment begins with depends on the machine, and with it what ten seconds tell
    pressure = outcome["live"]["pressure"]
    assert (pressure["after"] < 0.5 * pressure["before"]) == (outcome["verdict"] == "named")
