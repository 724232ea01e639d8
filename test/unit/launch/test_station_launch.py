"""The launch file against stand-ins for launch: it names nodes, arguments and parameters that exist."""

import runpy
import sys
import types
from pathlib import Path

import pytest
import yaml

from dt_station_nodes.nodes.configuration import config_dir
from dt_station_nodes.nodes.registry import NODES
from dt_station_nodes.nodes.scenario import Scenario

FILE = Path(__file__).resolve().parents[3] / "src" / "dt_station_nodes" / "launch" / "station.launch.py"


class Recorded:
    def __init__(self, *args, **kwargs):
        self.args, self.kwargs = args, kwargs


@pytest.fixture
def description(monkeypatch):
    names = {
        "launch": ["LaunchDescription"],
        "launch.actions": ["DeclareLaunchArgument", "EmitEvent", "RegisterEventHandler"],
        "launch.event_handlers": ["OnProcessExit"],
        "launch.events": ["Shutdown"],
        "launch.substitutions": ["LaunchConfiguration", "PythonExpression"],
        "launch_ros": [],
        "launch_ros.actions": ["Node"],
        "launch_ros.parameter_descriptions": ["ParameterValue"],
    }
    for module, members in names.items():
        made = types.ModuleType(module)
        for member in members:
            setattr(made, member, type(member, (Recorded,), {}))
        monkeypatch.setitem(sys.modules, module, made)
    return runpy.run_path(str(FILE))["generate_launch_description"]()


def test_all_nodes_start_with_arguments_that_are_declared(description):
    (entities,) = description.args
    nodes = [each.kwargs for each in entities if type(each).__name__ == "Node"]
    assert [node["executable"] for node in nodes].count("load_generator") == 2
    assert {node["executable"] for node in nodes} == set(NODES) - {"recorder", "replayer", "panel"}
    assert len({node["name"] for node in nodes}) == len(nodes) == 7
    declared = {each.args[0] for each in entities if type(each).__name__ == "DeclareLaunchArgument"}

    def used(value):
        if type(value).__name__ == "LaunchConfiguration":
            yield value.args[0]
        children = value.values() if isinstance(value, dict) else value if isinstance(value, (list, tuple)) else ()
        if isinstance(value, Recorded):
            children = (*value.args, *value.kwargs.values())
        for child in children:
            yield from used(child)

    assert set(used(nodes)) == declared


def test_the_waveforms_are_those_of_the_scenario(description):
    (entities,) = description.args
    nodes = {each.kwargs["name"]: each.kwargs["parameters"][0] for each in entities if type(each).__name__ == "Node"}
    scenario = Scenario.load("paper")
    station = yaml.safe_load((config_dir() / "station.yaml").read_text(encoding="utf-8"))
    for name in ("load_generator", "position_generator"):
        wanted = scenario.nodes[name].parameters
        for given in (nodes[name], station[f"/station/{name}"]["ros__parameters"]):
            for key in ("channel", "shape", "amplitude", "offset", "frequency_hz"):
                if key in given:
                    assert given[key] == wanted[key], (name, key)
