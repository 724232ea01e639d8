"""The library of effects: one file each, foreign ones by the entry point group `dt_station.effects`."""

from collections.abc import Mapping
from functools import cache
from importlib import import_module
from importlib.metadata import entry_points
from types import MappingProxyType

from ...errors import StationError
from .effect import Attachment, Effect, Parameter, Quantity

__all__ = ["ENTRY_POINT_GROUP", "NAMES", "Attachment", "Effect", "EffectError", "Parameter", "Quantity", "registry"]

ENTRY_POINT_GROUP = "dt_station.effects"
NAMES = (
    "asymmetric_gain",
    "backlash",
    "bias",
    "cross_coupling",
    "cubic_stiffness",
    "dead_zone",
    "delay",
    "extra_lag",
    "fatigue",
    "friction",
    "gain_drift",
    "hysteresis",
    "leakage",
    "load_dependent_gain",
    "memory",
    "overflow",
    "periodic_disturbance",
    "quadratic_damping",
    "rate_limit",
    "resonance",
    "saturation",
    "square_root_outflow",
    "stroke_dependent_gain",
    "thixotropy",
    "trapped_air",
)


class EffectError(StationError):
    """An effect from outside does not fit the library."""


@cache
def registry() -> Mapping[str, Effect]:
    """All effects by name, ours first, then foreign ones sorted by name; EffectError if one does not fit."""
    found: dict[str, Effect] = {name: import_module(f".{name}", __name__).EFFECT for name in NAMES}
    for point in sorted(entry_points(group=ENTRY_POINT_GROUP), key=lambda p: p.name):
        effect = point.load()
        if not isinstance(effect, Effect) or effect.name in found:
            raise EffectError(
                f"entry point {point.name} = {point.value} must be an Effect with a new name; uninstall its package"
            )
        found[effect.name] = effect
    return MappingProxyType(found)
