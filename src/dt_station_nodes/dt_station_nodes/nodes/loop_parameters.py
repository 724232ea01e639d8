"""A control loop's configuration as ROS parameters (`mode`, `limits.upper_v`, `pid.p` ...), checked by its own model.

Only the sections the configuration has become parameters; an absent number is NaN.
"""

import math
import types
import typing
from collections.abc import Iterator, Mapping, Sequence
from enum import Enum
from pathlib import Path
from typing import Any

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from ..core.control import LoopConfig
from ..core.errors import StationError
from ..core.samples import ControlMode
from .configuration import find_config
from .parameters import Parameter

_UNIONS = (types.UnionType, typing.Union)
_SECTIONS = ("pi", "pid", "fuzzy")
_TEXTS = {
    "mode": "who computes the voltage",
    "manual_voltage_v": "voltage in manual mode",
    "limits.lower_v": "lowest voltage; nan: none",
    "limits.upper_v": "highest voltage; nan: none",
    "limits.rate_v_per_s": "fastest change of the voltage; nan: none",
}
_UNITS = {"_v": "V", "_s": "s", "_v_per_s": "V/s"}


def load_loop(name: str | Path, alternatives: Sequence[str] = ()) -> LoopConfig:
    """A loop by path or name in config/controllers, with the sections it lacks taken from the alternatives."""
    config = _read(name)
    for other in alternatives:
        extra = _read(other)
        lacking = {
            s: getattr(extra, s) for s in _SECTIONS if getattr(config, s) is None and getattr(extra, s) is not None
        }
        config = config.changed(**lacking)
    return config


def loop_table(config: LoopConfig, prefix: str = "") -> tuple[Parameter, ...]:
    """The parameters of a loop, each name led by `prefix`."""
    return tuple(_parameters(config, "", prefix))


def loop_from_values(config: LoopConfig, values: Mapping[str, Any], prefix: str = "") -> LoopConfig:
    """The loop with the parameters' values. Raises ControlError in one sentence."""
    return config.changed(**_changes(config, "", values, prefix))


def _read(name: str | Path) -> LoopConfig:
    path = find_config("controllers", name)
    return LoopConfig.from_yaml(path.read_text(encoding="utf-8"), str(path))


def _fields(model: BaseModel, inside: str) -> Iterator[tuple[str, str, Any, FieldInfo]]:
    for name, field in type(model).model_fields.items():
        if not inside and name in ("name", "source"):
            continue
        yield name, f"{inside}.{name}" if inside else name, getattr(model, name), field


def _parameters(model: BaseModel, inside: str, prefix: str) -> Iterator[Parameter]:
    for _, path, value, field in _fields(model, inside):
        if isinstance(value, BaseModel):
            yield from _parameters(value, path, prefix)
            continue
        text = field.description or _TEXTS.get(path) or path.replace("_", " ").replace(".", ": ")
        unit = next((u for end, u in sorted(_UNITS.items(), key=lambda e: -len(e[0])) if path.endswith(end)), "")
        if isinstance(value, Enum):
            choices = tuple(mode.name.lower() for mode in _modes(model)) if path == "mode" else _values(type(value))
            yield Parameter(f"{prefix}{path}", _text(value), text, choices=choices)
        elif isinstance(value, (bool, str)):
            yield Parameter(f"{prefix}{path}", value, text)
        elif _is_optional_number(field) and (value is None or isinstance(value, (int, float))):
            yield Parameter(f"{prefix}{path}", math.nan if value is None else float(value), text, unit)
        elif isinstance(value, (int, float)):
            yield Parameter(f"{prefix}{path}", float(value) if isinstance(value, float) else value, text, unit)


def _changes(model: BaseModel, inside: str, values: Mapping[str, Any], prefix: str) -> dict[str, Any]:
    changes: dict[str, Any] = {}
    for name, path, value, _ in _fields(model, inside):
        if isinstance(value, BaseModel):
            changes[name] = {
                **{key: getattr(value, key) for key in type(value).model_fields},
                **_changes(value, path, values, prefix),
            }
        elif f"{prefix}{path}" in values:
            given = values[f"{prefix}{path}"]
            changes[name] = None if isinstance(given, float) and math.isnan(given) else given
    return changes


def _modes(model: BaseModel) -> tuple[ControlMode, ...]:
    if not isinstance(model, LoopConfig):
        raise StationError("only a loop has modes")
    return model.modes()


def _values(kind: type[Enum]) -> tuple[str, ...]:
    return tuple(str(member.value) for member in kind)


def _text(value: Enum) -> str:
    return value.name.lower() if isinstance(value, ControlMode) else str(value.value)


def _is_optional_number(field: FieldInfo) -> bool:
    kinds = typing.get_args(field.annotation) if typing.get_origin(field.annotation) in _UNIONS else ()
    plain = [typing.get_args(kind)[0] if typing.get_args(kind) else kind for kind in kinds]
    return type(None) in kinds and any(kind in (int, float) for kind in plain)
