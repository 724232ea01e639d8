"""Sets of effects grown from single ones."""

import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import optimize

sys.path.insert(0, str(Path(__file__).parent))

from cases import Case, make

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import EffectSpec, ModelSpec, PathSimulator
from dt_station_nodes.core.run import Run
from dt_station_nodes.discovery import growth
from dt_station_nodes.discovery.candidates import Candidate, add_effect
from dt_station_nodes.discovery.choice import WORTH_NOISE
from dt_station_nodes.discovery.growth import Growth
from dt_station_nodes.discovery.measure import take_measure
from dt_station_nodes.discovery.problem import Problem, make_problem
from dt_station_nodes.discovery.search import scan
from dt_station_nodes.discovery.selection import Bench, Explanation, fit_null
from dt_station_nodes.discovery.sense import sensible
from dt_station_nodes.discovery.settings import DiscoverySettings
from dt_station_nodes.discovery.terms import nominal_terms

MODEL = Path(__file__).parents[3] / "config" / "models" / "paper.yaml"
PAPER = ModelSpec.from_yaml(MODEL.read_text(encoding="utf-8"))
PAIR = Case((("dead_zone", "position", 1.0), ("delay", "position", 1.0)), seconds=24.0)


@pytest.fixture(scope="module")
def singles() -> tuple[Bench, Explanation, list[Explanation]]:
    problem = make_problem(make(PAIR), PAPER, Channel.POSITION, DiscoverySettings())
    path = PAPER.paths[Channel.POSITION]
    bench = Bench(problem, nominal_terms(path, problem.signal))
    null = fit_null(bench, path)
    return bench, null, [null, *scan(bench, [null], 6, 2)]


def test_one_effect_at_most_leaves_single_ones_as_they_are(
    singles: tuple[Bench, Explanation, list[Explanation]],
) -> None:
    bench, null, found = singles
    known = list(found)
    Growth(bench, null, known, 1).run()
    assert [e.added for e in known] == [e.added for e in found]


def test_the_pair_in_the_run_is_grown_and_nothing_known_gets_worse(
    singles: tuple[Bench, Explanation, list[Explanation]],
) -> None:
    bench, null, found = singles
    known = list(found)
    Growth(bench, null, known, 2).run()
    measure = take_measure(bench, known)
    leader = min((e for e in known if e.inside and e.added), key=measure.score)
    assert set(leader.added) == {"dead_zone", "delay"}
    after = {tuple(sorted(e.added)): measure.score(e) for e in known}
    assert all(after[tuple(sorted(e.added))] <= measure.score(e) + 1e-9 for e in found)


def test_what_has_been_grown_is_not_grown_again(
    singles: tuple[Bench, Explanation, list[Explanation]], monkeypatch: pytest.MonkeyPatch
) -> None:
    bench, null, found = singles
    bases: list[Explanation] = []

    def fruitless(
        _bench: Bench, chosen: list[Explanation], _most: int, _finest: int, _reached: float
    ) -> list[Explanation]:
        bases.extend(chosen)
        return []

    monkeypatch.setattr(growth, "scan", fruitless)
    Growth(bench, null, list(found), 3).run()
    assert bases
    assert len({id(base) for base in bases}) == len(bases)


class Scored:
    """A measure that scores and tells by the numbers that explanations leave."""

    rough = False

    @staticmethod
    def score(explanation: Explanation) -> float:
        return explanation.powers[0]

    @staticmethod
    def told(before: Explanation, after: Explanation) -> list[float]:
        return [before.powers[0] - after.powers[0]]


@pytest.mark.parametrize(("better", "again"), [(0.0, False), (15.0, False), (25.0, True)])
def test_what_was_done_with_a_set_is_done_again_where_it_was_found_so_much_better(
    singles: tuple[Bench, Explanation, list[Explanation]], better: float, again: bool
) -> None:
    former = replace(singles[2][1], added=("delay", "friction"), powers=(100.0,))
    now = replace(former, added=("friction", "delay"), powers=(100.0 - better,))
    done = {tuple(sorted(former.added)): former}
    assert Growth._done(done, now, Scored()) is not again
    assert not Growth._done({}, now, Scored())


@pytest.mark.parametrize(("gain", "idle"), [(4.0, True), (12.0, False)])
def test_an_effect_that_explains_no_more_than_chance_is_idle(
    singles: tuple[Bench, Explanation, list[Explanation]], gain: float, idle: bool
) -> None:
    single = replace(singles[2][1], added=("delay",), powers=(100.0,))
    larger = replace(single, added=("delay", "friction"), powers=(100.0 - gain,))
    assert growth._idle(larger, single, Scored()) is idle
    assert not growth._idle(replace(larger, added=("bias", "friction")), single, Scored())


@pytest.mark.parametrize(("gain", "penalty", "needless"), [(0.1, 0.0, True), (0.5, 0.0, False), (0.1, 20.0, False)])
def test_a_set_whose_part_is_all_that_can_be_named_is_not_exchanged(
    singles: tuple[Bench, Explanation, list[Explanation]], gain: float, penalty: float, needless: bool
) -> None:
    """Unless the part bends nominal parameters that the whole leaves where they were."""
    bench, null, found = singles
    single = replace(found[1], added=("delay",), fit=replace(found[1].fit, penalty=penalty))
    larger = replace(single, added=("delay", "friction"), fit=replace(found[1].fit, penalty=0.0))
    left = {id(larger): 0.0, id(single): gain}
    measure = SimpleNamespace(rough=False, noise=1.0, left=lambda e: left[id(e)])
    growing = Growth(bench, null, [], 3)
    assert growing._needless(larger, [larger, single], measure) is needless
    assert not growing._needless(single, [larger, single], measure)
    measure.rough = True
    assert not growing._needless(larger, [larger, single], measure)


@pytest.mark.parametrize(
    ("rough", "part", "expected"),
    [
        (False, 0.3, ["scan 1", "reduce 2", "exchange 2", "scan 2"]),
        (False, 0.0, ["reduce 2"]),
        (True, 0.3, ["scan 1", "scan 2", "exchange 2", "reduce 2"]),
    ],
    ids=["known", "explained", "rough"],
)
def test_a_pair_is_reduced_and_exchanged_before_it_gets_a_third(
    singles: tuple[Bench, Explanation, list[Explanation]],
    monkeypatch: pytest.MonkeyPatch,
    rough: bool,
    part: float,
    expected: list[str],
) -> None:
    """But in rough data; and not at all where one of its effects explains the run."""
    alone, null, found = singles
    bench = replace(alone, problem=replace(alone.problem, rough=rough))
    power = float(null.fit.residual @ null.fit.residual)
    unbent = replace(found[1].fit, penalty=0.0)
    first = replace(null, powers=(100.0 * power,))
    single = replace(found[1], fit=unbent, powers=(part * power,))
    path = add_effect(found[1].fit.path, Candidate("delay"), {"delay_s": 0.1})
    pair = replace(single, added=(*single.added, "delay"), fit=replace(unbent, path=path), powers=(0.2 * part * power,))
    done: list[str] = []

    def scanned(_bench: Bench, bases: list[Explanation], *_: object) -> list[Explanation]:
        done.append(f"scan {len(bases[0].added)}")
        return [pair] if len(bases[0].added) == 1 else []

    def exchanged(_bench: Bench, leader: Explanation, *_: object) -> list[Explanation]:
        done.append(f"exchange {len(leader.added)}")
        return []

    def reduced(_bench: Bench, larger: list[Explanation]) -> list[Explanation]:
        done.extend(f"reduce {len(e.added)}" for e in larger)
        return []

    monkeypatch.setattr(growth, "scan", scanned)
    monkeypatch.setattr(growth, "parts", exchanged)
    monkeypatch.setattr(growth, "reduced", reduced)
    Growth(bench, first, [first, single, *([] if part else [pair])], 3).run()
    assert done[: len(expected)] == expected
    assert part or len(done) == 1


def paired(singles: tuple[Bench, Explanation, list[Explanation]], left: float = 0.0) -> list[Explanation]:
    """A null and a single effect that leave a hundred times what the null does, and two pairs that leave `left`."""
    _, null, found = singles
    power = float(null.fit.residual @ null.fit.residual)
    first, single = (replace(e, powers=(100.0 * power,)) for e in (null, found[1]))
    pairs = []
    for name, number in (("bias", "bias_v"), ("delay", "delay_s")):
        fit = replace(single.fit, path=add_effect(single.fit.path, Candidate(name), {number: 0.1}))
        pairs.append(replace(single, added=(*single.added, name), fit=fit, powers=(left * power,)))
    return [first, single, *pairs]


@pytest.mark.parametrize(
    ("of_left", "share", "as_free", "again"),
    [
        (False, 0.05, False, False),
        (False, 0.2, False, True),
        (True, 0.005, True, False),
        (True, 0.005, False, True),
        (True, 0.02, True, True),
    ],
)
def test_no_effect_is_exchanged_on_what_leaves_the_same_as_what_each_was_added_to(
    singles: tuple[Bench, Explanation, list[Explanation]],
    monkeypatch: pytest.MonkeyPatch,
    of_left: bool,
    share: float,
    as_free: bool,
    again: bool,
) -> None:
    """Of the noise power, or where the same numbers are free of what is left, between the two.

    A form found beside another effect may be another.
    """
    bench = singles[0]
    first, single, _, pair = paired(singles)
    known = [first, single, pair]
    measure = take_measure(bench, known)
    count = len(bench.problem.measured)
    power = float(np.mean(single.fit.residual**2)) if of_left else measure.floors[0]
    assert 0.005 * float(np.mean(single.fit.residual**2)) > 0.2 * measure.floors[0]
    apart = (share * power) ** 0.5 * np.where(np.arange(count) % 2, 1.0, -1.0)
    freed = single.freed if as_free else {name: (*own, "more") for name, own in single.freed.items()}
    moved = replace(single, freed=freed, fit=replace(single.fit, residual=single.fit.residual + apart))
    other = replace(moved, added=("bias",))
    bases: list[Explanation] = []
    monkeypatch.setattr(growth, "scan", lambda _bench, chosen, *_: bases.extend(chosen) or [])
    monkeypatch.setattr(growth, "parts", lambda *_: [moved, other])
    growing = Growth(bench, first, known, 3)
    growing._scan([single], measure)
    growing._exchange()
    assert any(base is moved for base in bases) is again
    assert any(base is other for base in bases)


@pytest.mark.parametrize(("rough", "taken_apart"), [(False, 2), (True, 1)])
def test_of_two_sets_as_good_both_are_exchanged_unless_all_were_fitted_refined(
    singles: tuple[Bench, Explanation, list[Explanation]],
    monkeypatch: pytest.MonkeyPatch,
    rough: bool,
    taken_apart: int,
) -> None:
    bench = replace(singles[0], problem=replace(singles[0].problem, rough=rough))
    first, single, *pairs = paired(singles)
    leaders: list[Explanation] = []
    monkeypatch.setattr(growth, "parts", lambda _bench, leader: leaders.append(leader) or [])
    Growth(bench, first, [first, single, *pairs], 3)._exchange()
    assert len(leaders) == taken_apart


@pytest.mark.parametrize(("left", "behind", "taken_apart"), [(0.0, 150.0, 1), (1.0, 150.0, 2), (1.0, 2000.0, 1)])
def test_of_two_sets_that_both_miss_much_the_one_a_little_behind_is_exchanged_too(
    singles: tuple[Bench, Explanation, list[Explanation]],
    monkeypatch: pytest.MonkeyPatch,
    left: float,
    behind: float,
    taken_apart: int,
) -> None:
    """A little of what the first of them misses: with it their forms differ, not what they say of the run."""
    bench = singles[0]
    first, single, *pairs = paired(singles, left)
    measure = take_measure(bench, [first, single, *pairs])
    missed = measure.missed_by(pairs[0])
    assert (growth.LEAD * missed > behind) is (taken_apart == 2)

    def lead(power: float) -> float:
        return measure.score(replace(pairs[1], powers=(power,))) - measure.score(pairs[0])

    most = 1e3 * first.powers[0]
    worse = replace(pairs[1], powers=(optimize.brentq(lambda power: lead(power) - behind, pairs[1].powers[0], most),))
    leaders: list[Explanation] = []
    monkeypatch.setattr(growth, "parts", lambda _bench, leader: leaders.append(leader) or [])
    Growth(bench, first, [first, single, pairs[0], worse], 3)._exchange()
    assert len(leaders) == taken_apart


def test_each_part_of_a_set_is_the_base_of_others_by_itself(
    singles: tuple[Bench, Explanation, list[Explanation]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Beside a part that explains nearly all, nothing added to the other would be looked at."""
    bench = singles[0]
    first, single, _, pair = paired(singles)
    one, other = (replace(single, added=(name,)) for name in pair.added)
    scanned: list[list[Explanation]] = []
    monkeypatch.setattr(growth, "scan", lambda _bench, bases, *_: scanned.append(bases) or [])
    monkeypatch.setattr(growth, "parts", lambda *_: [one, other])
    Growth(bench, first, [first, single, pair], 3)._exchange()
    assert [list(map(id, bases)) for bases in scanned] == [[id(one)], [id(other)]]


@pytest.mark.parametrize("better", [True, False])
def test_what_takes_the_place_of_another_is_exchanged_in_its_turn(
    singles: tuple[Bench, Explanation, list[Explanation]], monkeypatch: pytest.MonkeyPatch, better: bool
) -> None:
    bench, null, found = singles
    power = float(null.fit.residual @ null.fit.residual)
    first = replace(null, powers=(100.0 * power,))
    single = replace(found[1], fit=replace(found[1].fit, penalty=0.0), powers=(0.9 * power,))

    def beside(name: str, numbers: dict[str, float], share: float) -> Explanation:
        path = add_effect(single.fit.path, Candidate(name), numbers)
        fit = replace(single.fit, path=path, rss=share * single.fit.rss)
        return replace(single, added=(*single.added, name), fit=fit, powers=(share * power,))

    pair = beside("delay", {"delay_s": 0.1}, 0.3)
    other = beside("bias", {"bias_v": 0.1}, 0.03 if better else 0.6)
    asked: list[str] = []

    def exchanged(_bench: Bench, leader: Explanation) -> list[Explanation]:
        asked.append(leader.added[-1])
        return [replace(single, added=leader.added[-1:])]

    def scanned(_bench: Bench, bases: list[Explanation], *_: object) -> list[Explanation]:
        return [pair] if bases[0] is single else [other]

    monkeypatch.setattr(growth, "parts", exchanged)
    monkeypatch.setattr(growth, "scan", scanned)
    monkeypatch.setattr(growth, "reduced", lambda *_: [])
    monkeypatch.setattr(growth, "distinct", lambda _bench, known: known)
    Growth(bench, first, [first, single], 2).run()
    assert asked == (["delay", "bias"] if better else ["delay"])


def test_two_effects_that_miss_much_of_the_signal_are_not_given_a_third(monkeypatch: pytest.MonkeyPatch) -> None:
    """Random steps of its own that no effect of the library makes: two names leave most of them."""
    run = make(Case((("dead_zone", "position", 1.0),), seconds=24.0))
    walk = np.cumsum(np.random.default_rng(5).choice([-1.0, 1.0], len(run)) * (np.arange(len(run)) % 40 == 0))
    measured = run.signals[Channel.POSITION.signal] + 0.01 * walk
    run = replace(run, signals={**run.signals, Channel.POSITION.signal: measured})
    problem = make_problem(run, PAPER, Channel.POSITION, DiscoverySettings())
    path = PAPER.paths[Channel.POSITION]
    bench = Bench(problem, nominal_terms(path, problem.signal))
    null = fit_null(bench, path)
    known = [null, *scan(bench, [null], 4, 0)]
    sizes: list[int] = []

    def counted(bench: Bench, bases: list[Explanation], _most: int, _finest: int, reached: float) -> list[Explanation]:
        sizes.extend(len(base.added) for base in bases)
        return scan(bench, bases, 2, 0, reached)

    monkeypatch.setattr(growth, "scan", counted)
    Growth(bench, null, known, 3).run()
    measure = take_measure(bench, known)
    pair = min((e for e in known if e.inside and len(e.added) == 2), key=measure.score)
    assert measure.gaps(pair)[0] > (growth.MISSES * problem.signal) ** 2
    assert set(sizes) == {1}


def test_a_pair_that_explains_the_run_is_exchanged_whatever_the_validation_run_shows_besides(
    singles: tuple[Bench, Explanation, list[Explanation]], monkeypatch: pytest.MonkeyPatch
) -> None:
    alone, null, found = singles
    bench = replace(alone, check=alone.problem)
    power = float(null.fit.residual @ null.fit.residual)
    missed = 2.0 * len(alone.problem.measured) * (growth.MISSES * alone.problem.signal) ** 2
    path = add_effect(found[1].fit.path, Candidate("delay"), {"delay_s": 0.1})
    both = replace(found[1], added=(*found[1].added, "delay"), fit=replace(found[1].fit, path=path))
    exchanged: list[tuple[str, ...]] = []

    def noted(_bench: Bench, leader: Explanation, *_: object) -> list[Explanation]:
        exchanged.append(leader.added)
        return []

    monkeypatch.setattr(growth, "parts", noted)
    monkeypatch.setattr(growth, "scan", lambda *_: [])
    monkeypatch.setattr(growth, "reduced", lambda *_: [])
    for powers, expected in (((0.0, missed), 1), ((missed, 0.0), 0)):
        exchanged.clear()
        first = replace(null, powers=(100.0 * power + 9.0 * missed,) * 2, unseen=null.fit.residual)
        single = replace(found[1], powers=first.powers, unseen=first.unseen)
        pair = replace(both, powers=powers, unseen=single.unseen)
        Growth(bench, first, [first, single, pair], 2).run()
        assert len(exchanged) == expected


@pytest.mark.parametrize(
    ("stranger", "ahead", "named", "ends"),
    [
        (("memory",), 150.0, ("delay", "friction"), True),
        (("memory",), 50.0, ("delay", "friction"), False),
        (("memory", "delay"), 150.0, ("delay", "friction"), False),
        (("memory", "delay", "bias"), 150.0, ("delay", "friction", "bias"), True),
    ],
)
def test_a_smaller_set_with_a_stranger_that_is_far_ahead_ends_the_growth(
    singles: tuple[Bench, Explanation, list[Explanation]],
    monkeypatch: pytest.MonkeyPatch,
    stranger: tuple[str, ...],
    ahead: float,
    named: tuple[str, ...],
    ends: bool,
) -> None:
    bench, null, found = singles
    known = [
        replace(found[1], added=names, powers=(left,)) for names, left in ((named, 500.0), (stranger, 500 - ahead))
    ]
    monkeypatch.setattr(growth, "take_measure", lambda *_: Scored())
    assert Growth(bench, null, known, 3)._foreign() is ends


def test_a_name_that_does_not_mean_what_it_says_is_grown_from_although_it_leaves_nothing() -> None:
    """A kink off zero in the form of a dead zone with one edge is none: what makes it is looked for."""
    path = PAPER.paths[Channel.POSITION]
    asymmetric = EffectSpec(name="asymmetric_gain", parameters={"asymmetry": 0.22})
    rig = path.model_copy(update={"effects": (asymmetric, EffectSpec(name="bias", parameters={"bias_v": 0.006}))})
    time_s = np.arange(1200) * 0.02

    def driven(voltage: np.ndarray, seed: int) -> Problem:
        position = PathSimulator(Channel.POSITION, 0.02, voltage, np.zeros(0), 1e6, 0.0).simulate(rig)
        position += 8e-5 * np.random.default_rng(seed).standard_normal(voltage.size)
        run = Run(0.02, {"servo_voltage_v": voltage, "position_m": position})
        return make_problem(run, PAPER, Channel.POSITION, DiscoverySettings())

    problem = driven(0.3 * np.sin(1.4 * time_s), 1)
    bench = Bench(problem, nominal_terms(path, problem.signal), driven(0.3 * np.sign(np.sin(0.9 * time_s)), 2))
    null = fit_null(bench, path)
    known = [null, *scan(bench, [null], 6, 6)]
    measure = take_measure(bench, known)
    alone = min((e for e in known if e.added), key=measure.score)
    assert measure.left(alone) < WORTH_NOISE * measure.noise
    assert not sensible(alone, problem)
    Growth(bench, null, known, 2).run()
    leader = min((e for e in known if e.inside), key=take_measure(bench, known).score)
    assert set(leader.added) == {"bias", "asymmetric_gain"}
    assert sensible(leader, problem)


@pytest.mark.parametrize(("wrong", "scans"), [((0,), [[1], [0]]), ((), [[0]]), ((0, 1, 2), [[0]])])
def test_what_leaves_nothing_under_a_wrong_name_keeps_no_other_from_being_grown_from(
    singles: tuple[Bench, Explanation, list[Explanation]],
    monkeypatch: pytest.MonkeyPatch,
    wrong: tuple[int, ...],
    scans: list[list[int]],
) -> None:
    bench, first, found = singles
    null = replace(first, powers=(1e6 * first.powers[0],))
    floor = bench.floors(first)[0] * len(bench.problem.measured)
    leaders = [replace(e, powers=(left * floor,)) for e, left in zip(found[1:4], (1.1, 30.0, 1e3), strict=True)]
    grown: list[list[int]] = []

    def noted(_bench: Bench, bases: list[Explanation], *_: object) -> list[Explanation]:
        grown.append([next(i for i, e in enumerate(leaders) if e is base) for base in bases])
        return []

    monkeypatch.setattr(growth, "scan", noted)
    monkeypatch.setattr(growth, "sensible", lambda e, _: all(e is not leaders[i] for i in wrong))
    Growth(bench, null, [null, *leaders], 2)._extend(growth.BEAM)
    assert grown == scans
