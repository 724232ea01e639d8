"""Which periodic disturbances are none: any smooth nonlinearity of a periodic run looks as if it were one."""

from .choice import ENOUGH_TO_TELL
from .measure import Measure
from .problem import Problem
from .selection import Explanation
from .timing import PERIODIC

FEWEST_CYCLES = 3.0  # fewer in a run are a drift
SAME_TURNS = 0.2  # two frequencies that come apart by less of a turn in a run are one


def recurring(found: list[Explanation], known: list[Explanation], measure: Measure) -> list[Explanation]:
    """Without those whose periodic disturbance comes too seldom to be one, or beats with the excitation.

    Any smooth nonlinearity of a periodic run looks as if it did. What such a disturbance foretells of a run excited
    at other frequencies tells the two apart: more than what is `known` to explain it without one.
    """
    kept = []
    for explanation in found:
        problems = measure.bench.problems
        if PERIODIC not in explanation.added or not _beats(explanation, problems[0]):
            kept.append(explanation)
            continue
        unseen = len(problems) > 1 and not _beats(explanation, problems[1])
        without = {name for name in explanation.added if name != PERIODIC}
        plain = min((e for e in known if set(e.added) <= without), key=measure.score)
        if unseen and measure.told(plain, explanation)[1] > ENOUGH_TO_TELL:
            kept.append(explanation)
    return kept


def _beats(explanation: Explanation, problem: Problem) -> bool:
    """Whether a periodic disturbance comes a few times only in a run, or with what excites it."""
    numbers = explanation.fit.path.effect(PERIODIC).parameters
    tones = [numbers["frequency_hz"]]
    tones += [numbers["second_hz"]] if numbers.get("second_share", 0.0) != 0.0 else []
    # What comes once in each period of the excitation is an answer to it.
    bursts = [1.0 / numbers["burst_period_s"]] if numbers.get("burst_period_s", 0.0) > 0.0 else []
    seldom = any(hz * problem.length_s < FEWEST_CYCLES for hz in tones)
    return seldom or any(problem.excited_at(hz, SAME_TURNS) for hz in [*tones, *bursts])
