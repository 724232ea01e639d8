"""Scenarios: read, checked, completed into plans."""

import re
from pathlib import Path

import pytest
import yaml

from dt_station_nodes.core.errors import StationError
from dt_station_nodes.nodes.configuration import ConfigurationError, config_dir, find_config
from dt_station_nodes.nodes.loop_parameters import load_loop, loop_from_values, loop_table
from dt_station_nodes.nodes.registry import NODES, UnknownNodeError, entry
from dt_station_nodes.nodes.scenario import NodeSpec, Scenario, ScenarioError, plan


def plans(scenario):
    return {each.name: each for each in plan(scenario)}


@pytest.mark.parametrize("path", sorted((config_dir() / "scenarios").glob("*.yaml")), ids=lambda p: p.stem)
def test_every_shipped_scenario_can_be_planned(path):
    assert plan(Scenario.load(path))


def test_a_plan_knows_who_waits_for_whom():
    made = plans(Scenario.load("paper").changed(pace="lockstep", sample_time_s=0.01))
    assert made["daq_bridge"].parameters["wait_for_readers"] == ["object/state:6"]
    assert made["daq_bridge"].parameters["wait_for_nodes"] == 6
    assert made["daq_bridge"].parameters["followers"] == ["shadow"]
    assert made["daq_bridge"].parameters["pace"] == "lockstep"
    assert made["load_generator"].parameters["wait_for_readers"] == ["load/setpoint:2"]
    assert made["pressure_controller"].parameters["wait_for_writers"] == ["load/setpoint"]
    assert {each.parameters["sample_time_s"] for each in made.values()} == {0.01}
    assert yaml.safe_load(made["daq_bridge"].parameters["backend_options"]) == {"rig": "paper"}


def test_leaving_out_and_adding_nodes_changes_what_is_waited_for():
    alone = Scenario.load("paper").with_nodes(
        pressure_controller=None,
        position_controller=None,
        shadow_compare=None,
        recorder=NodeSpec(parameters={"out": "x"}),
    )
    made = plans(alone)
    assert made["daq_bridge"].parameters["expect"] in ([], ["nobody"])
    assert made["daq_bridge"].parameters["followers"] == ["twin"]
    assert made["daq_bridge"].parameters["wait_for_readers"] == ["object/state:4"]
    assert "sample_time_s" not in made["recorder"].parameters


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[", "not YAML"),
        ("3", "no scenario"),
        ("name: a\nnodes: {}\npace: fast", "pace"),
        ("name: a\nnodes: {}\nsample_time_s: 0", "sample_time_s"),
        ("name: a\nnodes: {x: {colour: red}}", "colour"),
    ],
)
def test_a_wrong_scenario_is_one_sentence(text, words):
    with pytest.raises(ScenarioError, match=words) as caught:
        Scenario.from_yaml(text, "file.yaml")
    assert "\n" not in str(caught.value)


def test_unknown_things_are_named():
    with pytest.raises(ScenarioError, match="no executable 'x'"):
        plan(Scenario(name="a", nodes={"x": NodeSpec()}))
    with pytest.raises(ScenarioError, match="no node 'moon'"):
        Scenario.load("paper").with_parameters("moon", phase=1)
    with pytest.raises(ConfigurationError, match="paper"):
        find_config("scenarios", "nowhere")
    with pytest.raises(UnknownNodeError, match="daq_bridge"):
        entry("nobody")


def test_a_loop_survives_its_way_through_parameters():
    loop = load_loop("position_pid", ["position_fuzzy"])
    table = loop_table(loop, "position.")
    values = {line.name: line.checked(line.default) for line in table}
    assert loop_from_values(loop, values, "position.") == loop
    assert all(line.name.startswith("position.") and line.text for line in table)
    with pytest.raises(StationError, match="lower_v"):
        loop_from_values(loop, {**values, "position.limits.lower_v": 99.0}, "position.")


def test_the_shipped_parameter_file_names_only_parameters_that_exist():
    sources = "\n".join(path.read_text() for path in Path(entry("daq_bridge").__code__.co_filename).parent.glob("*.py"))
    declared = set(re.findall(r'Parameter\(\s*"([a-z_]+)"', sources))
    for node, spec in yaml.safe_load((config_dir() / "station.yaml").read_text()).items():
        assert node.startswith("/station/")
        assert set(spec["ros__parameters"]) <= declared, node
    assert len(NODES) == 9
