"""Identified paths as a model the twin loads, with the intervals beside the numbers."""

from collections.abc import Mapping, Sequence
from typing import Any

from ..core.channels import Channel
from ..core.models import ModelSpec, PathSpec
from .errors import IdentificationError
from .estimate import Interval
from .inverse_dynamics import AxisParameters, FrictionModel
from .static_characteristic import StaticCharacteristic
from .station import DISTURBANCE_PER_PA, IdentifiedPath, Method
from .transfer import TransferFunction


def model_of(paths: Sequence[IdentifiedPath], name: str, source: str, base: ModelSpec | None = None) -> ModelSpec:
    """A model with the identified paths; those of `base` that were not identified stay, effects of replaced ones go.

    Raises IdentificationError where a path is unstable, which the twin could not follow.
    """
    found: dict[Channel, PathSpec] = dict(base.paths) if base is not None else {}
    for path in paths:
        if not path.transfer.stable():
            raise IdentificationError(f"The identified {path.channel.value} path is unstable; ask for fewer poles.")
        found[path.channel] = PathSpec.model_validate(_path(path, found.get(path.channel)))
    return ModelSpec(name=name, source=source, paths=found)


def _path(path: IdentifiedPath, base: PathSpec | None) -> dict[str, Any]:
    effects: list[dict[str, Any]] = []
    if path.transfer.delay_s > 0.0:
        effects.append({"name": "delay", "parameters": {"delay_s": path.transfer.delay_s}})
    if path.bias_v is not None:
        effects.append({"name": "bias", "parameters": {"bias_v": path.bias_v.value}})
    if path.method is Method.DISTURBANCE:
        if base is None or path.disturbance is None:
            raise IdentificationError(
                "A disturbance path needs a position path beside it; name a model that has one, such as --model paper."
            )
        aside = path.disturbance.scaled(path.scale / base.scale)
        changed = {
            "numerator": aside.numerator,
            "denominator": aside.denominator,
            "input_scale": DISTURBANCE_PER_PA,
        }
        return {**base.model_dump(), "disturbance": changed}
    spec: dict[str, Any] = {
        "numerator": path.transfer.numerator,
        "denominator": path.transfer.denominator,
        "scale": path.scale,
        "rest": path.rest,
        "effects": effects,
    }
    if path.disturbance is not None:
        spec["disturbance"] = {
            "numerator": path.disturbance.numerator,
            "denominator": path.disturbance.denominator,
            "input_scale": DISTURBANCE_PER_PA,
        }
    elif base is not None and base.disturbance is not None:
        spec["disturbance"] = base.disturbance.model_dump()
    return spec


def axis_model(axis: AxisParameters, force_per_volt: float, scale: float, name: str, source: str) -> ModelSpec:
    """A frictional axis as a position path: force_per_volt / (M s^2 + Fv s), Coulomb friction and offset as effects."""
    mass = axis.values["mass"].value
    if axis.friction is FrictionModel.ASYMMETRIC:
        viscous = 0.5 * (axis.values["viscous_forward"].value + axis.values["viscous_backward"].value)
    else:
        viscous = axis.values["viscous"].value
    if mass <= 0.0 or viscous < 0.0:
        raise IdentificationError(
            f"The axis came out with mass {mass:.4g} kg and viscous friction {viscous:.4g} N s/m, which no axis has; "
            "check the sign of the voltage and the force per volt."
        )
    transfer = TransferFunction((force_per_volt / mass / scale,), (1.0, viscous / mass, 0.0))
    effects: list[dict[str, Any]] = []
    if "offset" in axis.values:
        effects.append({"name": "bias", "parameters": {"bias_v": -axis.values["offset"].value / force_per_volt}})
    if "coulomb" in axis.values:
        coulomb = max(axis.values["coulomb"].value, 0.0) / force_per_volt
        effects.append({"name": "friction", "parameters": {"coulomb_v": coulomb}})
    path = {"numerator": transfer.numerator, "denominator": transfer.denominator, "scale": scale, "effects": effects}
    return ModelSpec(name=name, source=source, paths={Channel.POSITION: PathSpec.model_validate(path)})


def with_characteristic(spec: ModelSpec, shape: StaticCharacteristic) -> ModelSpec:
    """A model with the effects a slow triangle showed; its linear gain is kept."""
    if shape.channel not in spec.paths:
        raise IdentificationError(f"The model has no {shape.channel.value} path to add the characteristic to.")
    for name in ("bias", "hysteresis", "dead_zone", "saturation"):
        parameters = characteristic_effects(shape).get(name)
        spec = spec.without_effect(shape.channel, name)
        if parameters is not None:
            spec = spec.with_effect(shape.channel, name, parameters)
    return spec


def characteristic_effects(shape: StaticCharacteristic) -> Mapping[str, Mapping[str, float]]:
    """The effects a slow triangle showed, with their parameters."""
    effects: dict[str, dict[str, float]] = {}
    if shape.null_v is not None and not shape.null_v.holds(0.0):
        effects["bias"] = {"bias_v": -shape.null_v.value}
    if shape.hysteresis_half_width_v is not None:
        effects["hysteresis"] = {"half_width_v": shape.hysteresis_half_width_v.value}
        if shape.hysteresis_spread is not None:
            effects["hysteresis"]["spread"] = shape.hysteresis_spread.value
    if shape.dead_zone_half_width_v is not None:
        effects["dead_zone"] = {"half_width_v": shape.dead_zone_half_width_v.value}
    limits = {"upper_v": shape.saturation_upper_v, "lower_v": shape.saturation_lower_v}
    if any(limit is not None for limit in limits.values()):
        # a limit the run never reached stays out of the way
        unreached = {"upper_v": 1e9, "lower_v": -1e9}
        effects["saturation"] = {n: unreached[n] if limit is None else limit.value for n, limit in limits.items()}
    return effects


def commented(spec: ModelSpec, intervals: Mapping[str, Interval]) -> str:
    """The model's YAML, its 95 % intervals as comments above it."""
    lines = [f"#   {name}: {_number(v.value)} [{_number(v.low)}, {_number(v.high)}]" for name, v in intervals.items()]
    head = ["# Identified; value and 95 % interval:", *lines, ""] if lines else []
    return "\n".join(head) + spec.to_yaml()


def _number(value: float) -> str:
    return f"{value:.6g}"
