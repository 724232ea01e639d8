"""The configuration of a recorded run, taken from the bag itself: controllers, models, files."""

import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ..core.control import LoopConfig
from ..records import Bag, RecordError
from ..records.history import histories
from .loop_parameters import load_loop
from .referenced_files import attachment_name, references


def announced_models(bag: Bag) -> list[tuple[int, str]]:
    """(stamp of the last sample before it, text) of every model the twin announced, in order."""
    topic = bag.find("twin/model")
    if topic is None:
        return []
    found = []
    for message in bag.messages([topic]):
        model: Any = bag.deserialize(message)
        found.append((model.header.stamp.sec * 1_000_000_000 + model.header.stamp.nanosec, model.yaml))
    return found


@contextmanager
def unpacked(bag: Bag) -> Iterator[Path]:
    """The configuration files of a bag as files again."""
    with tempfile.TemporaryDirectory(prefix="dt-station-") as name:
        folder = Path(name)
        for attachment, data in bag.attachments().items():
            path = (folder / attachment).resolve()
            if path.is_relative_to(folder.resolve()):
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(data)
        yield folder


def _file(values: Mapping[str, Any], kind: str, name: str, files: Path) -> Path:
    path = files / attachment_name(kind, name)
    if not path.is_file():
        raise RecordError(f"the bag does not hold {attachment_name(kind, name)}, which its nodes used")
    return path


def recorded_loop(values: Mapping[str, Any], key: str, alternatives: list[str], files: Path) -> LoopConfig:
    """The controller that a node's parameter names, with the modes of the alternatives."""
    paths = [_file(values, "controllers", name, files) for name in (values[key], *alternatives)]
    return load_loop(paths[0], [str(path) for path in paths[1:]])


def recorded_model(values: Mapping[str, Any], key: str, kind: str, files: Path) -> str:
    """The text of the model that a node's parameter names."""
    return _file(values, kind, values[key], files).read_text(encoding="utf-8")


def differing_files(bag: Bag, installed: Callable[[str, str], bytes | None]) -> list[str]:
    """Files of the bag whose installed namesakes differ; `installed` reads a file by kind and name."""
    own = bag.attachments()
    found = []
    for history in histories(bag).values():
        for kind, name in references(history.initial):
            attached = attachment_name(kind, name)
            if attached in own and attached not in found:
                now = installed(kind, name)
                if now is not None and now != own[attached]:
                    found.append(attached)
    return found
