"""The twin's parameters and the configuration they make."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ..core.control import LoopConfig
from ..core.models import ModelSpec
from . import ready
from .loop_parameters import loop_from_values
from .parameters import Parameter

FEEDS = ("setpoints", "commands")
FILES = (
    *ready.TABLE,
    Parameter("model", "paper", "model file, by path or name in config/models", fixed=True),
    Parameter(
        "feed",
        "commands",
        "setpoints: loops of its own; commands: the voltages applied",
        choices=("setpoints", "commands"),
        fixed=True,
    ),
    Parameter("sample_time_s", 0.02, "the bridge's sample time", "s", 1e-4, 60.0, fixed=True),
    Parameter("load_config", "pressure_pi", "its own load controller's file (feed setpoints)", fixed=True),
    Parameter("position_config", "position_pid", "its own position controller's file (feed setpoints)", fixed=True),
    Parameter("alternatives", ["position_fuzzy"], "files of further modes of its position controller", fixed=True),
)
LIVE = (
    Parameter("model_yaml", "", "a model's text, taken over while running; empty: the file's"),
    Parameter("measured_pressure", True, "the measured pressure drives the disturbance path (feed commands)"),
)


@dataclass(frozen=True, slots=True)
class TwinConfig:
    """What is simulated: the model, its text, and its own loops."""

    spec: ModelSpec
    text: str
    measured_pressure: bool
    load: LoopConfig | None
    position: LoopConfig | None


def build(text: str, loops: Mapping[str, LoopConfig], values: Mapping[str, Any]) -> TwinConfig:
    """The configuration of all values; `text` is the model file's. Raises StationError."""
    text = values["model_yaml"] or text
    changed = {prefix: loop_from_values(loop, values, prefix) for prefix, loop in loops.items()}
    return TwinConfig(
        ModelSpec.from_yaml(text), text, values["measured_pressure"], changed.get("load."), changed.get("position.")
    )
