"""Which environment a start belongs to, and what a program in it sees."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from bootstrap.world import World, blas_kernel, current_world, sourced_ros, variables

ROOT = Path("/checkout")
WHEELS = World(ROOT, Path("/usr/bin/python3.11"), (3, 11))


@pytest.fixture
def apt_ros(tmp_path):
    (tmp_path / "jazzy" / "share" / "rclpy").mkdir(parents=True)
    return tmp_path / "jazzy"


def test_a_sourced_ros_is_used(apt_ros):
    environment = {"ROS_DISTRO": "jazzy", "AMENT_PREFIX_PATH": f"/overlay:{apt_ros}"}
    assert sourced_ros(environment, ROOT / ".dt-station") == ("jazzy", (Path("/overlay"), apt_ros))
    world = current_world(ROOT, environment)
    assert world.home.name.startswith("jazzy-cp3")
    assert world.memo.name == "python-jazzy"


@pytest.mark.parametrize(
    "environment",
    [
        {},
        {"ROS_DISTRO": "jazzy"},
        {"ROS_DISTRO": "jazzy", "AMENT_PREFIX_PATH": "/elsewhere"},
        {"AMENT_PREFIX_PATH": ""},
    ],
)
def test_without_rclpy_no_ros_is_sourced(environment):
    assert sourced_ros(environment, ROOT / ".dt-station") == (None, ())


def test_our_own_environment_does_not_count_as_a_sourced_ros(tmp_path):
    ours = tmp_path / ".dt-station" / "wheels-cp311" / "venv"
    (ours / "share" / "rclpy").mkdir(parents=True)
    environment = {"ROS_DISTRO": "jazzy", "AMENT_PREFIX_PATH": str(ours)}
    assert sourced_ros(environment, tmp_path / ".dt-station") == (None, ())


def test_everything_a_program_may_write_is_inside_the_checkout():
    env = variables(WHEELS, {"PATH": "/usr/bin"})
    for name in ("NUMBA_CACHE_DIR", "PYTHONPYCACHEPREFIX", "MPLCONFIGDIR", "ROS_HOME", "ROS_LOG_DIR", "COLCON_HOME"):
        assert Path(env[name]).is_relative_to(ROOT / ".dt-station")
    assert env["ROS_AUTOMATIC_DISCOVERY_RANGE"] == "LOCALHOST"
    assert env["RMW_IMPLEMENTATION"] == "rmw_fastrtps_cpp"
    assert env["PATH"].split(os.pathsep) == [str(WHEELS.venv / "bin"), "/usr/bin"]


def test_a_start_inside_a_start_changes_nothing():
    once = variables(WHEELS, {"PATH": "/usr/bin", "PYTHONPATH": "/mine"})
    assert variables(WHEELS, once) == once
    assert once["PYTHONPATH"].endswith(":/mine")


def test_the_users_own_settings_win():
    env = variables(WHEELS, {"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET", "NUMBA_CACHE_DIR": "/mine"})
    assert (env["ROS_AUTOMATIC_DISCOVERY_RANGE"], env["NUMBA_CACHE_DIR"]) == ("SUBNET", "/mine")


@pytest.mark.parametrize(
    ("text", "kernel"),
    [
        ("flags\t\t: fpu fma avx avx2 avx512f\n", "Haswell"),
        ("flags\t\t: fpu fma avx\n", None),
        ("Features\t: fp asimd\n", None),
    ],
)
def test_linear_algebra_is_the_same_on_all_machines_that_have_its_kernels(tmp_path, text, kernel):
    (tmp_path / "cpuinfo").write_text(f"processor\t: 0\n{text}")
    assert blas_kernel(tmp_path / "cpuinfo") == kernel
    assert blas_kernel(tmp_path / "none") is None


def test_programs_are_told_which_kernels_to_use(monkeypatch):
    for kernel in ("Haswell", None):
        monkeypatch.setattr("bootstrap.world.blas_kernel", lambda kernel=kernel: kernel)
        assert variables(WHEELS, {}).get("OPENBLAS_CORETYPE") == kernel
    assert variables(WHEELS, {"OPENBLAS_CORETYPE": "Zen"})["OPENBLAS_CORETYPE"] == "Zen"


def test_linear_algebra_has_one_thread_unless_the_user_says_otherwise():
    assert variables(WHEELS, {})["OPENBLAS_NUM_THREADS"] == "1"
    assert variables(WHEELS, {"OPENBLAS_NUM_THREADS": "4"})["OPENBLAS_NUM_THREADS"] == "4"


def test_bytecode_is_kept_even_where_the_caller_keeps_none(tmp_path):
    world = World(tmp_path, Path(sys.executable), sys.version_info[:2])
    (tmp_path / "module.py").write_text("")
    env = variables(world, {"PATH": os.defpath, "PYTHONDONTWRITEBYTECODE": "1", "PYTHONPATH": str(tmp_path)})
    subprocess.run([sys.executable, "-c", "import module"], env=env, check=True)
    assert list(world.cache.rglob("module.*.pyc"))
    assert not (tmp_path / "__pycache__").exists()


def test_with_a_sourced_ros_its_middleware_and_libraries_stay():
    world = World(ROOT, Path("/usr/bin/python3"), (3, 12), "jazzy", (Path("/opt/ros/jazzy"),))
    env = variables(world, {"AMENT_PREFIX_PATH": "/opt/ros/jazzy", "LD_LIBRARY_PATH": "/opt/ros/jazzy/lib"})
    assert "RMW_IMPLEMENTATION" not in env
    assert env["AMENT_PREFIX_PATH"] == f"{world.install}:/opt/ros/jazzy"
    assert env["LD_LIBRARY_PATH"].endswith(":/opt/ros/jazzy/lib")
    assert str(world.site_packages) in env["PYTHONPATH"].split(":")
