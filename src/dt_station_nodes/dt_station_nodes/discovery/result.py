"""What discovery says: frozen values and their JSON form."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..core.channels import Channel
from ..core.models import ModelSpec

Array = NDArray[np.float64]


class Verdict(str, Enum):
    """The four answers."""

    NAMED = "named"
    PARAMETERS_ONLY = "parameters_only"
    NOTHING_MISSING = "nothing_missing"
    UNEXPLAINED = "unexplained"


@dataclass(frozen=True, slots=True)
class Estimate:
    """One fitted parameter with its 95 % interval."""

    value: float
    low: float
    high: float
    unit: str

    def to_json(self) -> dict[str, Any]:
        """As in `discovery.json`."""
        return {"value": self.value, "ci95": [self.low, self.high], "unit": self.unit}


@dataclass(frozen=True, slots=True)
class NamedEffect:
    """One effect found. `alternatives` are names the data cannot tell from it."""

    name: str
    channel: Channel
    confidence: float
    parameters: Mapping[str, Estimate]
    alternatives: tuple[str, ...] = ()
    why: str = ""
    check: str = ""

    def to_json(self) -> dict[str, Any]:
        """As in `discovery.json`."""
        return {
            "name": self.name,
            "channel": self.channel.value,
            "confidence": self.confidence,
            "parameters": {name: estimate.to_json() for name, estimate in self.parameters.items()},
            "alternatives": list(self.alternatives),
            "why": self.why,
        }


@dataclass(frozen=True, slots=True)
class GapShare:
    """How much of a channel's gap (null-refitted model) falls under one operating condition."""

    channel: Channel
    condition: str
    share_of_gap: float
    share_of_time: float = 0.0

    def to_json(self) -> dict[str, Any]:
        """As in `discovery.json`."""
        return {"channel": self.channel.value, "condition": self.condition, "share_of_gap": self.share_of_gap}


@dataclass(frozen=True, slots=True)
class GapFigures:
    """Size of the gap: integral of its square (unit^2 s), root mean square (unit), fit (%)."""

    ise: float
    rms: float
    fit_percent: float

    def to_json(self) -> dict[str, float]:
        """As in `discovery.json`."""
        return {"ise": self.ise, "rms": self.rms, "fit_percent": self.fit_percent}


Figures = Mapping[Channel, GapFigures]


@dataclass(frozen=True, slots=True)
class Gap:
    """Gaps before and after, on the run and on the validation run, beside the noise floor."""

    before: Figures
    after: Figures
    noise_floor: Figures
    validation_before: Figures = field(default_factory=dict)
    validation_after: Figures = field(default_factory=dict)

    def to_json(self) -> dict[str, Any]:
        """As in `discovery.json`."""

        def table(figures: Figures) -> dict[str, Any]:
            return {channel.value: one.to_json() for channel, one in figures.items()}

        floor = {c.value: {"ise": f.ise, "rms": f.rms} for c, f in self.noise_floor.items()}
        return {
            "before": table(self.before),
            "after": table(self.after),
            "noise_floor": floor,
            "validation": {"before": table(self.validation_before), "after": table(self.validation_after)},
        }


@dataclass(frozen=True, slots=True)
class NextExperiment:
    """The waveform that separates the names left best; amplitude and offset in the channel's SI unit or V."""

    why: str
    channel: Channel
    shape: str
    amplitude: float
    offset: float
    frequency_hz: float
    duty: float
    duration_s: float
    drive: str

    def to_json(self) -> dict[str, Any]:
        """As in `discovery.json`."""
        return {
            "why": self.why,
            "waveform": {
                "channel": self.channel.value,
                "drive": self.drive,
                "shape": self.shape,
                "amplitude": self.amplitude,
                "offset": self.offset,
                "frequency_hz": self.frequency_hz,
                "phase_rad": 0.0,
                "duty": self.duty,
                "duration_s": self.duration_s,
            },
        }


@dataclass(frozen=True, slots=True)
class RankedCandidate:
    """One row of the ranking: names joined, what it leaves of the gap, how it stands to the best."""

    channel: Channel
    names: tuple[str, ...]
    rms: float
    explained: float
    behind_best: float
    inside_vocabulary: bool = True


@dataclass(frozen=True, slots=True)
class Trace:
    """Measured and simulated of one channel on one run, for pictures; shapes (n,)."""

    channel: Channel
    unit: str
    time_s: Array
    voltage_v: Array
    measured: Array
    before: Array
    after: Array


@dataclass(frozen=True, slots=True)
class RunFacts:
    """What was examined with what."""

    source: str
    model: str
    version: str
    seconds: float

    def to_json(self) -> dict[str, Any]:
        """As in `discovery.json`."""
        return {"source": self.source, "model": self.model, "version": self.version, "seconds": self.seconds}


@dataclass(frozen=True, slots=True)
class DiscoveryResult:
    """The answer and all that the report shows."""

    verdict: Verdict
    effects: tuple[NamedEffect, ...]
    where: tuple[GapShare, ...]
    gap: Gap
    next_experiment: NextExperiment | None
    run: RunFacts
    model: ModelSpec
    sentence: str
    data_notes: tuple[str, ...] = ()
    nominal: Mapping[str, Estimate] = field(default_factory=dict)
    ranking: tuple[RankedCandidate, ...] = ()
    traces: tuple[Trace, ...] = ()
    validation_traces: tuple[Trace, ...] = ()
    interrupted: bool = False
    units: Mapping[Channel, str] = field(default_factory=dict)

    def unit(self, channel: Channel) -> str:
        """Unit of a channel as measured: SI, or what foreign data say."""
        return self.units.get(channel, channel.unit)

    def to_json(self) -> dict[str, Any]:
        """The contract of `discovery.json`: plain values only; `interrupted` is there where the search was."""
        return {
            "verdict": self.verdict.value,
            "effects": [effect.to_json() for effect in self.effects],
            "where": [share.to_json() for share in self.where],
            "gap": self.gap.to_json(),
            "next_experiment": None if self.next_experiment is None else self.next_experiment.to_json(),
            "run": self.run.to_json(),
            **({"interrupted": True} if self.interrupted else {}),
        }
