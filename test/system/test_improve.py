"""Experiments on the running station: each judged on its own samples, and the running twin takes what was found."""

import json

import numpy as np
import pytest

from dt_station_nodes.cli.app import main
from dt_station_nodes.records import load_run

pytestmark = pytest.mark.timeout(300)


def test_the_hidden_hysteresis_is_found_and_the_live_gap_falls(tmp_path, capfd):
    arguments = "improve paper --rig relief_hysteresis --pace lockstep --seconds 10 --budget 2 --json".split()
    assert main([*arguments, "--out", str(tmp_path / "out")]) == 0
    outcome = json.loads(capfd.readouterr().out)
    tables = [load_run(each["table"]).signals["pressure_pa"] for each in outcome["rounds"]]
    # the square wave's flanks give way to the sine that was asked for: no sample of the former set-point is left
    jumps = [float(np.abs(np.diff(table)).max()) for table in tables]
    assert all(later < 0.5 * jumps[0] for later in jumps[1:])
    assert outcome["verdict"] == "named"
    assert ("hysteresis", "pressure") in {(e["name"], e["channel"]) for e in outcome["rounds"][-1]["effects"]}
    pressure = outcome["live"]["pressure"]
    assert pressure["after"] < 0.15 * pressure["before"]
