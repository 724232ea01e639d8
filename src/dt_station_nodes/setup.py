"""The ament_python package: nodes as executables, launch files and configuration as shared files."""

import os
from collections.abc import Iterable
from pathlib import Path

from setuptools import find_packages, setup

PACKAGE = "dt_station_nodes"
HERE = Path(__file__).resolve().parent
CONFIG = HERE.parents[1] / "config"
NODES = (
    "daq_bridge",
    "load_generator",
    "pressure_controller",
    "position_controller",
    "twin_simulator",
    "shadow_compare",
    "recorder",
    "replayer",
)


def relative(paths: Iterable[Path]) -> list[str]:
    """The paths as colcon wants them: relative to this folder."""
    return sorted(os.path.relpath(path, HERE) for path in paths)


def tree(root: Path, target: str) -> list[tuple[str, list[str]]]:
    """The files below root as data_files entries, folder by folder."""
    folders = [root, *sorted(path for path in root.rglob("*") if path.is_dir())]
    entries = [
        (str(Path(target) / folder.relative_to(root)), relative(path for path in folder.iterdir() if path.is_file()))
        for folder in folders
    ]
    return [(where, files) for where, files in entries if files]


setup(
    name=PACKAGE,
    version="0.1.0",
    packages=find_packages(include=[PACKAGE, f"{PACKAGE}.*"]),
    package_data={PACKAGE: ["**/*.html", "**/*.css", "**/*.js", "**/*.j2", "**/*.yaml", "py.typed"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{PACKAGE}"]),
        (f"share/{PACKAGE}", ["package.xml"]),
        (f"share/{PACKAGE}/launch", relative((HERE / "launch").glob("*.launch.py"))),
        *tree(CONFIG, f"share/{PACKAGE}/config"),
    ],
    install_requires=["setuptools"],
    zip_safe=False,
    maintainer="dt_station maintainers",
    maintainer_email="maintainers@dt-station.org",
    description="Nodes, command line, identification and discovery of the digital-twin station.",
    license="Apache-2.0",
    entry_points={
        "console_scripts": [
            *(f"{node} = {PACKAGE}.nodes.{node}:main" for node in NODES),
            f"dt-station = {PACKAGE}.cli.app:main",
        ],
    },
)
