"""What a start finds to do."""

import os
import sys

import pytest

from bootstrap import plan, start
from bootstrap.processes import Processes
from bootstrap.stages import Stamps
from bootstrap.world import World


@pytest.fixture
def world(tmp_path):
    """A checkout with everything that keys are made of, prepared in full."""
    for name in ("requirements.lock", "bootstrap/uv.lock", "src/dt_station_msgs/msg/A.msg", "config/a.yaml"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("1")
    nodes = tmp_path / "src" / "dt_station_nodes"
    for name in ("setup.py", "setup.cfg", "package.xml", "launch/a.launch.py"):
        (nodes / name).parent.mkdir(parents=True, exist_ok=True)
        (nodes / name).write_text("1")
    for name in plan.COMPILED:
        path = (
            nodes / "dt_station_nodes" / name / "a.py"
            if not name.endswith(".py")
            else nodes / "dt_station_nodes" / name
        )
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("1")
    made = World(tmp_path, sys.executable, sys.version_info[:2])
    for program in (made.venv_python, made.uv):
        program.parent.mkdir(parents=True)
        program.touch(mode=0o755)
    stamps = Stamps(made.home / "stamps")
    for stage in plan.plan(made, Processes(), os.environ):
        stamps.write(stage, 1.0)
    return made


def names(world):
    return {stage.name for stage in start.outdated(world, Stamps(world.home / "stamps"), Processes())}


def test_a_second_start_has_nothing_to_do(world):
    assert names(world) == set()


@pytest.mark.parametrize(
    ("changed", "redone"),
    [
        ("requirements.lock", {"tools", "packages", "messages", "nodes", "warm"}),
        ("src/dt_station_msgs/msg/A.msg", {"messages", "nodes"}),
        ("src/dt_station_nodes/setup.py", {"nodes"}),
        ("bootstrap/uv.lock", {"uv", "tools", "packages", "messages", "nodes", "warm"}),
        ("src/dt_station_nodes/dt_station_nodes/core/models/a.py", {"warm"}),
        ("config/a.yaml", set()),
    ],
)
def test_a_change_redoes_what_was_made_from_it(world, changed, redone):
    (world.root / changed).write_text("2")
    assert names(world) == redone


def test_a_new_configuration_file_is_linked(world):
    (world.root / "config" / "b.yaml").write_text("1")
    assert names(world) == {"nodes"}


def test_a_lost_environment_is_made_again(world):
    world.venv_python.unlink()
    assert {"venv", "tools", "packages", "messages", "nodes", "warm"} == names(world)


def test_an_installer_that_could_not_be_had_is_tried_again_with_the_next_installation_only(world):
    world.uv.unlink()
    assert names(world) == set()
    (world.root / "requirements.lock").write_text("2")
    assert "uv" in names(world)
