"""Message definitions: found in the installation, embedded in bags, turned into field lists."""

import os
import re
import sys
from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from .errors import RecordError

SEPARATOR = "=" * 80
PACKAGE = "dt_station_msgs"
_FIELD = re.compile(r"^\s*([a-zA-Z]\w*(?:/\w+){0,2})\s*(?:<=\d+)?\s*(?:\[[^\]]*\])?\s+[a-zA-Z]\w*\s*(?:[^=\s].*)?$")
_PRIMITIVE = re.compile(r"^(bool|byte|char|float(32|64)|u?int(8|16|32|64)|w?string)$")


def share_folders() -> list[Path]:
    """Folders that may hold `<package>/msg/<Type>.msg`, the sourced workspace first."""
    prefixes = [Path(p) for p in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if p]
    checkout = [p / "src" for p in Path(__file__).resolve().parents if (p / "src" / PACKAGE / "msg").is_dir()]
    return [prefix / "share" for prefix in [*prefixes, Path(sys.prefix)]] + checkout


def _message_text(msgtype: str) -> str | None:
    package, _, name = msgtype.split("/")
    for folder in share_folders():
        path = folder / package / "msg" / f"{name}.msg"
        if path.is_file():
            return path.read_text(encoding="utf-8")
    return None


def _nested(msgtype: str, text: str) -> list[str]:
    names = []
    for line in text.splitlines():
        found = _FIELD.match(line.split("#", 1)[0].rstrip())
        if found and not _PRIMITIVE.match(found[1]):
            parts = found[1].split("/")
            package = parts[0] if len(parts) > 1 else msgtype.split("/", maxsplit=1)[0]
            names.append(f"{package}/msg/{parts[-1]}")
    return list(dict.fromkeys(names))


@cache
def installed_definition(msgtype: str) -> str:
    """The concatenated ros2msg definition of an installed type, comments kept.

    Types of the standard packages are known without an installation. Raises RecordError for unknown ones.
    """
    first = _message_text(msgtype)
    if first is None:
        store = get_typestore(Stores.ROS2_JAZZY)
        if msgtype not in store.fielddefs:
            raise RecordError(f"the definition of {msgtype} is not installed; source the workspace it comes from")
        return str(store.generate_msgdef(msgtype, ros_version=2)[0])
    parts, queue, seen = [first], _nested(msgtype, first), {msgtype}
    while queue:
        name = queue.pop(0)
        if name in seen:
            continue
        seen.add(name)
        text = _message_text(name)
        if text is None:
            text = str(get_typestore(Stores.ROS2_JAZZY).generate_msgdef(name, ros_version=2)[0]).split(SEPARATOR)[0]
        short = name.replace("/msg/", "/")
        parts.append(f"{SEPARATOR}\nMSG: {short}\n{text}")
        queue.extend(_nested(name, text))
    return "\n".join(part.rstrip("\n") + "\n" for part in parts)


@cache
def _parsed(msgtype: str, text: str) -> Mapping[str, Any]:
    return get_types_from_msg(text, msgtype)


def typestore(definitions: Mapping[str, str]) -> Typestore:
    """A store of the types in `definitions` (message type -> ros2msg text), and of nothing else.

    Raises RecordError where a text is no message definition.
    """
    store = get_typestore(Stores.EMPTY)
    for msgtype, text in definitions.items():
        try:
            types = _parsed(msgtype, text)
            store.register({name: types[name] for name in types if name not in store.fielddefs})
        except Exception:  # the parser has no common error
            raise RecordError(f"the definition of {msgtype} cannot be understood") from None
    return store


@cache
def type_hash(msgtype: str, text: str) -> str:
    """The RIHS01 hash of a type from its definition; empty where it cannot be computed."""
    try:
        return str(typestore({msgtype: text}).hash_rihs01(msgtype))
    except Exception:  # incomplete definitions of foreign bags
        return ""


def known_definitions(msgtypes: Iterable[str]) -> dict[str, str]:
    """Definitions of those of the types that are installed or standard."""
    found: dict[str, str] = {}
    for msgtype in msgtypes:
        try:
            found[msgtype] = installed_definition(msgtype)
        except RecordError:
            continue
    return found


def fields(store: Typestore, msgtype: str) -> list[tuple[str, Any]]:
    """Name and description of each field, as rosbags describes them. Raises RecordError for an unknown type."""
    try:
        return list(store.fielddefs[msgtype][1])
    except KeyError:
        raise RecordError(f"the definition of {msgtype} is missing; the bag cannot be decoded") from None
