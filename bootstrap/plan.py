"""The stages that make one world, and the keys that tell when each must be redone."""

import shutil
import sys
from collections.abc import Mapping
from functools import partial
from pathlib import Path

from . import debian
from .errors import PreparationError
from .installer import Installer, Show
from .processes import Processes
from .stages import Stage, digest, files_digest
from .world import World, variables

WARM_MODULE = "dt_station_nodes.cli.warm"
COMPILED = ("core/models", "hardware/virtual", "identification/propagation.py", "identification/static_shape.py")


class Workspace:
    """Builds the two packages with colcon and fills the compile caches."""

    def __init__(self, world: World, processes: Processes, environment: Mapping[str, str]) -> None:
        self.world = world
        self.processes = processes
        self.environment = environment

    def _env(self) -> dict[str, str]:
        return variables(self.world, self.environment)

    def build_messages(self, show: Show) -> None:
        """Generate and compile dt_station_msgs from nothing: half-written output of a stopped build is never used."""
        shutil.rmtree(self.world.install, ignore_errors=True)
        shutil.rmtree(self.world.build, ignore_errors=True)
        self._colcon("dt_station_msgs", show)

    def build_nodes(self, show: Show) -> None:
        """Install dt_station_nodes by links, so that edits count without building again."""
        self._colcon("dt_station_nodes", show)
        self._write_setup()

    def warm(self, show: Show) -> None:
        """Compile the numba kernels into their cache, anew: it does not see that what a kernel calls has changed."""
        shutil.rmtree(self.world.cache / "numba", ignore_errors=True)
        command = [str(self.world.venv_python), "-m", WARM_MODULE]
        self.processes.run(command, self.world.logs / "warm.log", self._env(), show)

    def _colcon(self, package: str, show: Show) -> None:
        env = self._env()
        own = self.world.venv / "bin" / "colcon"
        colcon = own if own.is_file() else shutil.which("colcon")
        if colcon is None:
            raise PreparationError("colcon is missing; install with: sudo apt install python3-colcon-common-extensions")
        if not self.world.machine_has_headers():  # Debian keeps pyconfig.h in a folder beside
            for name in ("CFLAGS", "CXXFLAGS"):
                env[name] = f"{env.get(name, '')} -idirafter {self.world.own_headers / 'usr' / 'include'}"
        generator = ["-G", "Ninja"] if shutil.which("ninja", path=env["PATH"]) else []
        world = self.world
        command = [
            *(str(colcon), "--log-base", str(world.logs / "colcon"), "build", "--merge-install", "--symlink-install"),
            *("--base-paths", str(world.root / "src"), "--packages-select", package),
            *("--build-base", str(world.build), "--install-base", str(world.install)),
            *("--event-handlers", "console_direct+", "console_start_end-"),
            *("--cmake-args", "-DCMAKE_BUILD_TYPE=Release", "-DBUILD_TESTING=OFF", *generator),
            *(f"-DPython3_EXECUTABLE={world.venv_python}", "-DPython3_FIND_VIRTUALENV=ONLY"),
            *(f"-DPython3_INCLUDE_DIR={world.python_include()}", "--no-warn-unused-cli"),
        ]
        self.processes.run(command, self.world.logs / f"{package}.log", env, show, cwd=self.world.home)

    def _write_setup(self) -> None:
        """Leave a file that a shell can source to work in this world: colcon, ros2, python."""
        env = self._env()
        names = sorted(name for name in env if env[name] != self.environment.get(name))
        searched = {"PATH", "PYTHONPATH", "AMENT_PREFIX_PATH", "CMAKE_PREFIX_PATH", "LD_LIBRARY_PATH"}
        lines = ["# Source this to work inside the station's environment."]
        for name in names:
            value = env[name]
            old = self.environment.get(name, "")
            if name in searched and old and value.endswith(old):
                lines.append(f'export {name}="{value[: -len(old)]}${name}"')
            else:
                lines.append(f'export {name}="{value}"')
        target = self.world.setup_file
        target.write_text("\n".join(lines) + "\n", encoding="utf-8")


def plan(world: World, processes: Processes, environment: Mapping[str, str]) -> list[Stage]:
    """Return all stages of a world, in an order in which each comes after what it needs."""
    installer = Installer(world, processes, environment)
    workspace = Workspace(world, processes, environment)
    source = world.root / "src"
    nodes = source / "dt_station_nodes"
    base = digest(str(world.root), str(world.python), sys.version, *map(str, world.ros_prefixes))
    uv = digest((world.root / "bootstrap" / "uv.lock").read_bytes(), str(world.state))
    packages = digest(base, (world.root / "requirements.lock").read_bytes())
    messages = digest(packages, files_digest(source, _files(source / "dt_station_msgs")))
    manifest = [nodes / name for name in ("setup.py", "setup.cfg", "package.xml")]
    shared = [path for folder in (nodes / "launch", world.root / "config") for path in _files(folder)]
    layout = digest(messages, files_digest(nodes, manifest), *sorted(map(str, shared)))
    compiled = [nodes / "dt_station_nodes" / name for name in COMPILED]
    kernels = files_digest(nodes, [path for root in compiled for path in _files(root) if path.suffix == ".py"])
    headers_stages = []
    if not world.machine_has_headers():
        action = partial(debian.fetch_headers, world, processes, environment)
        headers_stages.append(Stage("headers", "fetch Python's headers", base, action))
    return [
        *headers_stages,
        Stage("uv", "fetch the installer", uv, installer.fetch_uv),
        Stage("venv", "make the virtual environment", base, installer.make_venv),
        Stage("tools", "install the build tools", packages, installer.install_build_tools, ("uv", "venv", "headers")),
        Stage("packages", "install the packages", packages, installer.install_packages, ("tools",)),
        Stage("messages", "build the messages", messages, workspace.build_messages, ("tools",)),
        Stage("nodes", "link the nodes", layout, workspace.build_nodes, ("messages",)),
        Stage("warm", "compile the models", digest(packages, kernels), workspace.warm, ("packages",)),
    ]


def _files(folder: Path) -> list[Path]:
    found = folder.rglob("*") if folder.is_dir() else (folder,)
    return [path for path in found if path.is_file() and "__pycache__" not in path.parts]
