"""Figures that others published for a set of data, kept in config/published under the name of its map."""

from typing import Literal

import yaml
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from ..core.channels import Channel
from .common import UserError, config_dir

_NEAR = 0.1


class Figure(BaseModel):
    """One published figure: a span in the channel's unit (rms) or percent; `rows` it was taken over (all if None)."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    channel: Channel
    figure: Literal["rms", "fit_percent"]
    low: float
    high: float
    what: str
    source: str = ""
    rows: tuple[int, int] | None = None

    def judged(self, ours: float) -> str:
        """How ours stands to it: better, like it (within the span and a tenth), or worse."""
        reach = _NEAR * max(abs(self.low), abs(self.high))
        if self.low - reach <= ours <= self.high + reach:
            return "like it"
        return "better" if (ours < self.low) == (self.figure == "rms") else "worse"


class _File(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")

    source: str = ""
    rows: tuple[int, int] | None = None
    figures: tuple[Figure, ...] = Field(min_length=1)


def figures_for(name: str) -> tuple[Figure, ...]:
    """Published figures for the data of a map; none where no file has its name. Raises UserError."""
    path = config_dir() / "published" / f"{name}.yaml"
    if not path.is_file():
        return ()
    try:
        held = _File.model_validate(yaml.safe_load(path.read_text(encoding="utf-8")))
    except yaml.YAMLError as error:
        raise UserError(f"{path} is not valid YAML: {error}") from None
    except ValidationError as error:
        first = error.errors()[0]
        raise UserError(f"{path}: {'.'.join(str(part) for part in first['loc'])}: {first['msg']}") from None
    return tuple(f.model_copy(update={"source": held.source, "rows": f.rows or held.rows}) for f in held.figures)
