"""How foreign columns become a run's signals: a small YAML file."""

from enum import Enum
from pathlib import Path
from typing import Annotated

import yaml
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from ..core.run import SIGNALS
from .errors import RecordError
from .units import FACTORS, factor_to_si

Column = Annotated[str, Field(min_length=1)]


class Frozen(BaseModel):
    """Configuration that does not change and has no unknown keys."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class TableFormat(str, Enum):
    """Kinds of foreign files."""

    CSV = "csv"
    MAT = "mat"


class TimeColumn(Frozen):
    """The column that holds the time of each row."""

    column: Column
    unit: str = "s"

    @model_validator(mode="after")
    def _unit_is_time(self) -> "TimeColumn":
        if self.unit not in FACTORS["s"]:
            raise ValueError(f"time has the wrong unit {self.unit!r}: write one of {', '.join(FACTORS['s'])}")
        return self


class SignalColumn(Frozen):
    """One column: value = (raw * scale + offset) in `unit`, then taken to SI.

    A unit of another kind than the signal's is kept unconverted with `keep_unit`; "1" is an unknown unit.
    """

    column: Column
    unit: str
    scale: float = 1.0
    offset: float = 0.0
    keep_unit: bool = False


class DataMap(Frozen):
    """Columns of a foreign file and the run's signals they are.

    Either `time` names a column or `sample_time_s` states the even grid. `rows` keeps rows start to
    stop (exclusive, from 0). `resample_s`: rows of an uneven clock, or that lack values, are put on a grid of this
    step by straight lines.
    """

    format: TableFormat
    time: TimeColumn | None = None
    sample_time_s: Annotated[float, Field(gt=0)] | None = None
    signals: dict[str, SignalColumn] = Field(min_length=1)
    rows: tuple[Annotated[int, Field(ge=0)], Annotated[int, Field(gt=0)]] | None = None
    resample_s: Annotated[float, Field(gt=0)] | None = None
    source: str = ""

    @model_validator(mode="after")
    def _whole(self) -> "DataMap":
        if (self.time is None) == (self.sample_time_s is None):
            raise ValueError("give either time (a column) or sample_time_s, not both and not neither")
        if self.resample_s is not None and self.time is None:
            raise ValueError("resample_s needs time (a column): rows at a stated sample_time_s are even already")
        for name, signal in self.signals.items():
            if name not in SIGNALS:
                raise ValueError(f"unknown signal {name!r}; a run has {', '.join(SIGNALS)}")
            factor_to_si(name, signal.unit, signal.keep_unit)
        if self.rows is not None and self.rows[0] >= self.rows[1]:
            raise ValueError(f"rows {list(self.rows)} are empty; give [start, stop] with start below stop")
        return self

    @classmethod
    def from_yaml(cls, text: str, name: str = "data map") -> "DataMap":
        """Parse a map; raises RecordError with one sentence that names `name` and the place."""
        try:
            content = yaml.safe_load(text)
        except yaml.YAMLError as error:
            raise RecordError(f"{name}: no valid YAML ({' '.join(str(error).split())})") from None
        if not isinstance(content, dict):
            raise RecordError(f"{name}: a data map needs the keys format, signals, and time or sample_time_s")
        try:
            return cls.model_validate(content)
        except ValidationError as error:
            first = error.errors()[0]
            place = ".".join(str(part) for part in first["loc"])
            message = str(first["msg"]).removeprefix("Value error, ")
            raise RecordError(f"{name}: {place + ': ' if place else ''}{message}") from None


def load_map(path: str | Path) -> DataMap:
    """Read a map from a file."""
    try:
        text = Path(path).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise RecordError(f"{path}: cannot read the data map ({error}); check its path") from None
    return DataMap.from_yaml(text, str(path))
