"""From the bridge's parameters to a backend: option texts are read, recorded runs loaded."""

from collections.abc import Mapping
from typing import Any

import yaml

from ..hardware import Backend, open_backend
from .parameters import ParameterError


def backend_from(kind: str, options_text: str, sample_time_s: float) -> Backend:
    """The backend, not yet open. A replay's run is loaded from `file` and `map`. Raises StationError."""
    try:
        options = yaml.safe_load(options_text) or {}
    except yaml.YAMLError as error:
        raise ParameterError(f"backend_options is not YAML: {' '.join(str(error).split())}") from None
    if not isinstance(options, Mapping):
        raise ParameterError("backend_options must be a YAML mapping, such as {rig: paper}")
    if kind == "virtual":
        options = {"rig": "paper", **options}
    return open_backend(kind, {"sample_time_s": sample_time_s, **_loaded(kind, options)})


def _loaded(kind: str, options: Mapping[str, Any]) -> dict[str, Any]:
    if kind != "replay" or "file" not in options:
        return dict(options)
    from ..records import load_run

    rest = {name: value for name, value in options.items() if name not in ("file", "map")}
    return {**rest, "run": load_run(options["file"], options.get("map"))}
