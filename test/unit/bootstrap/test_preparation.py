"""The preparation's parts: the lock, the corrections, the machine's own needs, and an end that leaves nothing."""

import os
import shutil
import subprocess
import sys
import threading
from pathlib import Path
from types import SimpleNamespace

import pytest

from bootstrap import checks, debian, prepare
from bootstrap.corrections import correct_prefix, corrected
from bootstrap.errors import PreparationError
from bootstrap.plan import Workspace
from bootstrap.processes import Processes
from bootstrap.requirements import blocks, is_build_tool, select
from bootstrap.stages import Stamps
from bootstrap.world import World

ROOT = Path(__file__).resolve().parents[3]
LOCK = """# comment
numpy==2.2.6 ; python_full_version < '3.11' \\
    --hash=sha256:aa
numpy==2.4.6 ; python_full_version >= '3.11' \\
    --hash=sha256:bb \\
    --hash=sha256:cc
Ros_RclPy==7.1.6 \\
    --hash=sha256:dd
"""
EXPORTED = (
    'list(APPEND dirs "/opt/python/cp311-cp311/include/python3.11;'
    '/opt/python/cp311-cp311/lib/python3.11/site-packages/numpy/_core/include" "${_IMPORT_PREFIX}/include")'
)


@pytest.fixture
def world(tmp_path):
    return World(tmp_path, Path(sys.executable), sys.version_info[:2])


def test_the_lock_is_split_by_package():
    assert list(blocks(LOCK)) == ["numpy", "ros-rclpy"]
    assert len(blocks(LOCK)["numpy"]) == 2
    assert select(LOCK, lambda name: name == "ros-rclpy") == "Ros_RclPy==7.1.6 \\\n    --hash=sha256:dd\n"
    assert select(LOCK, lambda _: True).splitlines() == LOCK.splitlines()[1:]
    with pytest.raises(ValueError, match="not a pinned requirement"):
        blocks("--find-links somewhere")


def test_the_real_lock_holds_what_the_message_build_needs():
    lock = (ROOT / "requirements.lock").read_text()
    tools = [name for name in blocks(lock) if is_build_tool(name)]
    for name in ("ros-rosidl-generator-py", "ros-ament-cmake-core", "colcon-core", "empy", "lark-parser", "numpy"):
        assert name in tools
    assert "pyarrow" not in tools
    assert select(lock, lambda _: True).count("--hash=") == lock.count("--hash=")


def test_exported_include_folders_become_ours():
    text = corrected(EXPORTED, "/ours/include/python3.11", "/venv/numpy/_core/include")
    assert text == (
        'list(APPEND dirs "/ours/include/python3.11;/venv/numpy/_core/include" "${_IMPORT_PREFIX}/include")'
    )
    assert corrected(text, "/other", "/other") == text


def test_corrections_leave_the_installers_cache_alone(tmp_path):
    cache = tmp_path / "cache.cmake"
    cache.write_text(EXPORTED)
    exported = tmp_path / "venv" / "share" / "std_msgs" / "cmake" / "export.cmake"
    exported.parent.mkdir(parents=True)
    os.link(cache, exported)
    assert correct_prefix(tmp_path / "venv", "/ours", "/numpy") == 1
    assert correct_prefix(tmp_path / "venv", "/ours", "/numpy") == 0
    assert cache.read_text() == EXPORTED
    assert "/opt/python" not in exported.read_text()
    assert [path.name for path in exported.parent.iterdir()] == ["export.cmake"]


def test_a_missing_compiler_is_one_sentence_with_the_command(world, monkeypatch):
    monkeypatch.setattr(checks.shutil, "which", lambda name: None)
    with pytest.raises(PreparationError, match=r"lacks a C and C\+\+ compiler.*sudo apt install g\+\+"):
        checks.require_machine(world)


def test_missing_headers_are_one_sentence(world, monkeypatch):
    monkeypatch.setattr(World, "machine_has_headers", lambda self: False)
    monkeypatch.setattr(debian, "obtainable", lambda: False)
    with pytest.raises(PreparationError, match="lacks the headers of Python 3"):
        checks.require_machine(world)


def test_a_failing_command_says_its_last_lines_and_where_the_rest_is(tmp_path):
    command = ["sh", "-c", "echo broken pipe dream; exit 3"]
    with pytest.raises(PreparationError, match=r"broken pipe dream\nsh failed with exit status 3; .*a\.log"):
        Processes().run(command, tmp_path / "a.log", os.environ, lambda line: None)
    assert "broken pipe dream" in (tmp_path / "a.log").read_text()


def test_models_are_compiled_anew_when_they_change(world):
    """A cached kernel is kept although what it calls is another: nothing cached may be left."""
    stale = world.cache / "numba" / "effects" / "friction.nbi"
    stale.parent.mkdir(parents=True)
    stale.write_text("old")
    seen = []
    processes = SimpleNamespace(run=lambda *_, **__: seen.append(stale.exists()))
    Workspace(world, processes, {}).warm(lambda _: None)
    assert seen == [False]


def test_stopping_ends_a_command_with_its_children(tmp_path):
    processes, started = Processes(), threading.Event()
    command = ["sh", "-c", "sleep 600 & echo started; wait"]

    def work():
        with pytest.raises(PreparationError):
            processes.run(command, tmp_path / "a.log", os.environ, lambda line: started.set())

    thread = threading.Thread(target=work)
    thread.start()
    assert started.wait(20)
    processes.stop()
    thread.join(20)  # the pipe closes only when the grandchild has ended too
    assert not thread.is_alive()
    with pytest.raises(PreparationError, match="stopped"):
        processes.run(command, tmp_path / "a.log", os.environ, lambda line: None)


def test_a_second_start_waits_for_the_first(world, capfd):
    world.state.mkdir()
    done, entered = threading.Event(), threading.Event()

    def second():
        def outdated():
            entered.set()
            assert done.is_set(), "it did not wait"
            return []

        prepare.make_ready(world, outdated, Stamps(world.home), Processes())

    with prepare.alone(world):
        thread = threading.Thread(target=second)
        thread.start()
        while "waiting for it" not in capfd.readouterr().err:
            assert thread.is_alive()
        assert not entered.is_set()
        done.set()
    thread.join(20)
    assert entered.is_set()


def test_the_entry_script_says_what_it_lacks(tmp_path):
    tools = tmp_path / "bin"
    tools.mkdir()
    for name in ("sh", "dirname", "readlink"):
        (tools / name).symlink_to(shutil.which(name))
    (tools / "python3").write_text("#!/bin/sh\nexit 1\n")  # too old
    (tools / "python3").chmod(0o755)
    shutil.copy(ROOT / "dt-station", tmp_path / "dt-station")
    done = subprocess.run(
        [tmp_path / "dt-station", "demo"], env={"PATH": str(tools)}, capture_output=True, text=True, check=False
    )
    assert done.returncode == 1
    assert done.stdout == ""
    assert done.stderr.startswith("dt-station: no Python 3.10 to 3.14 found")
    assert done.stderr.count("\n") == 1
