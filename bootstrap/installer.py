"""Gets the locked packages: with uv, itself locked, because it is several times faster; with pip where uv fails."""

import shutil
import subprocess
import sysconfig
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from . import debian
from .checks import usable_cmake
from .corrections import correct_prefix
from .errors import PreparationError
from .processes import Processes
from .requirements import is_build_tool, is_ros, select
from .world import World

Show = Callable[[str], None]

# pip's settings that uv knows under another name, so that a company's mirror set for pip serves both
MIRRORS = {
    "PIP_INDEX_URL": "UV_DEFAULT_INDEX",
    "PIP_EXTRA_INDEX_URL": "UV_INDEX",
    "PIP_FIND_LINKS": "UV_FIND_LINKS",
    "PIP_CERT": "SSL_CERT_FILE",
}


class Installer:
    """Puts packages of the lock into a world's virtual environment."""

    def __init__(self, world: World, processes: Processes, environment: Mapping[str, str]) -> None:
        self.world = world
        self.processes = processes
        self.env = {name: value for name, value in environment.items() if name not in ("PYTHONPATH", "PYTHONHOME")}
        for pip_name, uv_name in MIRRORS.items():
            if pip_name in self.env:
                self.env.setdefault(uv_name, self.env[pip_name])
        if Path("/etc/ssl/certs/ca-certificates.crt").is_file():
            self.env.setdefault("UV_SYSTEM_CERTS", "1")  # as pip and everything else on the machine
        self.env.setdefault("UV_CACHE_DIR", str(world.state / "cache" / "uv"))
        self.env.setdefault("PIP_CACHE_DIR", str(world.state / "cache" / "pip"))
        self.env.update(
            UV_NO_PROGRESS="1",
            UV_PYTHON_DOWNLOADS="never",
            PIP_DISABLE_PIP_VERSION_CHECK="1",
            PIP_NO_INPUT="1",
            _ROS_WHEELS_BOOTSTRAP_COMPLETE="1",  # no restart of the interpreter by the wheels while they are installed
        )

    def _log(self, stage: str) -> Path:
        return self.world.logs / f"{stage}.log"

    def fetch_uv(self, show: Show) -> None:
        """Install the locked uv below .dt-station/tools; where that fails, pip will do its work."""
        target = self.world.state / "tools"
        shutil.rmtree(target, ignore_errors=True)
        lock = self.world.root / "bootstrap" / "uv.lock"
        try:
            options = ["--quiet", "--require-hashes", "--only-binary=:all:", "--target", str(target), "-r", str(lock)]
            self.processes.run([*self._pip(show), "install", *options], self._log("uv"), self.env, show)
        except PreparationError:
            if self.processes.stopped:
                raise
            shutil.rmtree(target, ignore_errors=True)
            show("no uv here; pip takes its place")

    def _pip(self, show: Show) -> list[str]:
        """Return the command of some pip: the interpreter's own, the one inside ensurepip's wheel, or Debian's."""
        python = str(self.world.python)
        own = subprocess.run([python, "-m", "pip", "--version"], capture_output=True, env=self.env, check=False)
        if own.returncode == 0:
            return [python, "-m", "pip"]
        bundled = Path(sysconfig.get_paths()["stdlib"]) / "ensurepip" / "_bundled"
        wheels = [*bundled.glob("pip-*.whl"), *Path("/usr/share/python-wheels").glob("pip-*.whl")]
        if wheels:
            return [python, f"{wheels[0]}/pip"]
        return [python, f"{debian.fetch_pip(self.world, self.processes, self.env, show)}/pip"]

    def make_venv(self, show: Show) -> None:
        """Make the virtual environment anew."""
        shutil.rmtree(self.world.venv, ignore_errors=True)
        site = ["--system-site-packages"] if self.world.ros else []
        command = [str(self.world.python), "-m", "venv", "--without-pip", *site, str(self.world.venv)]
        self.processes.run(command, self._log("venv"), self.env, show)

    def install_build_tools(self, show: Show) -> None:
        """Install what the message build needs, so that it can begin."""
        self._install("setuptools", lambda name: name == "setuptools", show, ["--no-deps"])
        self._install("tools", is_build_tool, show, ["--no-deps"])
        self._correct(show)

    def install_packages(self, show: Show) -> None:
        """Install everything else of the lock."""
        self._install("packages", lambda _: True, show, [])

    def _wanted(self, name: str) -> bool:
        if self.world.ros is not None and (is_ros(name) or (name.startswith("colcon-") and shutil.which("colcon"))):
            return False
        if name == "cmake":
            return not usable_cmake()
        return name != "ninja" or shutil.which("ninja") is None

    def _install(self, stage: str, wanted: Callable[[str], bool], show: Show, options: Sequence[str]) -> None:
        lock = (self.world.root / "requirements.lock").read_text(encoding="utf-8")
        chosen = self.world.home / f"{stage}.lock"
        chosen.write_text(select(lock, lambda name: wanted(name) and self._wanted(name)), encoding="utf-8")
        common = ["--require-hashes", "--no-build-isolation", *options, "-r", str(chosen)]
        python = str(self.world.venv_python)
        if self.world.uv.is_file():
            try:
                command = [str(self.world.uv), "pip", "install", "--python", python, *common]
                self.processes.run(command, self._log(stage), self.env, show)
                return
            except PreparationError:
                if self.processes.stopped:
                    raise
                show("uv failed; pip tries again")
        try:
            self._install_with_pip(stage, common, show)
        except PreparationError as error:
            if self.processes.stopped:
                raise
            hint = "the packages could not be installed; is the network, or the mirror that pip is set to, reachable?"
            raise PreparationError(f"{error}\n{hint}") from error

    def _install_with_pip(self, stage: str, common: Sequence[str], show: Show) -> None:
        """The same with pip: whatever pip there is fetches the locked one, and that does the rest."""
        lock = (self.world.root / "requirements.lock").read_text(encoding="utf-8")
        only_pip = self.world.home / "pip.lock"
        only_pip.write_text(select(lock, lambda name: name == "pip"), encoding="utf-8")
        target = ["--upgrade", "--target", str(self.world.site_packages)]
        fetch = [*self._pip(show), "install", "--quiet", "--require-hashes", *target, "-r", str(only_pip)]
        self.processes.run(fetch, self._log("pip"), self.env, show)
        python = str(self.world.venv_python)
        self.processes.run([python, "-m", "pip", "install", *common], self._log(stage), self.env, show)

    def _correct(self, show: Show) -> None:
        if self.world.ros is not None:
            return
        numpy = self.world.site_packages / "numpy"
        include = next((str(numpy / core / "include") for core in ("_core", "core") if (numpy / core).is_dir()), "")
        count = correct_prefix(self.world.venv, self.world.python_include(), include)
        show(f"include folders corrected in {count} files")
