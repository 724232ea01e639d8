"""Forms outside the vocabulary beside a set of names: which of them makes the names doubtful."""

from collections.abc import Callable, Sequence

import numpy as np

from ..core.models.effects import registry
from .candidates import in_vocabulary
from .problem import Problem
from .selection import Explanation

SAME = 6.0  # twice the log-likelihood ratio: what is closer is not told apart
# Numbers with which a name is no special case of a stranger: a coil that saturates is quicker at a higher voltage, oil
# with air in it at a higher pressure.
_ITS_OWN = (("extra_lag", "saturation"),)
_LINEAR = frozenset({"delay", "extra_lag", "resonance"})
_OTHER_ORDER = "linear dynamics of another order"
_CLEARLY = 3.0  # times the noise, RMS
_PAST = 60  # samples of voltage that what is left may answer
_MOSTLY_LINEAR = 0.5  # of what is left may be no answer to them
TRIFLE = 40.0  # so much more a stranger that holds the names must tell where they leave next to nothing


def stranger(best: Explanation, scored: Sequence[tuple[float, Explanation]], trifling: bool, rough: bool) -> str:
    """The name of the foremost form outside the vocabulary that explains as much as the best set; "" if none does.

    `scored`: how far each explanation is behind the best set, foremost first; `trifling`: that set leaves next to
    nothing. One that holds the names as special cases, and any where data are rough, has to explain clearly more; one
    that would hold them, were it not in its plain form, just more; and so it is with what does as well as the best set.
    """
    more = TRIFLE if trifling else SAME
    as_many = (p for p in scored if p[1].inside and len(p[1].added) == len(best.added) and p[1] is not best)
    named = [(0.0, best), *(p for p in as_many if p[0] < SAME and not p[1].hollow)]
    for behind, other in scored:
        if other.inside or len(other.added) > len(best.added):
            continue
        if behind < (-more if rough else min(ahead + _limit(other, one, more) for ahead, one in named)):
            return next(name for name in other.added if not in_vocabulary(name))
    return ""


def mimic(best: Explanation, scored: Sequence[tuple[float, Explanation]]) -> str:
    """A form outside the vocabulary, other than the best set's, that explains hardly less; "" if there is none."""
    for behind, other in scored:
        as_many = not other.inside and len(other.added) == len(best.added)
        if as_many and 0.0 <= behind < SAME and _limit(other, best, SAME) >= 0.0:
            return next(name for name in other.added if not in_vocabulary(name))
    return ""


def in_place_of_one(best: Explanation, known: Sequence[Explanation]) -> list[Explanation]:
    """Explanations with a form outside the vocabulary in the place of one of several names."""
    strangers = [e for e in known if not e.inside and len(e.added) == len(best.added)]
    return [e for e in strangers if len(set(e.added) & set(best.added)) == len(best.added) - 1]


def beside(
    best: Explanation, scored: Sequence[tuple[float, Explanation]], mended: Callable[[Explanation], bool]
) -> list[tuple[float, Explanation]]:
    """Explanations that do without the best set, and those that need a form outside the vocabulary besides.

    Of these what is not `mended` may be the set's own form that is not quite the rig's.
    """
    return [p for p in scored if not set(best.added) <= set(p[1].added) or (not p[1].inside and mended(p[1]))]


def other_dynamics(problem: Problem, best: Explanation, floor: float) -> str:
    """What makes names of linear effects doubtful: what they leave, far above noise of power `floor`, is linear too."""
    left = np.diff(best.fit.residual)
    voltage = problem.simulator.voltage_v
    power = float(np.mean(np.square(best.fit.residual)))
    if problem.rough or not set(best.added) <= _LINEAR or power < _CLEARLY**2 * max(floor, problem.sigma**2):
        return ""
    past = min(_PAST, len(left) // 20)
    count = len(left) - past
    driven = np.column_stack([np.diff(voltage)[past - lag : len(left) - lag] for lag in range(1, past + 1)])
    rest = left[past:] - driven @ np.linalg.lstsq(driven, left[past:], rcond=None)[0]
    unexplained = float(rest @ rest) / max(count - past, 1) * count
    return _OTHER_ORDER if unexplained < _MOSTLY_LINEAR * float(left[past:] @ left[past:]) else ""


def _limit(other: Explanation, best: Explanation, more: float) -> float:
    """How far a stranger may be behind, or has to be ahead."""
    special = {case: (name, by) for name in other.added for case, by in registry()[name].special_cases.items()}
    if not set(best.added) <= set(other.added) | set(special):
        return SAME
    plain = any(_neutral(other, *special[name]) for name in best.added if name not in other.added)
    own = any(name in best.added and not _neutral(best, name, number) for name, number in _ITS_OWN)
    # What needs more numbers than the form that holds it is no special case of that any more.
    return 0.0 if plain else -(SAME if own or _numbers(best) > _numbers(other) else more)


def _numbers(explanation: Explanation) -> int:
    """How many freed numbers of its effects change anything."""
    freed = ((name, number) for name in explanation.added for number in explanation.freed.get(name, ()))
    return sum(not _neutral(explanation, name, number) for name, number in freed)


def _neutral(explanation: Explanation, name: str, parameter: str) -> bool:
    """Whether a parameter of one of the effects changes nothing; "": none is needed."""
    if not parameter:
        return False
    spec = explanation.fit.path.effect(name)
    return abs(spec.parameters[parameter] - registry()[name].parameter(parameter).neutral) < 1e-6
