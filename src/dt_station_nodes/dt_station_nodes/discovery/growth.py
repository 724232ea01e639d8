"""Stage 5: sets of effects grown from single ones, exchanged and reduced, until a round finds no other start."""

import numpy as np

from .choice import ENOUGH_TO_NAME, NEXT_LEAVES, WORTH_NOISE, could_add, hides
from .distinct import distinct
from .measure import LEAD, Measure, take_measure
from .neighbours import parts, reduced
from .recurring import recurring
from .search import scan
from .selection import Bench, Explanation
from .sense import sensible

MORE_LEAVES = NEXT_LEAVES  # a third effect is tried only where the second left at most this, as little as it has to
BEAM = 3
LIKELY = 10.0  # times what the best leaves: what leaves more is not what an effect is added to
MOST = 12  # candidates fitted of those glanced at,
FINEST = 4  # and in their refined form too
MISSES = 0.12  # of the signal, RMS: what misses more of it has not been understood
FOREIGN = 100.0  # twice the log-likelihood ratio by which it leads
IDLE = 8.0  # twice the log-likelihood ratio that any further effect may gain by chance
_NEAR = 100.0  # twice the log-likelihood ratio by which a set is behind that is looked into as the foremost one is
_ROUNDS = 2
_EXCHANGES = 2  # in a row, where the first puts other names in front
_TRACE = 0.1  # of the noise power, between what two forms leave: from both the same is found
_NEARLY = 0.01  # of what is left, the same where the same numbers are free
_ANEW = 20.0  # a set found so much better than when it was grown from is grown from again


class Growth:
    """Grows `known` in place: what it holds by the time of an interruption stays."""

    def __init__(self, bench: Bench, null: Explanation, known: list[Explanation], most_effects: int) -> None:
        self._bench, self._null, self._known, self._most_effects = bench, null, known, most_effects
        # Rough data have few samples and shallow minima: all that is fitted is fitted in its refined form too.
        self._finest = MOST if bench.rough else FINEST
        self._grown: dict[tuple[str, ...], Explanation] = {}
        self._exchanged: dict[tuple[str, ...], Explanation] = {}
        self._lessened: dict[tuple[str, ...], Explanation] = {}
        self._scanned: list[Explanation] = []

    def run(self) -> None:
        """A larger set may find a better form of a smaller one: then another round grows from that."""
        for number in range(_ROUNDS):
            measure = take_measure(self._bench, self._known)
            leaders = self._leaders(measure)
            if not leaders or (number and self._old(leaders[0], measure)):
                break
            beam = 1 if number else BEAM
            if self._bench.rough:
                self._grow_first(beam)
                continue
            for _ in range(self._most_effects - 1):
                extended = self._extend(beam)
                measure = take_measure(self._bench, self._known)
                leaders = self._leaders(measure)
                if self._foreign() or (max(len(e.added) for e in leaders) > 1 and self._lost(leaders, measure)):
                    return
                # A smaller set that is all there is needs no exchange of what is put on top of it.
                self._reduce()
                for _ in range(_EXCHANGES):
                    before = self._foremost()
                    self._exchange()
                    self._reduce()
                    # What took another's place has not been asked what could stand in its own.
                    if self._foremost() == before:
                        break
                if not extended:
                    break

    def _grow_first(self, beam: int) -> None:
        """In rough data hardly a set is enough early: exchanging each on the way costs more than it saves."""
        for _ in range(self._most_effects - 1):
            if not self._extend(beam):
                break
        self._exchange()
        self._reduce()

    def _leaders(self, measure: Measure) -> list[Explanation]:
        return sorted((e for e in self._known if e.inside and e.added), key=measure.score)

    def _old(self, leader: Explanation, measure: Measure) -> bool:
        if len(leader.added) >= self._most_effects or not self._worth_more(leader, measure):
            return True
        return self._done(self._grown, leader, measure)

    @staticmethod
    def _done(before: dict[tuple[str, ...], Explanation], explanation: Explanation, measure: Measure) -> bool:
        """Whether the same was done with a set of these names that was about as good."""
        former = before.get(tuple(sorted(explanation.added)))
        return former is not None and measure.score(former) - measure.score(explanation) < _ANEW

    def _worth_more(self, leader: Explanation, measure: Measure) -> bool:
        # A form outside the vocabulary that leaves nothing ends the search too: more names would only mimic it.
        # What is not what its name says needs another name, however little it leaves.
        believed = [e for e in self._known if not e.inside or self._borne_out(e, measure)]
        gap = measure.left(self._null)
        left = min((measure.left(e) for e in believed), default=gap)
        if not measure.bent(leader) and left <= WORTH_NOISE * measure.noise:
            return False
        foremost = min((e for e in believed if e.inside), key=measure.score, default=leader)
        if not (measure.rough or measure.bent(leader) or could_add(foremost, measure)):
            return False
        return measure.score(self._null) - measure.score(leader) >= ENOUGH_TO_NAME or gap >= measure.noise

    def _extend(self, beam: int) -> bool:
        """Whether the foremost sets were tried with one more effect each."""
        measure = take_measure(self._bench, self._known)
        inside = self._leaders(measure)
        size = len(inside[0].added)
        if size >= self._most_effects or not self._worth_more(inside[0], measure):
            return False
        smaller = [measure.left(e) for e in inside if len(e.added) < size]
        if not measure.rough and size > 1 and measure.left(inside[0]) > MORE_LEAVES * min(smaller, default=np.inf):
            return False
        # What is not what its name says tells nothing of how little a name leaves.
        near = LIKELY * measure.left(next((e for e in inside if self._borne_out(e, measure)), inside[0]))
        bases = [e for e in inside[: beam if size == 1 else 1] if measure.left(e) <= near or e is inside[0]]
        # What has been grown already would give the same again.
        bases = [e for e in bases if self._grown.get(tuple(sorted(e.added))) is not e]
        bases = [e for e in bases if self._believable(e) or not self._lost([e], measure)]
        if not bases:
            return False
        self._grown.update({tuple(sorted(e.added)): e for e in bases})
        # Whatever is added to a set that explains all under a wrong name does: it is to leave the others their places.
        borne_out = [self._borne_out(e, measure) for e in bases]
        for wanted in (True, False):
            self._scan([e for e, is_so in zip(bases, borne_out, strict=True) if is_so is wanted], measure)
        return True

    def _borne_out(self, explanation: Explanation, measure: Measure) -> bool:
        """Whether a set's effects are what their names say; rough data do not tell."""
        return measure.rough or sensible(explanation, self._bench.problem)

    def _foreign(self) -> bool:
        """Whether a set with a form outside the vocabulary is far ahead of those without, which are larger or full."""
        measure = take_measure(self._bench, self._known)
        best = min((e for e in self._known if e.inside), key=measure.score)
        most = len(best.added) - (len(best.added) < self._most_effects)
        others = [measure.score(e) for e in self._known if not e.inside and len(e.added) <= most]
        return not measure.rough and min(others, default=np.inf) < measure.score(best) - FOREIGN

    def _believable(self, explanation: Explanation) -> bool:
        """Whether a set is worth another name however much it misses: a single one, of a model that is known."""
        return len(explanation.added) == 1 and not self._bench.problem.may_be_rough

    def _lost(self, explanations: list[Explanation], measure: Measure) -> bool:
        """Whether all of them miss so much of the run that what they call it would not be believed, nor a name more.

        What the validation run shows besides may be what the next name tells.
        """
        least = (MISSES * self._bench.problem.signal) ** 2
        return not measure.rough and all(measure.gaps(e)[0] > least for e in explanations)

    def _exchange(self) -> None:
        measure = take_measure(self._bench, self._known)
        leaders = self._leaders(measure)
        larger = [e for e in leaders if len(e.added) > 1 and not self._needless(e, leaders, measure)]
        if not larger or self._done(self._exchanged, larger[0], measure):
            return
        # Beside an effect that does nothing, those in place of the other are the single ones, known already.
        if len(leaders[0].added) == 1 and _idle(larger[0], leaders[0], measure):
            return
        # One a little behind may have grown from a form of its first effect that the second makes needless; where all
        # that is fitted is fitted refined, none has.
        foremost = larger[: 1 if measure.rough else 2]
        behind = max(_NEAR, LEAD * measure.missed_by(larger[0]))
        near = [e for e in foremost if measure.score(e) - measure.score(larger[0]) < behind]
        for explanation in near:
            self._exchanged[tuple(sorted(explanation.added))] = explanation
            # Every candidate in place of each effect: the order they were found in may have misled the search.
            # Apart: beside one that explains nearly all by itself, what the other is the base of is never looked at.
            for base in parts(self._bench, explanation):
                if not self._alike(base, measure):
                    self._scan([base], measure)
        self._known[:] = distinct(self._bench, self._known)

    def _foremost(self) -> tuple[str, ...]:
        """The names that lead."""
        return tuple(sorted(self._leaders(take_measure(self._bench, self._known))[0].added))

    def _needless(self, larger: Explanation, leaders: list[Explanation], measure: Measure) -> bool:
        """Whether a smaller set leaves so little more that no larger one would be named in its place."""
        if measure.rough:
            return False
        least = measure.left(larger) + WORTH_NOISE * measure.noise
        parts = [e for e in leaders if len(e.added) < len(larger.added) and measure.left(e) <= least]
        return any(not hides(e, larger) and sensible(e, self._bench.problem) for e in parts)

    def _reduce(self) -> None:
        for size in range(self._most_effects, 1, -1):
            measure = take_measure(self._bench, self._known)
            larger = [e for e in self._leaders(measure) if len(e.added) == size][:BEAM]
            larger = [e for e in larger if not self._done(self._lessened, e, measure)]
            self._lessened.update({tuple(sorted(e.added)): e for e in larger})
            self._known[:] = distinct(self._bench, [*self._known, *reduced(self._bench, larger)])

    def _reached(self) -> float:
        return min(e.fit.fitted.cost for e in self._known)

    def _scan(self, bases: list[Explanation], measure: Measure) -> None:
        if bases:
            self._scanned += bases
            found = scan(self._bench, bases, MOST, self._finest, self._reached())
            self._known += recurring(found, self._known, measure)

    def _alike(self, base: Explanation, measure: Measure) -> bool:
        """Whether every effect was added to a set of these names that leaves the same but for a trace.

        One in which the same numbers are free comes to the same from a little further off.
        """
        noise = _TRACE * len(base.fit.residual) * measure.floors[0]
        near = max(noise, _NEARLY * float(np.sum(np.square(base.fit.residual))))
        return any(
            float(np.sum(np.square(e.fit.residual - base.fit.residual))) < (near if _as_free(e, base) else noise)
            for e in self._scanned
            if set(e.added) == set(base.added)
        )


def _as_free(one: Explanation, other: Explanation) -> bool:
    """Whether two sets of the same names have the same numbers free."""
    return all(set(own) == set(other.freed[name]) for name, own in one.freed.items())


def _idle(larger: Explanation, single: Explanation, measure: Measure) -> bool:
    """Whether what a larger set adds to a single effect explains nothing."""
    return set(single.added) <= set(larger.added) and max(measure.told(single, larger)) < IDLE
