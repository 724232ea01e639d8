"""Starts that a run itself gives: when a disturbance comes and goes, a delay wanders, a gain steps, an offset comes."""

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ..core.models import EffectSpec, PathSpec
from .bursts import burst_start_s, bursts
from .gain_steps import gain_steps
from .modulation import modulation, swing_phases_rad
from .problem import Problem
from .shifts import shift_time
from .spectrum import spectral_peaks
from .terms import Hypothesis, Term

Array = NDArray[np.float64]

PERIODIC = "periodic_disturbance"
DELAY = "delay"
DRIFT = "gain_drift"
BIAS = "bias"
# What has a phase at the start of a run: effect, phase, frequency (Hz) that it turns with, size.
PHASES = (
    (PERIODIC, "phase_rad", "frequency_hz", "amplitude"),
    (PERIODIC, "second_rad", "second_hz", "second_share"),
    (PERIODIC, "swell_rad", "swell_hz", "swell"),
    (PERIODIC, "modulation_phase_rad", "modulation_hz", "modulation_rad"),
    (DELAY, "wander_rad", "wander_hz", "wander"),
)

# Of the residual's power: what a wandering delay must explain of it.
TELLING = 0.1
# Cycles in a run: slower wanders are a drift, quicker ones none.
SLOWEST_CYCLES = 1.5
QUICKEST_CYCLES = 40.0
# Turns in a run by which a swing of its own comes apart from the excitation's harmonics.
APART_TURNS = 0.5
# Of what a tone leaves beyond noise: what another must explain.
MOSTLY = 0.5
# Of what one tone explains.
FAINT = 0.01
# Part of a delay, or of a tone, that is little enough for its effect to be linear.
SMALL = 0.1
# V, of an offset by which its part in the output is simulated.
_SMALL_V = 1e-3
# How what comes in the course of a run comes, at first: nearly at once.
_COMES = {"jump_lag_s": 0.05, "jump_even": 0.0}
_GRADUALLY_S = (0.2, 0.8)
_NO_OFFSET = {"bias_v": 0.0, "settling_s": 0.0, "jump_v": 0.0}


def with_numbers(path: PathSpec, spec: EffectSpec, numbers: dict[str, float]) -> PathSpec:
    """The path with some numbers of one of its effects changed."""
    new = EffectSpec.model_construct(name=spec.name, at=spec.at, parameters={**spec.parameters, **numbers})
    return path.model_copy(update={"effects": tuple(new if effect is spec else effect for effect in path.effects)})


def without(path: PathSpec, name: str) -> PathSpec:
    """The path less an effect."""
    return path.model_copy(update={"effects": tuple(effect for effect in path.effects if effect.name != name)})


def seen_timing(problem: Problem, path: PathSpec, name: str, nominal: Sequence[Term] = ()) -> dict[str, float]:
    """Numbers of a fitted effect's timing, by name; none where the run shows no such thing.

    What bends the `nominal` parameters as far as a gain that steps is looked for with these at their centres.
    """
    spec = next((effect for effect in path.effects if effect.name == name), None)
    if spec is None:
        return {}
    if name == PERIODIC:
        ways = [way(problem, path, spec) for way in (_second_tone, _swell, _bursts, _modulated)]
        return min((way for way in ways if way), key=lambda way: _turned(problem, path, spec, way)[1], default={})
    if name == DELAY and spec.parameters["delay_s"] > 0.0:
        return _wander(problem, path, spec)
    return coming_in_run(problem, path, name, nominal)


def coming_in_run(problem: Problem, path: PathSpec, name: str, nominal: Sequence[Term] = ()) -> dict[str, float]:
    """When an offset or a gain's step comes and how large it is, whatever of it is there from the start."""
    if name == BIAS:
        return _shift(problem, path, path.effect(name), nominal)
    return _steps(problem, path, path.effect(name), nominal) if name == DRIFT else {}


def softer(timing: Mapping[str, float]) -> list[dict[str, float]]:
    """The same with what comes nearly at once coming gradually, by first order or evenly, half of it by that time."""
    if "jump_even" not in timing:
        return []
    begun = {lag_s: timing["jump_s"] - math.log(2.0) * lag_s for lag_s in _GRADUALLY_S}
    by_first_order = [{**timing, "jump_s": at, "jump_lag_s": lag_s} for lag_s, at in begun.items()]
    return [*by_first_order, *({**timing, "jump_lag_s": 0.5 * lag_s, "jump_even": 1.0} for lag_s in _GRADUALLY_S)]


def _at_home(path: PathSpec, nominal: Sequence[Term]) -> PathSpec:
    """The path with its nominal parameters at their centres."""
    return Hypothesis(path, tuple(nominal)).path_at(np.array([term.centre for term in nominal]))


def _steps(problem: Problem, path: PathSpec, spec: EffectSpec, nominal: Sequence[Term]) -> dict[str, float]:
    """When the gain steps and by how much, instead of the drift that was fitted."""
    steady = {"rate_per_s": 0.0, "swing": 0.0, "swing_cosine": 0.0, "jump": 0.0, "second_jump": 0.0}
    found = gain_steps(problem, _at_home(with_numbers(path, spec, steady), nominal))
    return {"rate_per_s": 0.0, **found, **_COMES} if found else {}


def _shift(problem: Problem, path: PathSpec, spec: EffectSpec, nominal: Sequence[Term]) -> dict[str, float]:
    """When a further offset comes and how large it is, beside the one that is there from the start."""
    bare = _at_home(with_numbers(path, spec, _NO_OFFSET), nominal)
    spec, residual, whole_s = bare.effect(spec.name), problem.residual(bare), problem.length_s

    def slope(numbers: dict[str, float]) -> Array:
        return (residual - problem.residual(with_numbers(bare, spec, numbers))) / _SMALL_V

    steady = slope({"bias_v": _SMALL_V})
    share = shift_time(residual, steady, lambda s: slope({"jump_v": _SMALL_V, "jump_s": s * whole_s}), problem.noise)
    if share is None:
        return {}
    late = slope({"jump_v": _SMALL_V, "jump_s": share * whole_s})
    bias_v, jump_v = np.linalg.lstsq(np.column_stack([steady, late]), residual, rcond=None)[0].tolist()
    return {"bias_v": bias_v, "jump_v": jump_v, "jump_s": share * whole_s, **_COMES}


def _sinusoid(
    problem: Problem, path: PathSpec, spec: EffectSpec, numbers: dict[str, float], phase: str
) -> tuple[float, float, float]:
    """How many times an effect's small `numbers`, at what phase (rad), explain most of a residual, and how much of it.

    So small, their effect is linear: two phases tell all.
    """
    residual = problem.residual(path)
    turned = (with_numbers(path, spec, {**numbers, phase: turn}) for turn in (0.0, 0.5 * math.pi))
    slopes = np.column_stack([residual - problem.residual(one) for one in turned])
    size = np.linalg.lstsq(slopes, residual, rcond=None)[0]
    explained = float(residual @ residual) - float(np.sum(np.square(residual - slopes @ size)))
    return float(np.hypot(*size)), math.atan2(size[1], size[0]), explained


def _turned(
    problem: Problem, path: PathSpec, spec: EffectSpec, numbers: dict[str, float]
) -> tuple[dict[str, float], float]:
    """An oscillation's `numbers` with its size and phase by least squares, and the sum of squares that it leaves."""
    bare, phase_rad = problem.residual(without(path, spec.name)), spec.parameters["phase_rad"]
    turned = ({**numbers, "phase_rad": phase_rad + turn} for turn in (0.0, 0.5 * math.pi))
    columns = np.column_stack([bare - problem.residual(with_numbers(path, spec, one)) for one in turned])
    size = np.linalg.lstsq(columns, bare, rcond=None)[0]
    amplitude = spec.parameters["amplitude"] * float(np.hypot(*size))
    found = {
        **numbers,
        "amplitude": amplitude,
        "phase_rad": math.remainder(phase_rad + math.atan2(size[1], size[0]), 2.0 * math.pi),
    }
    return found, float(np.sum(np.square(bare - columns @ size)))


def _modulated(problem: Problem, path: PathSpec, spec: EffectSpec) -> dict[str, float]:
    """How an oscillation's frequency swings, and its amplitude beside; its size and phase by least squares."""
    bare = problem.residual(without(path, spec.name))
    found = modulation(bare, problem.simulator.sample_time_s, spec.parameters["frequency_hz"])
    if found is None:
        return {}
    swing, swell = found.phase, found.amplitude
    numbers = {"frequency_hz": found.frequency_hz, "modulation_rad": swing.size, "modulation_hz": swing.frequency_hz}
    numbers["modulation_phase_rad"] = swing.phase_rad
    if swell is not None:
        numbers |= {"swell": swell.size, "swell_hz": swell.frequency_hz, "swell_rad": swell.phase_rad}
    return _turned(problem, path, spec, numbers)[0]


def _bursts(problem: Problem, path: PathSpec, spec: EffectSpec) -> dict[str, float]:
    """When an oscillation is on and off, where silence explains much of it."""
    step_s = problem.simulator.sample_time_s
    found = bursts(problem.residual(without(path, spec.name)), step_s, spec.parameters["frequency_hz"])
    if found is None:
        return {}
    return {"burst_period_s": found.period_s, "burst_share": found.share, "burst_start_s": found.start_s}


def _swell(problem: Problem, path: PathSpec, spec: EffectSpec) -> dict[str, float]:
    """How an oscillation swells and sinks, where what it leaves lies on both sides of its frequency alike."""
    residual, whole = problem.residual(path), problem.residual(without(path, spec.name))
    beyond = float(residual @ residual) - len(residual) * problem.noise**2
    one, other = spectral_peaks(residual, problem.simulator.sample_time_s, 2)
    if abs(0.5 * (one + other) - spec.parameters["frequency_hz"]) * problem.length_s > APART_TURNS:
        return {}
    numbers = {"swell": SMALL, "swell_hz": 0.5 * abs(one - other)}
    size, turn, explained = _sinusoid(problem, path, spec, numbers, "swell_rad")
    telling = explained > max(MOSTLY * beyond, FAINT * float(whole @ whole))
    return {**numbers, "swell": min(SMALL * size, 1.0), "swell_rad": turn} if telling else {}


def _second_tone(problem: Problem, path: PathSpec, spec: EffectSpec) -> dict[str, float]:
    """The tone that makes up most of what a fitted one leaves; bursts of one leave several of equal size."""
    residual, whole = problem.residual(path), problem.residual(without(path, spec.name))
    beyond = float(residual @ residual) - len(residual) * problem.noise**2
    frequency_hz = spectral_peaks(residual, problem.simulator.sample_time_s, 1)[0]
    # One of twice its frequency may be another machine's all the same, whose phase is its own in each run.
    apart = min(frequency_hz, abs(frequency_hz - spec.parameters["frequency_hz"])) * problem.length_s
    if apart < APART_TURNS or problem.excited_at(frequency_hz, APART_TURNS):
        return {}
    numbers = {"second_share": SMALL, "second_hz": frequency_hz}
    size, turn, explained = _sinusoid(problem, path, spec, numbers, "second_rad")
    telling = explained > max(MOSTLY * beyond, FAINT * float(whole @ whole))
    return {**numbers, "second_share": min(SMALL * size, 1.0), "second_rad": turn} if telling else {}


def _wander(problem: Problem, path: PathSpec, spec: EffectSpec) -> dict[str, float]:
    """The swing of a fitted delay that explains most of what it leaves, small swings simulated at each frequency."""
    steady = with_numbers(path, spec, {"wander": 0.0})
    spec = steady.effect(spec.name)
    residual = problem.residual(steady)
    best, found = TELLING * float(residual @ residual), {}
    for cycles in np.arange(SLOWEST_CYCLES, QUICKEST_CYCLES, 0.5):
        frequency_hz = float(cycles) / problem.length_s
        # What swings with the excitation is a nonlinearity.
        if problem.excited_at(frequency_hz, APART_TURNS):
            continue
        numbers = {"wander": SMALL, "wander_hz": frequency_hz}
        size, turn, explained = _sinusoid(problem, steady, spec, numbers, "wander_rad")
        if explained > best:
            best, found = explained, {**numbers, "wander": min(SMALL * size, 1.0), "wander_rad": turn}
    return found


def begun(problem: Problem, path: PathSpec, spec: EffectSpec) -> float:
    """When bursts of a fitted disturbance begin in a run (s), which no other run foretells."""
    numbers = spec.parameters
    residual = problem.residual(without(path, spec.name))
    step_s = problem.simulator.sample_time_s
    return burst_start_s(residual, step_s, numbers["frequency_hz"], numbers["burst_period_s"], numbers["burst_share"])


def swung(problem: Problem, path: PathSpec, spec: EffectSpec) -> dict[str, float]:
    """The phases with which a fitted disturbance's frequency and amplitude swing in a run: no other foretells them."""
    numbers = spec.parameters
    residual = problem.residual(without(path, spec.name))
    rates_hz = (numbers[name] for name in ("frequency_hz", "modulation_hz", "swell_hz"))
    swing, swell = swing_phases_rad(residual, problem.simulator.sample_time_s, *rates_hz)
    return {"modulation_phase_rad": swing, "swell_rad": swell}
