"""What every verb shares: options, errors, JSON, output folders, configuration files."""

import dataclasses
import json
import math
import shutil
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

from ..core.errors import StationError
from ..nodes.configuration import config_dir, find_config

if TYPE_CHECKING:
    from ..core.models import ModelSpec

__all__ = [
    "Failure",
    "ForceOption",
    "JsonOption",
    "OutOption",
    "UserError",
    "config_dir",
    "console",
    "emit_json",
    "find_config",
    "jsonable",
    "leave",
    "load_model",
    "output_dir",
    "progress",
    "version",
]

console = Console(stderr=True, highlight=False)
"""Everything for people goes here (standard error); standard output is for results."""

JsonOption = Annotated[bool, typer.Option("--json", help="Print one JSON object on standard output, nothing else.")]
OutOption = Annotated[
    Path | None, typer.Option("--out", metavar="DIR", help="Where files go [default: runs/<verb>-<time>/].")
]
ForceOption = Annotated[bool, typer.Option("--force", help="Overwrite what an earlier run left in --out.")]

_MARKER = ".dt-station-output"


class UserError(StationError):
    """Bad input: one sentence that says what to do. Exit status 2."""


class Failure(Exception):  # noqa: N818 - a verb's outcome more than an error
    """The verb understood the input but failed; one sentence. Exit status 1."""


def version() -> str:
    """Version of the installed package, or 'development' in a bare checkout."""
    from importlib import metadata

    for name in ("dt_station_nodes", "dt-station-nodes"):
        try:
            return metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return "development"


def jsonable(value: Any) -> Any:
    """Plain JSON types of nested values; not-a-number and infinity become null."""
    if value is None or isinstance(value, (str, bool)):
        return value.value if isinstance(value, Enum) else value
    if isinstance(value, Enum):
        return jsonable(value.value)
    if isinstance(value, Mapping):
        return {str(jsonable(key)): jsonable(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [jsonable(item) for item in value]
    if isinstance(value, int):
        return int(value)
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    if isinstance(value, Path):
        return str(value)
    if hasattr(value, "model_dump"):
        return jsonable(value.model_dump())
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {field.name: jsonable(getattr(value, field.name)) for field in dataclasses.fields(value)}
    if hasattr(value, "tolist"):
        return jsonable(value.tolist())
    raise TypeError(f"{type(value).__name__} has no JSON form")


def emit_json(value: Any) -> None:
    """Print one JSON object on standard output."""
    sys.stdout.write(json.dumps(jsonable(value), indent=2, allow_nan=False) + "\n")
    sys.stdout.flush()


def output_dir(verb: str, out: Path | None, force: bool) -> Path:
    """Make the folder for a verb's files and return it; call it once the input has been found good.

    A folder that already holds something is refused without `force`; with it, a folder an earlier
    run made is emptied first and any other is written into. Raises UserError.
    """
    folder = out if out is not None else _fresh(verb)
    if folder.exists() and not folder.is_dir():
        raise UserError(f"{folder} is a file; name a folder with --out.")
    if folder.is_dir() and any(folder.iterdir()):
        if not force:
            raise UserError(f"{folder} already holds files; name another folder with --out, or add --force.")
        if (folder / _MARKER).is_file():
            for child in folder.iterdir():
                if child.is_dir() and not child.is_symlink():
                    shutil.rmtree(child)
                else:
                    child.unlink()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / _MARKER).touch()
    except OSError as error:
        raise UserError(f"cannot write to {folder}: {error.strerror}; name another folder with --out.") from None
    return folder


def _fresh(verb: str) -> Path:
    stem = f"{verb}-{time.strftime('%Y%m%d-%H%M%S')}"
    folder, number = Path("runs") / stem, 1
    while folder.exists():
        number += 1
        folder = Path("runs") / f"{stem}-{number}"
    return folder


def load_model(path_or_name: str | Path) -> "tuple[ModelSpec, str]":
    """A model and its text, by path or by name in config/models. Raises StationError."""
    from ..core.models import ModelSpec

    path = find_config("models", path_or_name)
    text = path.read_text(encoding="utf-8")
    try:
        return ModelSpec.from_yaml(text), text
    except StationError as error:
        raise UserError(f"{path}: {error}") from None


@contextmanager
def progress(text: str, total: float | None = None) -> Iterator[Any]:
    """A progress bar on standard error; yields `advance(by=1, text=None)`. Silent where there is no terminal."""
    columns = (SpinnerColumn(), TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task(text, total=total)

        def advance(by: float = 1, text: str | None = None) -> None:
            bar.update(task, advance=by, description=text)

        yield advance


def leave(status: int) -> NoReturn:
    """End the verb with an exit status."""
    raise typer.Exit(status)
