"""A row of the comparison: what the paper prints, what we get, and what to make of it."""

from dataclasses import dataclass
from enum import Enum


class Status(str, Enum):
    """What a row says about the paper's figure."""

    REPRODUCED = "reproduced"
    BETTER = "better"
    WORSE = "worse"
    NOT_COMPARABLE = "not comparable"


@dataclass(frozen=True, slots=True)
class Row:
    """One figure: the paper's (a number, its words, or None where it prints none) beside ours."""

    what: str
    paper: float | str | None
    ours: float | None
    unit: str
    status: Status
    why: str


def near(paper: float, ours: float, relative: float, absolute: float = 0.0) -> bool:
    """Whether ours is the paper's within a tolerance."""
    return abs(ours - paper) <= max(relative * abs(paper), absolute)


def judged_small(paper: float, ours: float, relative: float, absolute: float = 0.0) -> Status:
    """A figure that should be small: reproduced within the tolerance, else better below and worse above."""
    if near(paper, ours, relative, absolute):
        return Status.REPRODUCED
    return Status.BETTER if ours < paper else Status.WORSE


def judged_same(paper: float, ours: float, relative: float, absolute: float = 0.0) -> Status:
    """A figure that is neither good nor bad, only right: outside the tolerance it speaks of another object."""
    return Status.REPRODUCED if near(paper, ours, relative, absolute) else Status.NOT_COMPARABLE


def judged_printed(paper: str, ours: str) -> Status:
    """A coefficient compared digit by digit as printed."""
    return Status.REPRODUCED if paper == ours else Status.WORSE
