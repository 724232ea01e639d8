"""How long a bare machine takes to a working station, beside the plain way: venv, pip, colcon, one after the other.

    ./dt-station doctor && python3 benchmarks/preparation.py        # needs git; works in a temporary folder

Both download everything anew; the plain way installs the same lock with the same hashes and builds the same packages.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from bootstrap.corrections import correct_prefix  # noqa: E402
from bootstrap.plan import Workspace  # noqa: E402
from bootstrap.processes import Processes  # noqa: E402
from bootstrap.world import World, current_world  # noqa: E402


def bare_environment(home: Path) -> dict[str, str]:
    """The caller's environment without any trace of a station or of a cache."""
    kept = (
        "PATH",
        "LANG",
        "SSL_CERT_FILE",
        "PIP_CERT",
        "PIP_INDEX_URL",
        "PIP_EXTRA_INDEX_URL",
        "http_proxy",
        "https_proxy",
    )
    return {**{name: os.environ[name] for name in kept if name in os.environ}, "HOME": str(home), "TERM": "dumb"}


def ours(checkout: Path, env: dict[str, str]) -> float:
    """Seconds from a clone to a running command line."""
    start = time.monotonic()
    subprocess.run([checkout / "dt-station", "--version"], env=env, check=True, stdout=sys.stderr)
    return time.monotonic() - start


def plain(checkout: Path, env: dict[str, str]) -> dict[str, float]:
    """Seconds of each step of the plain way, in a world of its own below the same checkout."""
    here = current_world(checkout, {})
    world = World(checkout / "plain", here.python, here.version)
    (checkout / "plain").mkdir()
    (checkout / "plain" / "src").symlink_to(checkout / "src")
    python = str(world.venv_python)
    lock = str(checkout / "requirements.lock")
    env = {**env, "_ROS_WHEELS_BOOTSTRAP_COMPLETE": "1"}
    pip = [python, "-m", "pip", "install", "--quiet", "--no-cache-dir"]
    seconds = {}

    def step(name, *command):
        start = time.monotonic()
        subprocess.run(command, env=env, check=True, stdout=sys.stderr)
        seconds[name] = time.monotonic() - start

    step("venv", str(world.python), "-m", "venv", str(world.venv))
    setuptools = next(line for line in Path(lock).read_text().splitlines() if line.startswith("setuptools=="))
    step("setuptools", *pip, setuptools.split()[0])
    step("pip", *pip, "--no-build-isolation", "--require-hashes", "-r", lock)
    correct_prefix(world.venv, world.python_include(), str(world.site_packages / "numpy" / "_core" / "include"))
    workspace = Workspace(world, Processes(), env)
    start = time.monotonic()
    workspace.build_messages(lambda line: None)
    workspace.build_nodes(lambda line: None)
    seconds["colcon"] = time.monotonic() - start
    start = time.monotonic()
    workspace.warm(lambda line: None)
    seconds["compile"] = time.monotonic() - start
    return seconds


def main() -> None:
    """Measure both in one run and print their ratio."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="one JSON object on standard output")
    options = parser.parse_args()
    folder = Path(tempfile.mkdtemp(prefix="dt-station-preparation-"))
    try:
        checkout = folder / "checkout"
        subprocess.run(["git", "clone", "--quiet", ROOT, checkout], check=True)
        env = bare_environment(folder / "home")
        first = ours(checkout, env)
        again = ours(checkout, env)
        steps = plain(checkout, env)
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    total = sum(steps.values())
    ratio = total / first
    result = {"ours_s": first, "second_start_s": again, "plain_s": total, "plain_steps_s": steps, "ratio": ratio}
    if options.json:
        print(json.dumps(result, indent=2))
        return
    print(f"dt-station      {first:6.1f} s   (second start {again:.2f} s)")
    print(f"pip and colcon  {total:6.1f} s   ({', '.join(f'{name} {value:.1f}' for name, value in steps.items())})")
    print(f"ratio           {ratio:6.2f}")


if __name__ == "__main__":
    main()
