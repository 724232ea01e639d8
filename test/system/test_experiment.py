"""Identification experiments through the graph: the bag, the table, and what the table is good for."""

import json

import pytest

from dt_station_nodes.cli.app import main
from dt_station_nodes.records import Bag

pytestmark = pytest.mark.timeout(120)


def run(capfd, *arguments):
    assert main([*map(str, arguments), "--json"]) == 0
    return json.loads(capfd.readouterr().out)


def test_the_graph_gives_the_same_table_as_the_process_alone_and_a_bag(tmp_path, capfd):
    alone = run(capfd, "experiment", "joint", "--duration", 6, "--in-process", "--out", tmp_path / "alone")
    graph = run(capfd, "experiment", "joint", "--duration", 6, "--out", tmp_path / "graph")
    assert graph["samples"] == alone["samples"] == 300
    assert (tmp_path / "graph" / "run.csv").read_bytes() == (tmp_path / "alone" / "run.csv").read_bytes()
    with Bag(tmp_path / "graph" / "bag") as bag:
        topics = {topic.rsplit("/station/")[-1] for topic in bag.topics}
    assert {"object/state", "load/command", "position/command"} <= topics


def test_a_piston_that_leaves_its_travel_ends_the_experiment_with_one_sentence(tmp_path, capfd):
    arguments = [
        "experiment",
        "position-triangle",
        "--centre",
        "0.3",
        "--duration",
        "40",
        "--out",
        str(tmp_path / "out"),
    ]
    assert main(arguments) == 2
    written = capfd.readouterr()
    assert "the piston is at" in written.err
    assert "Traceback" not in written.err
