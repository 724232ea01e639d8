"""Whether a gap is commands that never arrived: spells in which the object kept the last voltage, or saw none at all.

No function of voltage or state foretells when they come, so each spell costs two numbers. A spell is looked for by what
it would take off the sum of squares, for every beginning and length at once, and proven by simulation.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from ..core.models import PathSpec
from .problem import Problem, integrates
from .selection import Bench, as_given, fit_null
from .terms import nominal_terms

Array = NDArray[np.float64]

LONGEST_S, LONGEST = 3.0, 200  # and in samples
MOST = 40
MOST_LOST = 0.35  # of the run: a spool that sticks keeps its voltage nearly always
PULSE_S = 1.5  # after it an answer to a pulse is over
ROUNDS = 2
CLEARLY = 0.5  # of what another explanation leaves beyond noise,
NEARLY_ALL = 0.02  # of what none leaves,
NEAR = 3.0  # times the noise power: spells that explain a gap leave no more
OVER = 1.7  # times the noise power: what leaves less is not looked at again
FOR_CERTAIN = 40.0  # twice the log-likelihood ratio beyond what the spells cost
SHORTEST = 2.0  # samples, in the mean: shorter ones are corners of something else


@dataclass(frozen=True, slots=True)
class Spell:
    """From when to when, in samples, no command was there; `held`: the one before stood, else there was none."""

    first: float
    stop: float
    held: bool


def applied(voltage_v: Array, spells: list[Spell]) -> Array:
    """The voltage (n,) that the object saw, in the mean over each sample."""
    seen = voltage_v.copy()
    for spell in sorted(spells, key=lambda one: one.first):
        begin, end = int(np.floor(spell.first)), int(np.ceil(spell.stop))
        there = np.arange(begin, end)
        lost = np.minimum(there + 1.0, spell.stop) - np.maximum(there, spell.first)
        level = seen[begin - 1] if spell.held and begin else 0.0
        seen[begin:end] += lost * (level - seen[begin:end])
    return seen


def _seeing(problem: Problem, spells: list[Spell]) -> Problem:
    """The problem of the voltage that the object saw."""
    seen = applied(problem.simulator.voltage_v, spells)
    return replace(problem, simulator=replace(problem.simulator, voltage_v=seen))


def commands_lost(problem: Problem, path: PathSpec, left: float, noise: float) -> list[Spell]:
    """The spells, if they explain clearly more than another explanation; empty if not.

    `path`: the nominal one; `left`, `noise`: mean square of what the other leaves, and of noise.
    """
    if problem.rough or left < OVER * noise:
        return []
    return next((found for held in (False, True) if (found := _told(problem, path, held, left, noise))), [])


def _told(problem: Problem, path: PathSpec, held: bool, left: float, noise: float) -> list[Spell]:
    count = len(problem.measured)
    explained = as_given(Bench(problem, ()), path)
    nothing = float(np.mean(np.square(explained.fit.residual)))
    spells: list[Spell] = []
    for _ in range(ROUNDS):
        spells = _spells(problem, explained.fit.path, held, noise, spells)
        bench = Bench(_seeing(problem, spells), nominal_terms(path, problem.signal, problem.rough))
        explained = fit_null(bench, path)
    lost = sum(spell.stop - spell.first for spell in spells)
    leaves = max(float(np.mean(np.square(explained.fit.residual))), noise)
    most = min(CLEARLY * (left - noise), NEARLY_ALL * (nothing - noise), (NEAR - 1.0) * noise)
    if lost < SHORTEST * max(len(spells), 1) or lost > MOST_LOST * count or leaves - noise > most:
        return []
    gain = count * np.log(left / leaves) - 2.0 * len(spells) * np.log(count)
    return spells if gain > FOR_CERTAIN else []


def _spells(problem: Problem, path: PathSpec, held: bool, noise: float, known: list[Spell]) -> list[Spell]:
    """Spell after spell, each the one that takes most off the sum of squares, as long as it is worth its numbers."""
    count, pulse = len(problem.measured), _pulse(problem, path)
    longest = min(round(LONGEST_S / problem.simulator.sample_time_s), LONGEST)
    worth = 2.0 * np.log(count) * 2.0 * noise
    spells, cost = list(known), _cost(problem, path, known)
    while len(spells) < MOST:
        seen = _seeing(problem, spells)
        gap = problem.measured - seen.simulate(path)
        if integrates(path):
            gap = np.diff(gap, prepend=gap[0])
        found = _foremost(gap * problem.weights, pulse, seen.simulator.voltage_v, held, longest)
        found, after = _fine(problem, path, spells, found)
        # The foremost of those that can still come takes off at least its part of what is left.
        part = (cost - noise * count) / (MOST - len(spells))
        if cost - after < max(worth, part):
            break
        spells, cost = [*spells, found], after
    return spells


def _fine(problem: Problem, path: PathSpec, known: list[Spell], spell: Spell) -> tuple[Spell, float]:
    """A further spell with its ends between samples, and the cost with it."""

    def between(low: float, high: float, moved: Callable[[float], Spell]) -> tuple[Spell, float]:
        found = minimize_scalar(
            lambda place: _cost(problem, path, [*known, moved(place)]),
            bounds=(low, high),
            method="bounded",
            options={"xatol": 0.02},
        )
        return moved(float(found.x)), float(found.fun)

    at, until = spell.first, spell.stop
    whole = (spell, _cost(problem, path, [*known, spell]))
    stopped = between(
        max(until - 1.0, at + 0.1), min(until + 1.0, len(problem.measured)), lambda place: replace(spell, stop=place)
    )
    shorter = min(whole, stopped, key=lambda one: one[1])
    begun = between(
        max(at - 1.0, 0.0), min(at + 1.0, shorter[0].stop - 0.1), lambda place: replace(shorter[0], first=place)
    )
    return min(shorter, begun, key=lambda one: one[1])


def _cost(problem: Problem, path: PathSpec, spells: list[Spell]) -> float:
    return float(np.sum(np.square(_seeing(problem, spells).residual(path))))


def _pulse(problem: Problem, path: PathSpec) -> Array:
    """What 1 V for a sample does to the output, or where the path integrates to its differences, shape (m,)."""
    sample_time_s = problem.simulator.sample_time_s
    still = np.zeros(max(8, round(PULSE_S / sample_time_s)))
    pushed = still.copy()
    pushed[0] = 1.0
    load = np.zeros(len(still) if len(problem.simulator.load_pa) else 0)
    linear = path.model_copy(update={"effects": ()})
    at_rest = replace(problem.simulator, voltage_v=still, load_pa=load, other_v=None, first_velocity=None)
    answer = replace(at_rest, voltage_v=pushed).simulate(linear) - at_rest.simulate(linear)
    return np.asarray(np.diff(answer, prepend=0.0) if integrates(path) else answer)


def _foremost(gap: Array, pulse: Array, seen_v: Array, held: bool, longest: int) -> Spell:
    """The spell that takes most off the sum of squares of a gap (n,), by the answer of the linear path to it.

    With d the voltage that it takes away or adds and h the pulse's answer that is 2 <gap, h * d> - <h * d, h * d>,
    summed up sample by sample for all beginnings at once.
    """
    count = len(gap)
    told = np.correlate(gap, pulse, "full")[len(pulse) - 1 : len(pulse) - 1 + count]
    alike = np.correlate(pulse, pulse, "full")[len(pulse) - 1 :]
    before = np.concatenate(([0.0], seen_v[:-1])) if held else np.zeros(count)
    # sums over a spell from each beginning: of gap and d's two parts, and of the products of these parts
    of_one, of_volts = np.zeros(count), np.zeros(count)
    ones, mixed, volts = np.zeros(count), np.zeros(count), np.zeros(count)
    past_one, past_volts = np.zeros(count), np.zeros(count)
    best, chosen = 0.0, Spell(0, 1, held)
    for length in range(1, min(longest, count - 1) + 1):
        rows = count - length + 1
        last = slice(length - 1, count)
        u = seen_v[last]
        of_one[:rows] += told[last]
        of_volts[:rows] += told[last] * u
        ones[:rows] += alike[0] + 2.0 * past_one[last]
        volts[:rows] += u * (u * alike[0] + 2.0 * past_volts[last])
        mixed[:rows] += u * alike[0] + u * past_one[last] + past_volts[last]
        h = before[:rows]
        linear = h * of_one[:rows] - of_volts[:rows]
        square = h * h * ones[:rows] - 2.0 * h * mixed[:rows] + volts[:rows]
        gains = 2.0 * linear - square
        at = int(np.argmax(gains))
        if gains[at] > best:
            best, chosen = float(gains[at]), Spell(at, at + length, held)
        if length < len(alike):
            past_one[length:] += alike[length]
            past_volts[length:] += alike[length] * seen_v[:-length]
    return chosen
