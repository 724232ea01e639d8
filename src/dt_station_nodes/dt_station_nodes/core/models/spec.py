"""The model as a person reads it: a small YAML file, validated into frozen configuration."""

import math
from collections.abc import Mapping
from enum import Enum
from typing import Annotated, Any

import yaml
from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator, model_validator

from ..channels import Channel
from ..errors import StationError
from .effects import Attachment, registry

Coefficients = Annotated[tuple[float, ...], Field(min_length=1)]


class ModelError(StationError):
    """A model file or a model that cannot be simulated."""


class _Frozen(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class Outlet(str, Enum):
    """Which real pole of a path is the store right behind its output."""

    SLOWEST = "slowest"
    FASTEST = "fastest"


class EffectSpec(_Frozen):
    """One effect of a path: its name in the library, its parameters by name, its place if not the usual one."""

    name: str
    at: Attachment | None = None
    parameters: dict[str, float] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _known(self) -> "EffectSpec":
        effects = registry()
        if self.name not in effects:
            raise ValueError(f"no effect is called {self.name}; there are {', '.join(effects)}")
        effects[self.name].complete(self.parameters)
        allowed = dict.fromkeys(place for channel in Channel for place in effects[self.name].places(channel))
        if self.at is not None and self.at not in allowed:
            raise ValueError(f"effect {self.name} can sit at {' or '.join(a.value for a in allowed)} only")
        bad = [name for name, value in self.parameters.items() if not math.isfinite(value)]
        if bad:
            raise ValueError(f"effect {self.name} needs a finite number for {', '.join(bad)}")
        return self

    @property
    def place(self) -> Attachment:
        """Where it sits: `at`, or the effect's usual place."""
        return self.at or registry()[self.name].attachment


class TransferFunction(_Frozen):
    """A proper continuous transfer function, highest power of s first.

    `gain` multiplies it; `time_scale` stretches its time while integrators keep their gain:
    k / (s (T s + 1)) becomes gain k / (s (time_scale T s + 1)).
    """

    numerator: Coefficients
    denominator: Coefficients
    gain: float = 1.0
    time_scale: float = Field(default=1.0, gt=0.0)

    @field_validator("numerator", "denominator", mode="before")
    @classmethod
    def _numbers(cls, value: Any) -> Any:
        # YAML 1.1 reads 1e6 as a string, and a person writes just that.
        return tuple(float(v) for v in value) if isinstance(value, (list, tuple)) else value

    @model_validator(mode="after")
    def _proper(self) -> "TransferFunction":
        if not all(math.isfinite(v) for v in (*self.numerator, *self.denominator, self.gain, self.time_scale)):
            raise ValueError("coefficients must be finite numbers")
        if self.denominator[0] == 0.0:
            raise ValueError("the denominator's first coefficient must not be 0")
        leading = next((i for i, v in enumerate(self.numerator) if v != 0.0), len(self.numerator))
        if len(self.numerator) - leading > len(self.denominator):
            raise ValueError("the numerator's degree exceeds the denominator's: an improper path cannot be simulated")
        return self


class DisturbanceSpec(TransferFunction):
    """The path by which the load pressure above rest (Pa) disturbs this one; output in this path's `scale`."""

    input_scale: float = 1.0e-6


class PathSpec(TransferFunction):
    """One channel: valve voltage (V) to measured quantity."""

    scale: float = Field(default=1.0, gt=0.0, description="SI units per unit of the transfer function's output")
    rest: float = Field(default=0.0, description="output at zero input, SI")
    outlet: Outlet = Field(default=Outlet.SLOWEST, description="real pole of the store right behind the output")
    disturbance: DisturbanceSpec | None = None
    effects: tuple[EffectSpec, ...] = ()

    @field_validator("scale", "rest", mode="before")
    @classmethod
    def _number(cls, value: Any) -> Any:
        return float(value) if isinstance(value, str) else value

    def effect(self, name: str) -> EffectSpec:
        """The effect of that name. Raises ModelError where the path has none."""
        for effect in self.effects:
            if effect.name == name:
                return effect
        raise ModelError(f"the path has no {name}; it has {', '.join(e.name for e in self.effects) or 'no effects'}")


class ModelSpec(_Frozen):
    """A model of one or both channels."""

    name: str
    source: str = ""
    paths: dict[Channel, PathSpec] = Field(min_length=1)

    @model_validator(mode="after")
    def _fits(self) -> "ModelSpec":
        for channel, path in self.paths.items():
            if path.disturbance is not None and channel is not Channel.POSITION:
                raise ValueError(f"paths.{channel.value}: only the position path has a disturbance")
            for effect in path.effects:
                if channel not in registry()[effect.name].channels:
                    raise ValueError(f"paths.{channel.value}: effect {effect.name} does not act on this channel")
        return self

    @classmethod
    def from_yaml(cls, text: str, source: str = "the model") -> "ModelSpec":
        """Parse a model; ModelError names the place that is wrong. `source` is what the sentence calls the file."""
        try:
            data = yaml.safe_load(text)
        except yaml.YAMLError as error:
            mark = getattr(error, "problem_mark", None)
            where = f" at line {mark.line + 1}, column {mark.column + 1}" if mark else ""
            raise ModelError(f"{source} is not valid YAML{where}: {getattr(error, 'problem', None) or error}") from None
        if not isinstance(data, Mapping):
            raise ModelError(f"{source} must be a mapping with name and paths, see config/models/paper.yaml")
        try:
            return cls.model_validate(dict(data))
        except ValidationError as error:
            first = error.errors()[0]
            place = ".".join(str(part) for part in first["loc"]) or "the top level"
            raise ModelError(f"{source}, {place}: {first['msg'].removeprefix('Value error, ')}") from None

    def to_yaml(self) -> str:
        """The model as text that `from_yaml` reads back to an equal model."""
        data = self.model_dump(mode="json", exclude_none=True)
        return yaml.safe_dump(data, sort_keys=False, allow_unicode=True, default_flow_style=None, width=110)

    def with_path(self, channel: Channel, **changes: Any) -> "ModelSpec":
        """The same model with fields of one path changed."""
        path = self.paths[channel]
        changed = type(path).model_validate({**path.model_dump(), **changes})
        return self.model_copy(update={"paths": {**self.paths, channel: changed}})

    def with_effect(
        self, channel: Channel, name: str, parameters: Mapping[str, float], at: Attachment | None = None
    ) -> "ModelSpec":
        """The same model with an effect on a path; one of the same name is replaced where it stands."""
        new = EffectSpec(name=name, parameters=dict(parameters), at=at)
        old = self.paths[channel].effects
        place = [effect.name for effect in old].index(name) if any(e.name == name for e in old) else len(old)
        return self.with_path(channel, effects=(*old[:place], new, *old[place + 1 :]))

    def without_effect(self, channel: Channel, name: str) -> "ModelSpec":
        """The same model without the effects of that name on a path."""
        return self.with_path(channel, effects=tuple(e for e in self.paths[channel].effects if e.name != name))

    def renamed(self, name: str, source: str | None = None) -> "ModelSpec":
        """The same model under another name."""
        return self.model_copy(update={"name": name, "source": self.source if source is None else source})
