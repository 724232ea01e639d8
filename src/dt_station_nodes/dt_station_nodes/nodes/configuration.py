"""Where configuration values lie, and finding one by name."""

import os
from pathlib import Path

from ..core.errors import StationError


class ConfigurationError(StationError):
    """A configuration file or folder that is not there."""


def config_dir() -> Path:
    """The folder of configuration values: $DT_STATION_CONFIG, the installed share, or the checkout's."""
    named = os.environ.get("DT_STATION_CONFIG")
    if named:
        folder = Path(named)
        if not folder.is_dir():
            raise ConfigurationError(f"DT_STATION_CONFIG names {named}, which is not a folder.")
        return folder
    for parent in Path(__file__).resolve().parents:
        if (parent / "config" / "models").is_dir():
            return parent / "config"
    try:
        from ament_index_python.packages import get_package_share_directory

        installed = Path(get_package_share_directory("dt_station_nodes")) / "config"
        if installed.is_dir():
            return installed
    except (ImportError, LookupError):
        pass
    raise ConfigurationError("no configuration folder found; set DT_STATION_CONFIG to the checkout's config folder.")


def find_config(kind: str, name: str | Path) -> Path:
    """A configuration file by path, or by name among config/<kind>/*.yaml. Raises ConfigurationError."""
    path = Path(name)
    if path.is_file():
        return path
    folder = config_dir() / kind
    inside = folder / (path.name if path.suffix in (".yaml", ".yml") else f"{path.name}.yaml")
    if path.parent == Path(".") and inside.is_file():
        return inside
    known = ", ".join(sorted(file.stem for file in folder.glob("*.yaml"))) or "none"
    raise ConfigurationError(f"there is no file {name} and no {name} in {folder} (there: {known}).")
