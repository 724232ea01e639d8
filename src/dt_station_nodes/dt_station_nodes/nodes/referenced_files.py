"""The configuration files that nodes name in their parameters: a bag keeps them, so that it needs no others."""

from collections.abc import Iterator, Mapping
from typing import Any

import yaml

from ..core.errors import StationError
from .configuration import find_config

_KINDS = {
    "config": "controllers",
    "alternatives": "controllers",
    "load_config": "controllers",
    "position_config": "controllers",
    "model": "models",
    "rig": "rigs",
    "map": "maps",
}


def attachment_name(kind: str, name: str) -> str:
    """Where a bag keeps the file that a parameter of a kind names so: controllers/pressure_pi.yaml."""
    stem = name.replace("\\", "/").rsplit("/", 1)[-1]
    return f"{kind}/{stem if stem.endswith(('.yaml', '.yml')) else stem + '.yaml'}"


def references(parameters: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """(kind, name) of the files named in a node's parameters."""
    for key, value in parameters.items():
        if key == "backend_options" and isinstance(value, str):
            try:
                options = yaml.safe_load(value)
            except yaml.YAMLError:
                continue
            if isinstance(options, dict):
                yield from references(options)
        elif key in _KINDS:
            for name in value if isinstance(value, list) else [value]:
                if isinstance(name, str) and name:
                    yield _KINDS[key], name


def referenced_files(parameters: Mapping[str, Any]) -> dict[str, bytes]:
    """Attachment name -> content of the files that exist."""
    found = {}
    for kind, name in references(parameters):
        try:
            found[attachment_name(kind, name)] = find_config(kind, name).read_bytes()
        except (StationError, OSError):
            continue
    return found
