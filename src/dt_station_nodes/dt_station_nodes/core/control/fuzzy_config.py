"""Configuration of the fuzzy controller: memberships and rules as a person writes and reads them."""

from collections.abc import Mapping
from itertools import pairwise
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, model_validator

Number = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]
Corners = Annotated[tuple[Number, ...], Field(min_length=3, max_length=4)]


class _Frozen(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class FuzzyVariable(_Frozen):
    """A linguistic variable: its range and its terms, each a triangle (3 corners) or a trapezoid (4)."""

    unit: str
    range: tuple[Number, Number]
    terms: dict[str, Corners] = Field(min_length=1)

    @model_validator(mode="after")
    def _readable(self) -> "FuzzyVariable":
        low, high = self.range
        if low >= high:
            raise ValueError(f"range must go up, got {low} to {high}")
        for name, corners in self.terms.items():
            if any(b < a for a, b in pairwise(corners)) or corners[0] == corners[-1]:
                raise ValueError(f"term {name} needs corners in rising order, got {list(corners)}")
        return self

    def uncovered(self) -> float | None:
        """The first corner or middle between corners within the range that belongs to no term, if any."""
        low, high = self.range
        inside = {c for corners in self.terms.values() for c in corners if low < c < high}
        points = sorted({low, high} | inside)
        for x in (*points, *((a + b) / 2.0 for a, b in pairwise(points))):
            if not any(belongs(x, corners) for corners in self.terms.values()):
                return x
        return None


def belongs(x: float, corners: Corners) -> bool:
    """Whether x has a membership above 0."""
    left, first, second, right = trapezoid(corners)
    return left < x < right or first <= x <= second


def trapezoid(corners: Corners) -> tuple[float, float, float, float]:
    """The four corners of a triangle or a trapezoid."""
    return (corners[0], corners[1], corners[-2], corners[-1])


class FuzzyConfig(_Frozen):
    """Mamdani controller of two inputs: error (set-point minus measurement) and load pressure.

    `error_scale` turns the error (m or Pa) into the unit of `error`, `load_scale` Pa into that of `load`.
    The gains stretch what enters and leaves the rules (they are what tuning turns); `error_lead_s` adds the
    error's rate times that time to it; `integral_gain` (V/s per unit of error) adds an integrating term, which
    only integrates while the error is within `integral_band` (its unit), if given: a long move must not wind it up.
    `rules` says for each error term and each load term which voltage term follows.
    """

    error_scale: Positive
    load_scale: Positive = 1.0e-6
    error_gain: Positive = 1.0
    load_gain: Positive = 1.0
    output_gain: Positive = 1.0
    error_lead_s: NotNegative = 0.0
    integral_gain: NotNegative = 0.0
    integral_band: Positive | None = None
    tracking_time_s: Positive = Field(default=1.0, description="of the integrating term's back-calculation")
    error: FuzzyVariable
    load: FuzzyVariable
    voltage: FuzzyVariable
    rules: dict[str, dict[str, str]]
    grid: tuple[Annotated[int, Field(ge=2, le=2001)], Annotated[int, Field(ge=2, le=501)]] = Field(
        default=(241, 41), description="points of the precomputed surface along error and load"
    )

    @model_validator(mode="after")
    def _complete(self) -> "FuzzyConfig":
        for name in ("error", "load"):
            hole = getattr(self, name).uncovered()
            if hole is not None:
                raise ValueError(f"no term of {name} covers {hole:g}; widen one")
        _same("error", self.rules, self.error.terms, "rules")
        for term, row in self.rules.items():
            _same("load", row, self.load.terms, f"rules.{term}")
            unknown = sorted(set(row.values()) - set(self.voltage.terms))
            if unknown:
                known = ", ".join(self.voltage.terms)
                raise ValueError(f"rules.{term} names the voltage {unknown[0]}; there are {known}")
        return self

    def rule_list(self) -> list[tuple[str, str, str]]:
        """The rules as (error term, load term, voltage term), in the order of the terms."""
        return [(e, p, self.rules[e][p]) for e in self.error.terms for p in self.load.terms]


def _same(variable: str, given: Mapping[str, object], terms: Mapping[str, object], place: str) -> None:
    missing, unknown = [t for t in terms if t not in given], [t for t in given if t not in terms]
    if missing:
        raise ValueError(f"{place} lacks the {variable} term {missing[0]}")
    if unknown:
        raise ValueError(f"{place} has the {variable} term {unknown[0]}; there are {', '.join(terms)}")
