"""Running a node inside a verb, with its parameters handed over in a file: no text is too odd for that."""

import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import yaml


def call_node(main: Callable[[list[str] | None], int], name: str, parameters: Mapping[str, Any]) -> int:
    """Run a node's `main` in this process until it ends; returns its exit status."""
    with tempfile.TemporaryDirectory(prefix="dt-station-") as folder:
        path = Path(folder) / "parameters.yaml"
        values = {key: value for key, value in parameters.items() if value != []}
        path.write_text(yaml.safe_dump({"/**": {"ros__parameters": values}}, allow_unicode=True), encoding="utf-8")
        return main([name, "--ros-args", "--params-file", str(path)])
