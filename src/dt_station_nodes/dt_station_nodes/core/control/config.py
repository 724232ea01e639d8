"""Configuration of a control loop as a person reads it: a small YAML file, validated and frozen."""

import math
from collections.abc import Mapping
from enum import Enum
from typing import Annotated, Any

import yaml
from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_serializer, field_validator, model_validator

from ..errors import StationError
from ..samples import ControlMode
from .fuzzy_config import FuzzyConfig

Number = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]
Weight = Annotated[float, Field(ge=0.0, le=1.0)]


class ControlError(StationError):
    """A controller file or a controller that cannot run."""


class AntiWindup(str, Enum):
    """What happens to the integral while a limit cuts the voltage.

    NONE: it goes on. BACK_CALCULATION: it is drawn back by the excess over a tracking time.
    CLAMPING: it stands still as long as the error would drive it further into the limit.
    """

    NONE = "none"
    BACK_CALCULATION = "back_calculation"
    CLAMPING = "clamping"


class _Frozen(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class Limits(_Frozen):
    """Bounds of the voltage (V) and of its change (V/s); absent ones do not bind."""

    lower_v: Number | None = None
    upper_v: Number | None = None
    rate_v_per_s: Positive | None = None

    @model_validator(mode="after")
    def _ordered(self) -> "Limits":
        if self.lower_v is not None and self.upper_v is not None and self.lower_v >= self.upper_v:
            raise ValueError(f"lower_v must lie below upper_v, got {self.lower_v} and {self.upper_v}")
        return self


class PiConfig(_Frozen):
    """PI in the paper's difference form (2): y_n = a x_n - b x_(n-1) + y_(n-1), a = Kr, b = Kr - Kr Ts/Ti.

    x is (set-point - measurement) times `error_scale`; gain in V per unit of x.
    """

    gain: Number
    integral_time_s: Positive
    error_scale: Positive
    setpoint_weight: Weight = 1.0
    anti_windup: AntiWindup = AntiWindup.NONE
    tracking_time_s: Positive | None = Field(
        default=None, description="of back-calculation; the integral time if absent"
    )

    def coefficients(self, sample_time_s: float) -> tuple[float, float]:
        """The a and b of the difference form (V per unit of x)."""
        return self.gain, self.gain - self.gain * sample_time_s / self.integral_time_s


class PidConfig(_Frozen):
    """PID in the paper's form (7): P + I Ts/(z-1) + D (1/Ts)(z-1)/z.

    x is (set-point - measurement) times `error_scale`; p in V, i in V/s, d in V s per unit of x.
    `derivative_filter_s` is the time constant of a lag on the derivative; 0 leaves (7) as it is.
    """

    p: Number
    i: Number = 0.0
    d: Number = 0.0
    error_scale: Positive
    derivative_filter_s: NotNegative = 0.0
    setpoint_weight: Weight = 1.0
    derivative_setpoint_weight: Weight = 1.0
    anti_windup: AntiWindup = AntiWindup.NONE
    tracking_time_s: Positive = Field(default=1.0, description="of back-calculation")


class LoopConfig(_Frozen):
    """One loop: who computes the voltage (`mode`), each controller's settings, and the limits."""

    name: str = "unnamed"
    source: str = ""
    mode: ControlMode
    manual_voltage_v: Number = 0.0
    transfer_time_s: Positive = Field(
        default=0.5, description="time constant (s) with which the bump of a change dies out where no integral takes it"
    )
    limits: Limits = Limits()
    pi: PiConfig | None = None
    pid: PidConfig | None = None
    fuzzy: FuzzyConfig | None = None

    @field_validator("mode", mode="before")
    @classmethod
    def _by_name(cls, value: Any) -> Any:
        if isinstance(value, str):
            names = {mode.name.lower(): mode for mode in ControlMode}
            if value.lower() not in names:
                raise ValueError(f"no mode is called {value}; there are {', '.join(names)}")
            return names[value.lower()]
        return value

    @field_serializer("mode", when_used="json")
    def _name(self, mode: ControlMode) -> str:
        return mode.name.lower()

    @model_validator(mode="after")
    def _complete(self) -> "LoopConfig":
        if self.mode is not ControlMode.MANUAL and getattr(self, self.mode.name.lower()) is None:
            name = self.mode.name.lower()
            raise ValueError(f"mode is {name} but there is no section {name}; add one or choose another mode")
        return self

    def modes(self) -> tuple[ControlMode, ...]:
        """Modes this loop can be switched to."""
        return tuple(m for m in ControlMode if m is ControlMode.MANUAL or getattr(self, m.name.lower()) is not None)

    def with_mode(self, mode: ControlMode) -> "LoopConfig":
        """The same loop in another mode; ControlError if it has no settings for it."""
        return self.changed(mode=mode)

    def changed(self, **changes: Any) -> "LoopConfig":
        """The same loop with fields changed and checked as a whole; ControlError in one sentence."""
        data = {name: getattr(self, name) for name in type(self).model_fields}
        try:
            return type(self).model_validate({**data, **changes})
        except ValidationError as error:
            raise ControlError(_sentence(f"controller {self.name}", error)) from None

    @classmethod
    def from_yaml(cls, text: str, source: str = "the controller") -> "LoopConfig":
        """Parse a loop; ControlError names the place that is wrong. `source` is what the sentence calls the file."""
        try:
            data = yaml.safe_load(text)
        except yaml.YAMLError as error:
            mark = getattr(error, "problem_mark", None)
            where = f" at line {mark.line + 1}, column {mark.column + 1}" if mark else ""
            problem = getattr(error, "problem", None) or error
            raise ControlError(f"{source} is not valid YAML{where}: {problem}") from None
        if not isinstance(data, Mapping):
            raise ControlError(f"{source} must be a mapping with a mode, see config/controllers/pressure_pi.yaml")
        try:
            return cls.model_validate(dict(data))
        except ValidationError as error:
            raise ControlError(_sentence(source, error)) from None

    def to_yaml(self) -> str:
        """The loop as text that `from_yaml` reads back to an equal loop."""
        data = self.model_dump(mode="json", exclude_none=True)
        return yaml.safe_dump(data, sort_keys=False, allow_unicode=True, default_flow_style=None, width=110)


def _sentence(source: str, error: ValidationError) -> str:
    first = error.errors()[0]
    place = ".".join(str(part) for part in first["loc"]) or "the top level"
    return f"{source}, {place}: {first['msg'].removeprefix('Value error, ')}"


def check_sample_time(sample_time_s: float) -> None:
    """ControlError unless a controller can run at this sample time."""
    if not (math.isfinite(sample_time_s) and sample_time_s > 0.0):
        raise ControlError(f"the sample time must be a positive number of seconds, not {sample_time_s}")
