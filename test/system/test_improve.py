"""Experiments on the running station: each judged on its own samples, and the running twin takes what was found."""

import json

import numpy as np
import pytest

from dt_station_nodes.cli.app import main
from dt_station_nodes.cli.improve_station import RunningStation, shadowed
from dt_station_nodes.core.channels import Channel
from dt_station_nodes.records import load_run

pytestmark = pytest.mark.timeout(600)


def test_the_running_twin_takes_what_experiments_found_and_its_gap_falls(tmp_path, capfd):
    arguments = "improve paper --rig relief_hysteresis --pace lockstep --seconds 10 --budget 3 --json".split()
    assert main([*arguments, "--out", str(tmp_path / "out")]) == 0
    outcome = json.loads(capfd.readouterr().out)
    tables = [load_run(each["table"]).signals["pressure_pa"] for each in outcome["rounds"]]
    assert len(tables) >= 2
    assert all(len(table) == 500 for table in tables)
    pressure = outcome["live"]["pressure"]
    assert outcome["verdict"] == "named"
    assert pressure["after"] < 0.1 * pressure["before"]


def test_experiments_in_lockstep_are_the_same_however_busy_the_machine_is():
    def pressures_pa():
        with RunningStation(shadowed("paper", "paper", "relief_hysteresis", "lockstep")) as station:
            first = station.experiment(100)
            station.play(Channel.PRESSURE, {"shape": "square", "frequency_hz": 0.7})
            gap = station.gap(50)[Channel.PRESSURE]
            second = station.experiment(100)
        return [*first.signals["pressure_pa"], *second.signals["pressure_pa"], gap]

    np.testing.assert_array_equal(pressures_pa(), pressures_pa())
