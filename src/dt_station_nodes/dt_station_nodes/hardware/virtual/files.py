"""Rig files: YAML, optionally `base: OTHER` with only what differs."""

import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import yaml
from pydantic import ValidationError

from .config import RigConfig
from .parameters import RigError


def load_rig(name: str | Path) -> RigConfig:
    """The rig of a name (`paper`) or in a file; RigError with one sentence that names the file and the place."""
    path = find_rig(name)
    data = _merged(path, ())
    try:
        return RigConfig.model_validate(data)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"]) or "the top level"
        raise RigError(f"{path}, {place}: {str(first['msg']).removeprefix('Value error, ')}") from None


def find_rig(name: str | Path) -> Path:
    """Path of a rig file given as a path, or by its name among the station's rigs."""
    if Path(name).suffix in (".yaml", ".yml") or Path(name).is_file():
        return Path(name)
    known: set[str] = set()
    for folder in _folders():
        if (folder / f"{name}.yaml").is_file():
            return folder / f"{name}.yaml"
        known |= {path.stem for path in folder.glob("*.yaml")}
    raise RigError(
        f"no rig is called {name}; give the path of a rig file or one of {', '.join(sorted(known)) or 'none'}"
    )


def _folders() -> Iterator[Path]:
    if "DT_STATION_CONFIG" in os.environ:
        yield Path(os.environ["DT_STATION_CONFIG"]) / "rigs"
    for parent in Path(__file__).resolve().parents:
        yield parent / "config" / "rigs"
        yield parent / "share" / "dt_station_nodes" / "config" / "rigs"


def _merged(path: Path, above: tuple[Path, ...]) -> dict[str, Any]:
    data = _mapping(path)
    base = data.pop("base", None)
    if base is None:
        return data
    below = path.parent / f"{base}.yaml"
    if below in (*above, path):
        raise RigError(f"{path}: base {base} leads back to this file; name another rig or none")
    return _overlaid(_merged(below, (*above, path)), data)


def _mapping(path: Path) -> dict[str, Any]:
    try:
        data = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise RigError(f"{path}: cannot read the rig ({error}); check its path") from None
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        where = f" at line {mark.line + 1}, column {mark.column + 1}" if mark else ""
        raise RigError(f"{path} is not valid YAML{where}: {getattr(error, 'problem', None) or error}") from None
    if not isinstance(data, Mapping):
        raise RigError(f"{path} must be a mapping of a rig's parts, see config/rigs/paper.yaml")
    return dict(data)


def _overlaid(base: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Changes win; sections are merged key by key; null removes an imperfection."""
    result = dict(base)
    for key, value in changes.items():
        old = result.get(key)
        result[key] = _overlaid(old, value) if isinstance(old, Mapping) and isinstance(value, Mapping) else value
    return result
