"""The relay on the live station: bridge as a process, the relay in the controllers' place."""

import json

import pytest

from dt_station_nodes.cli.app import main

pytestmark = pytest.mark.timeout(120)


def test_the_graph_finds_the_same_ultimate_point_as_the_rig_in_this_process(tmp_path, capfd):
    found = {}
    for place in ("rig", "station"):
        arguments = ["tune", "pressure", "--method", "relay", "--on", place, "--out", str(tmp_path / place), "--json"]
        assert main(arguments) == 0
        found[place] = json.loads(capfd.readouterr().out)["ultimate"]
    assert found["rig"] == found["station"]


def test_limits_hold_on_the_station_too(tmp_path, capfd):
    arguments = ["tune", "pressure", "--method", "relay", "--on", "station", "--highest", "2.6e6", "--amplitude", "2"]
    assert main([*arguments, "--out", str(tmp_path / "out")]) == 1
    assert "left the limits" in capfd.readouterr().err
