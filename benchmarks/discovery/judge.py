"""Hold what discovery said against the truth, by the aims of the project."""

import json
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from enum import Enum
from typing import Any

import numpy as np

Pair = tuple[str, str]  # name, channel


class Outcome(str, Enum):
    """What became of a case."""

    EXACT = "exact"  # the right names and channels and nothing else
    IN_SET = "in set"  # the right name is among a reported set of indistinguishable ones
    PARTLY = "partly"  # one of several right, none wrong
    EXTRA = "extra"  # right, with a further wrong name
    WRONG = "wrong"  # named, and not right
    ABSTAINED = "abstained"  # an effect there, none named
    SILENT = "silent"  # rightly no name


@dataclass(frozen=True, slots=True)
class Judged:
    """One case with its outcome; `ratio` is the mean square gap on an unseen waveform over the noise's."""

    number: str
    kind: str
    truth: tuple[Pair, ...]
    found: tuple[Pair, ...]
    alternatives: tuple[str, ...]
    verdict: str
    outcome: Outcome
    confidence: float
    seconds: float
    family: str = ""
    severity: int = -1
    shape: str = ""
    noise_db: float | None = None
    visibility: float = 0.0
    ratio: float | None = None
    separated: bool | None = None
    error: str = ""

    def to_json(self) -> dict[str, Any]:
        """Plain values."""
        return {**asdict(self), "outcome": self.outcome.value}

    @classmethod
    def from_json(cls, text: str) -> "Judged":
        """A case from its JSON text."""
        data = json.loads(text)
        pairs = {name: tuple((n, c) for n, c in data[name]) for name in ("truth", "found")}
        more = {"alternatives": tuple(data["alternatives"]), "outcome": Outcome(data["outcome"])}
        return cls(**{**data, **pairs, **more})


def outcome_of(truth: Iterable[Pair], said: Mapping[str, Any], library: bool) -> Outcome:
    """The outcome for the true effects (none for a null); outside the library every name is wrong."""
    wanted = set(truth) if library else set()
    named = said["verdict"] == "named"
    if not named:
        return Outcome.ABSTAINED if wanted else Outcome.SILENT
    found = [(e["name"], e["channel"], set(e["alternatives"])) for e in said["effects"]]
    exact = {(n, c) for n, c, _ in found}
    if wanted and exact == wanted:
        return Outcome.EXACT
    covered = {w for w in wanted if any(c == w[1] and w[0] in {n, *alt} for n, c, alt in found)}
    false = [1 for n, c, alt in found if not any(c == w[1] and w[0] in {n, *alt} for w in wanted)]
    if not covered:
        return Outcome.WRONG
    if false:
        return Outcome.EXTRA
    return Outcome.IN_SET if covered == wanted else Outcome.PARTLY


def share(cases: Iterable[Judged], *good: Outcome) -> tuple[int, int]:
    """How many of the cases ended well."""
    listed = list(cases)
    return sum(case.outcome in good for case in listed), len(listed)


def _called(cases: Iterable[Judged], verdict: str) -> tuple[int, int]:
    listed = list(cases)
    return sum(case.verdict == verdict for case in listed), len(listed)


@dataclass(frozen=True, slots=True)
class Figure:
    """One aim: what was asked and what came out; `value` in % or as a ratio, None where nothing was measured."""

    what: str
    aim: str
    value: float | None
    count: int
    met: bool | None


def _percent(what: str, counts: tuple[int, int], aim: float, at_most: bool = False) -> Figure:
    good, n = counts
    value = 100.0 * good / n if n else None
    met = None if value is None else (value <= aim if at_most else value >= aim)
    return Figure(what, f"{'at most' if at_most else 'at least'} {aim:g} %", value, n, met)


def figures(cases: Iterable[Judged]) -> list[Figure]:
    """The project's aims on these cases."""
    listed = list(cases)
    single = [c for c in listed if c.kind == "single"]
    at40 = [c for c in single if c.noise_db == 40.0]
    inside = (Outcome.EXACT, Outcome.IN_SET)
    nulls = [c for c in listed if c.kind == "null"]
    mismatched = [c for c in listed if c.kind == "mismatch"]
    outside = [c for c in listed if c.kind == "outside"]
    pairs = [c for c in listed if c.kind == "pair"]
    ratios = [c.ratio for c in at40 if c.ratio is not None]
    used = [c for c in listed if c.separated is not None]
    median = float(np.median(ratios)) if ratios else None
    return [
        _percent("single effects at 40 dB, exact name and channel", share(at40, Outcome.EXACT), 95),
        _percent("the same, in the reported set", share(at40, *inside), 98),
        _percent("the same, confidently wrong", share(at40, Outcome.WRONG, Outcome.EXTRA), 2, at_most=True),
        _percent(
            "single effects without noise, exact", share((c for c in single if c.noise_db is None), Outcome.EXACT), 95
        ),
        _percent("single effects at 30 dB, exact", share((c for c in single if c.noise_db == 30.0), Outcome.EXACT), 90),
        _percent(
            "gains 2 % and time constants 4 % off, exact",
            share((c for c in listed if c.kind == "single_mismatch"), Outcome.EXACT),
            90,
        ),
        _percent("both of two effects", share(pairs, Outcome.EXACT, Outcome.IN_SET), 80),
        _percent("false names on nulls", share(nulls, Outcome.WRONG), 1, at_most=True),
        _percent("nulls called nothing_missing", _called(nulls, "nothing_missing"), 95),
        _percent("false names on mere mismatches", share(mismatched, Outcome.WRONG), 1, at_most=True),
        _percent("mere mismatches called parameters_only", _called(mismatched, "parameters_only"), 95),
        _percent("effects outside the library not named wrongly", share(outside, Outcome.SILENT), 90),
        Figure(
            "gap on an unseen waveform over the noise floor, median at 40 dB",
            "at most 1.3",
            median,
            len(ratios),
            None if median is None else median <= 1.3,
        ),
        _percent("next experiment separates", (sum(bool(c.separated) for c in used), len(used)), 80),
    ]
