"""Each node as a process of its own: a clean end on SIGINT and SIGTERM, a sentence for a wrong parameter."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from dt_station_nodes.nodes import registry
from dt_station_nodes.nodes.offspring import Nursery

ALONE = (
    "daq_bridge",
    "load_generator",
    "pressure_controller",
    "position_controller",
    "twin_simulator",
    "shadow_compare",
)


@pytest.fixture(scope="module")
def nursery():
    made = Nursery(ALONE)
    yield made
    made.close()


def words(log):
    return log.read_text() if log.exists() else ""


def started(nursery, folder):
    children = {}
    for number, name in enumerate(ALONE):
        arguments = [name, "--ros-args", "-r", f"__node:={name}_{number}"]
        if name == "daq_bridge":
            arguments += ["-p", "backend:=fake"]
        children[name] = nursery.start(arguments, folder / name)
    return children


def statuses_after(children, first):
    for number, child in enumerate(children.values()):
        child.send_signal((signal.SIGINT, signal.SIGTERM)[(number + first) % 2])
    return {name: child.wait(20.0) for name, child in children.items()}


def test_every_node_ends_with_status_0_on_either_signal(nursery, tmp_path):
    children = started(nursery, tmp_path)
    # a node is up once DDS has its threads
    for child in children.values():
        end = time.monotonic() + 30.0
        while len(list(Path(f"/proc/{child.pid}/task").iterdir())) < 4:
            assert time.monotonic() < end
            time.sleep(0.01)
    statuses = statuses_after(children, 0)
    assert statuses == dict.fromkeys(ALONE, 0), {name: words(tmp_path / name) for name in ALONE}


@pytest.mark.parametrize("first", [0, 1])
def test_a_node_told_to_stop_while_it_starts_does_so_with_status_0(nursery, tmp_path, first):
    statuses = statuses_after(started(nursery, tmp_path), first)
    assert statuses == dict.fromkeys(ALONE, 0), {name: words(tmp_path / name) for name in ALONE}


def test_a_wrong_parameter_is_one_sentence_and_status_2(nursery, tmp_path):
    child = nursery.start(["load_generator", "--ros-args", "-p", "shape:=zigzag"], tmp_path / "log")
    assert child.wait(20.0) == 2
    assert words(tmp_path / "log").strip().endswith("got 'zigzag'")
    assert "Traceback" not in words(tmp_path / "log")


def test_a_killed_node_is_reported_with_its_signal(nursery, tmp_path):
    child = nursery.start(["shadow_compare"], tmp_path / "log")
    os.kill(child.pid, signal.SIGKILL)
    assert child.wait(10.0) == -signal.SIGKILL


def test_an_unknown_node_is_a_sentence():
    command = [sys.executable, "-m", "dt_station_nodes.nodes", "nobody"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "daq_bridge" in done.stderr
    assert "Traceback" not in done.stderr
    assert set(ALONE) <= set(registry.NODES)
