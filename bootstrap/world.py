"""Where everything of one environment lives, and the variables a program in it gets.

A *world* is one interpreter with one ROS: the private one from wheels, or the ROS 2 that the shell has sourced.
All of it is below .dt-station/ in the checkout; nothing outside is changed.
"""

import os
import sys
import sysconfig
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

STATE = ".dt-station"
CPU = Path("/proc/cpuinfo")


@dataclass(frozen=True, slots=True)
class World:
    """One environment: the checkout, the interpreter it grows from, and the sourced ROS, if any."""

    root: Path
    python: Path
    version: tuple[int, int]
    ros: str | None = None
    ros_prefixes: tuple[Path, ...] = ()

    @property
    def state(self) -> Path:
        """What all worlds of this checkout share."""
        return self.root / STATE

    @property
    def home(self) -> Path:
        """The folder of this world alone."""
        return self.state / f"{self.ros or 'wheels'}-cp{self.version[0]}{self.version[1]}"

    @property
    def uv(self) -> Path:
        """The fast installer, shared by all worlds."""
        return self.state / "tools" / "bin" / "uv"

    @property
    def venv(self) -> Path:
        """The virtual environment."""
        return self.home / "venv"

    @property
    def venv_python(self) -> Path:
        """The interpreter that everything runs with."""
        return self.venv / "bin" / "python"

    @property
    def site_packages(self) -> Path:
        """Where the virtual environment's packages are."""
        return self.venv / "lib" / f"python{self.version[0]}.{self.version[1]}" / "site-packages"

    @property
    def install(self) -> Path:
        """Colcon's install folder, both packages merged."""
        return self.home / "install"

    @property
    def build(self) -> Path:
        """Colcon's build folder."""
        return self.home / "build"

    @property
    def logs(self) -> Path:
        """One log a stage."""
        return self.home / "log"

    @property
    def cache(self) -> Path:
        """Caches that programs would otherwise keep in the home folder."""
        return self.home / "cache"

    @property
    def memo(self) -> Path:
        """Where the entry script finds the interpreter without searching."""
        return self.state / (f"python-{self.ros}" if self.ros else "python")

    @property
    def setup_file(self) -> Path:
        """What a shell sources to work in this world."""
        return self.state / (f"setup-{self.ros}.sh" if self.ros else "setup.sh")

    @property
    def own_headers(self) -> Path:
        """Where a Debian package with Python's headers is unpacked, if the machine has none."""
        return self.home / "headers"

    def machine_has_headers(self) -> bool:
        """Whether Python.h is where the interpreter says."""
        return (Path(sysconfig.get_paths()["include"]) / "Python.h").is_file()

    def has_headers(self) -> bool:
        """Whether there is a Python.h to compile with."""
        return (Path(self.python_include()) / "Python.h").is_file()

    def python_include(self) -> str:
        """The folder of Python.h."""
        if self.machine_has_headers():
            return sysconfig.get_paths()["include"]
        return str(self.own_headers / "usr" / "include" / f"python{self.version[0]}.{self.version[1]}")


def sourced_ros(environment: Mapping[str, str], state: Path) -> tuple[str | None, tuple[Path, ...]]:
    """Return distribution and prefixes of the ROS 2 that is sourced, if rclpy is there; our own do not count."""
    distribution = environment.get("ROS_DISTRO")
    prefixes = tuple(
        Path(entry)
        for entry in environment.get("AMENT_PREFIX_PATH", "").split(os.pathsep)
        if entry and not Path(entry).is_relative_to(state)
    )
    if distribution and any((prefix / "share" / "rclpy").is_dir() for prefix in prefixes):
        return distribution, prefixes
    return None, ()


def current_world(root: Path, environment: Mapping[str, str]) -> World:
    """Return the world of the interpreter this runs in and of the ROS in its environment."""
    ros, prefixes = sourced_ros(environment, root / STATE)
    python = Path(sys.executable)
    if (python.parents[1] / "pyvenv.cfg").is_file():  # a virtual environment that may go; what it is made from stays
        python = python.resolve()
    return World(root, python, sys.version_info[:2], ros, prefixes)


def _joined(*parts: Path | str) -> str:
    """Join search paths, each once, the first winning."""
    entries = [entry for part in parts for entry in str(part).split(os.pathsep) if entry]
    return os.pathsep.join(dict.fromkeys(entries))


def blas_kernel(cpu: Path = CPU) -> str | None:
    """Return the kernels of linear algebra that all machines of this kind have; None: those it picks by itself.

    With wider ones sums come out otherwise in the last digit, and a search that hangs on one ends elsewhere.
    """
    try:
        with cpu.open() as lines:
            flags = next(line for line in lines if line.startswith("flags"))
    except (OSError, StopIteration):
        return None
    return "Haswell" if {"avx2", "fma"} <= set(flags.split()) else None


def variables(world: World, environment: Mapping[str, str]) -> dict[str, str]:
    """Return the environment of a program in this world, grown from the caller's."""
    env = {name: value for name, value in environment.items() if name not in ("PYTHONHOME", "__PYVENV_LAUNCHER__")}
    old = env.get
    library = f"lib/python{world.version[0]}.{world.version[1]}/site-packages"
    prefixes: list[Path] = [world.install]
    libraries: list[Path] = [world.install / "lib"]
    modules: list[Path] = [world.root / "src" / "dt_station_nodes", world.install / library]
    modules.append(world.build / "dt_station_nodes")  # the package's metadata
    if world.ros is None:
        prefixes.append(world.venv)
        libraries += [world.venv / "lib", *sorted(world.site_packages.glob("ros_*.libs"))]
        env["RMW_IMPLEMENTATION"] = "rmw_fastrtps_cpp"
        env["ROS_VERSION"] = "2"
        # The wheels would start the interpreter a second time to set LD_LIBRARY_PATH; it is set here.
        env["_ROS_WHEELS_BOOTSTRAP_COMPLETE"] = "1"
    else:
        modules.append(world.site_packages)  # for executables that ros2 run starts with the system's interpreter
    env.update(
        PATH=_joined(world.venv / "bin", old("PATH", os.defpath)),
        VIRTUAL_ENV=str(world.venv),
        PYTHONPATH=_joined(*modules, old("PYTHONPATH", "")),
        PYTHONNOUSERSITE="1",
        # Forbidden to keep its bytecode, every process would take seconds more to start; here it is kept apart.
        PYTHONDONTWRITEBYTECODE="",
        AMENT_PREFIX_PATH=_joined(*prefixes, old("AMENT_PREFIX_PATH", "")),
        CMAKE_PREFIX_PATH=_joined(*prefixes, old("CMAKE_PREFIX_PATH", "")),
        LD_LIBRARY_PATH=_joined(*libraries, old("LD_LIBRARY_PATH", "")),
        DT_STATION_ROOT=str(world.root),
        DT_STATION_WORLD=str(world.home),
    )
    inside = {
        "DT_STATION_CONFIG": world.root / "config",
        "NUMBA_CACHE_DIR": world.cache / "numba",
        "PYTHONPYCACHEPREFIX": world.cache / "bytecode",
        "MPLCONFIGDIR": world.cache / "matplotlib",
        "ROS_HOME": world.cache / "ros",
        "ROS_LOG_DIR": world.cache / "ros" / "log",
        "COLCON_HOME": world.cache / "colcon",
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        # The matrices are small: threads of linear algebra's own take time from those that work, and sum otherwise.
        "OPENBLAS_NUM_THREADS": 1,
    }
    kernel = blas_kernel()
    if kernel is not None:
        inside["OPENBLAS_CORETYPE"] = kernel
    for name, value in inside.items():
        env.setdefault(name, str(value))
    return env
