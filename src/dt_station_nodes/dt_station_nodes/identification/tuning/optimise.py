"""Constrained optimisation of a controller's settings on the nonlinear simulated loop."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from ...core.control import LoopConfig
from ...core.samples import ControlMode
from .errors import TuningError
from .problem import Experiment, Goal, Trial

# Weight of a bound crossed, per relative crossing: steeper than any gain in cost that a crossing can buy.
FENCE = 60.0
HOPELESS = 1e6
# The search keeps this far (relative) inside the bounds.
INSIDE = 0.002
DIGITS = 4


@dataclass(frozen=True, slots=True)
class Knob:
    """A setting the search turns, on a logarithmic scale between its bounds."""

    section: str
    field: str
    low: float
    high: float


KNOBS: Mapping[ControlMode, tuple[Knob, ...]] = {
    ControlMode.PI: (Knob("pi", "gain", 0.01, 50.0), Knob("pi", "integral_time_s", 0.005, 50.0)),
    ControlMode.PID: (
        Knob("pid", "p", 0.01, 200.0),
        Knob("pid", "i", 1e-4, 200.0),
        Knob("pid", "d", 1e-4, 20.0),
    ),
    ControlMode.FUZZY: (
        Knob("fuzzy", "error_gain", 0.2, 10.0),
        Knob("fuzzy", "output_gain", 0.3, 2.0),
        Knob("fuzzy", "load_gain", 0.2, 2.0),
        Knob("fuzzy", "error_lead_s", 1e-4, 0.2),
        Knob("fuzzy", "integral_gain", 1e-4, 50.0),
    ),
}


@dataclass(frozen=True, slots=True)
class Tuning:
    """What an optimisation found, beside where it started."""

    before: Trial
    after: Trial
    cost: float
    evaluations: int
    crossed: tuple[str, ...]


def optimise(
    start: LoopConfig,
    experiment: Experiment,
    goal: Goal | None = None,
    error_scale: float = 1.0,
    max_evaluations: int = 400,
    frozen: frozenset[str] = frozenset(),
    progress: Callable[[int], None] | None = None,
) -> Tuning:
    """Nelder-Mead in the settings' logarithms, from `start` and again from what that found.

    `frozen` fields keep their value. Deterministic. Raises TuningError where nothing can be turned.
    """
    goal = goal or Goal()
    knobs = tuple(k for k in KNOBS.get(start.mode, ()) if k.field not in frozen)
    if not knobs:
        raise TuningError(f"controller {start.name} has no settings to optimise in mode {start.mode.name.lower()}")
    before = experiment.trial(start, error_scale)
    count = 0

    def cost(x: NDArray[np.float64]) -> float:
        nonlocal count
        count += 1
        if progress is not None:
            progress(count)
        outside = float(np.sum(np.maximum(0.0, np.abs(x - 0.5) - 0.5) ** 2))
        trial = experiment.trial(_with(start, knobs, np.clip(x, 0.0, 1.0)), error_scale)
        return _cost(trial, before, goal) + FENCE * outside

    best: tuple[float, NDArray[np.float64]] | None = None
    starts = _starts(start, knobs)
    for x in starts:
        for budget, size in ((0.6, 0.06), (0.4, 0.02)):
            simplex = np.vstack([x, x + size * np.eye(len(x))])
            simplex[1:] = np.where(simplex[1:] > 1.0, 2.0 * x - simplex[1:], simplex[1:])
            most = int(budget * max_evaluations / len(starts))
            options = {"initial_simplex": simplex, "maxfev": most, "xatol": 1e-4, "fatol": 1e-5}
            x = minimize(cost, x, method="Nelder-Mead", options=options).x  # noqa: PLW2901
        value = cost(x)
        if best is None or value < best[0]:
            best = (value, x)
    x = starts[0] if best is None else best[1]
    found = _with(start, knobs, np.clip(x, 0.0, 1.0))
    after = experiment.trial(found, error_scale)
    return Tuning(before, after, _cost(after, before, goal), count, tuple(crossed(after, goal)))


def crossed(trial: Trial, goal: Goal) -> list[str]:
    """The goal's bounds that a trial crosses, as sentences."""
    return [text for text, excess in _excesses(trial, goal) if excess > 0.0]


def _excesses(trial: Trial, goal: Goal) -> list[tuple[str, float]]:
    margins, step = trial.stability, trial.step
    rows = [
        (
            f"overshoot {step.overshoot_percent:.2g} % is above {goal.overshoot_percent:g} %",
            (step.overshoot_percent - goal.overshoot_percent) / 5.0,
        ),
        (
            f"gain margin {margins.gain_margin:.3g} is below {goal.gain_margin:g}",
            1.0 - margins.gain_margin / goal.gain_margin,
        ),
        (
            f"phase margin {margins.phase_margin_deg:.3g} deg is below {goal.phase_margin_deg:g} deg",
            1.0 - margins.phase_margin_deg / goal.phase_margin_deg,
        ),
        ("the loop is unstable", -1.0 if margins.stable else 1.0),
    ]
    if goal.peak_v is not None:
        rows.append((f"voltage {step.peak_v:.3g} V is above {goal.peak_v:g} V", step.peak_v / goal.peak_v - 1.0))
    return rows


def _cost(trial: Trial, before: Trial, goal: Goal) -> float:
    step, was = trial.step, before.step
    terms = [
        (goal.ise, step.ise, was.ise),
        (goal.itae, step.itae, was.itae),
        (goal.travel, step.travel_v, was.travel_v),
    ]
    if trial.hold_index is not None and before.hold_index is not None:
        terms.append((goal.hold, trial.hold_index, before.hold_index))
    total = sum(weight * now / max(then, 1e-12) for weight, now, then in terms)
    if not math.isfinite(total):
        return HOPELESS
    return min(HOPELESS, total + FENCE * sum(_crossing(excess + INSIDE) for _, excess in _excesses(trial, goal)))


def _starts(config: LoopConfig, knobs: tuple[Knob, ...]) -> list[NDArray[np.float64]]:
    """Where searches begin: the setting given, and for a fuzzy one the same but nearly deaf to the load.

    On the plateaus of the load's terms its gain changes nothing, which a search cannot see over.
    """
    x = np.array([_place(config, k) for k in knobs])
    deaf = [i for i, knob in enumerate(knobs) if knob.field == "load_gain"]
    if not deaf:
        return [x]
    other = x.copy()
    other[deaf] = 0.05
    return [x, other]


def _crossing(excess: float) -> float:
    return excess + excess**2 if excess > 0.0 else 0.0


def _place(config: LoopConfig, knob: Knob) -> float:
    value = getattr(getattr(config, knob.section), knob.field)
    share = math.log(max(value, knob.low) / knob.low) / math.log(knob.high / knob.low)
    return min(max(share, 0.0), 1.0)


def _with(config: LoopConfig, knobs: tuple[Knob, ...], x: NDArray[np.float64]) -> LoopConfig:
    # Settings of four digits are what a person copies; those are what is tried, too.
    changes: dict[str, dict[str, float]] = {}
    for knob, share in zip(knobs, x, strict=True):
        value = knob.low * (knob.high / knob.low) ** float(share)
        changes.setdefault(knob.section, {})[knob.field] = float(f"{value:.{DIGITS}g}")
    sections = {name: getattr(config, name).model_copy(update=update) for name, update in changes.items()}
    return config.model_copy(update=sections)
