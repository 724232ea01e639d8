"""What one channel answers where a limit is only come near, where much is left, and where a refit is enough."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import signal

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import ModelSpec, PathSimulator, PathSpec, PlantModel
from dt_station_nodes.core.run import Run
from dt_station_nodes.discovery import DiscoveryResult, DiscoverySettings, Verdict, channel, discover, inspection
from dt_station_nodes.discovery.candidates import Candidate, add_effect, hypothesis
from dt_station_nodes.discovery.channel import Finding
from dt_station_nodes.discovery.choice import BENT
from dt_station_nodes.discovery.hypothesis_fit import fit_hypothesis
from dt_station_nodes.discovery.problem import Problem, make_problem
from dt_station_nodes.discovery.selection import Bench, Explanation, fit_null
from dt_station_nodes.discovery.terms import nominal_terms

PAPER = ModelSpec.from_yaml(
    (Path(__file__).parents[3] / "config" / "models" / "paper.yaml").read_text(encoding="utf-8")
)
STEP_S = 0.02
TIME_S = STEP_S * np.arange(1300)
AXIS = ModelSpec.model_validate(
    {
        "name": "axis",
        "source": "made up",
        "paths": {"position": {"numerator": [2.0], "denominator": [1.0, 23.0, 0.0]}},
    }
)


def found_in(spec: ModelSpec, voltage: np.ndarray, noise_m: float = 1e-5) -> DiscoveryResult:
    """The answer to a run of `spec` (n,) V where the plain axis is known."""
    position = PathSimulator(Channel.POSITION, STEP_S, voltage, np.zeros(0), 0.0, 0.0).simulate(
        spec.paths[Channel.POSITION]
    )
    noise = noise_m * np.random.default_rng(3).standard_normal(voltage.size)
    return discover(Run(STEP_S, {"servo_voltage_v": voltage, "position_m": position + noise}), AXIS)


@pytest.mark.parametrize("knee", [0.2, 0.5])
def test_a_limit_that_the_run_only_comes_near_shows_by_its_bend(knee: float) -> None:
    voltage = 5.5 * signal.sawtooth(2.0 * np.pi * 0.4 * TIME_S, 0.5)
    limited = AXIS.with_effect(Channel.POSITION, "saturation", {"upper_v": 6.0, "lower_v": -6.0, "knee": knee})
    result = found_in(limited, voltage)
    assert [effect.name for effect in result.effects] == ["saturation"]
    assert result.effects[0].parameters["knee"].value == pytest.approx(knee, rel=0.3)


def passing(voltage: np.ndarray, passed: np.ndarray, seed: int) -> Run:
    """A run of a pressure valve that lets so much (n,) V of the voltage (n,) V pass."""
    servo = 0.8 * np.sin(2.0 * np.pi * 0.3 * TIME_S)
    out = PlantModel(PAPER, STEP_S).simulate(passed, servo)
    rng = np.random.default_rng(seed)
    pressure, position = (
        values + 0.01 * np.std(values) * rng.standard_normal(TIME_S.size)
        for values in (out.pressure_pa, out.position_m)
    )
    signals = {"load_voltage_v": voltage, "servo_voltage_v": servo, "pressure_pa": pressure, "position_m": position}
    return Run(STEP_S, signals)


def softened(wave: np.ndarray, seed: int) -> Run:
    """A run of a pressure valve that bends from the start towards a limit of 10 V, five times what the run reaches."""
    voltage = 1.1 + 0.75 * wave
    return passing(voltage, voltage / np.hypot(1.0, voltage / 10.0), seed)


def test_a_limit_far_beyond_the_run_shows_by_how_the_answer_bends_towards_it() -> None:
    check = softened(signal.sawtooth(2.0 * np.pi * 0.1 * TIME_S), 2)
    (limit,) = discover(softened(np.sin(2.0 * np.pi * 0.13 * TIME_S), 1), PAPER, validation=check).effects
    assert limit.name == "saturation"
    assert limit.parameters["upper_v"].value > 3.5 * 1.85


def bent_off(wave: np.ndarray, top_v: float, seed: int) -> Run:
    """A run of a pressure valve that bends to its limit over a parabola, which no form of a limit does."""
    voltage = 0.5 * top_v * (1.0 + wave)
    bent = np.minimum(voltage, 3.3)
    return passing(voltage, np.where(voltage < 2.3, voltage, bent - (bent - 2.3) ** 2 / 2.0), seed)


def test_between_forms_that_both_miss_the_same_bend_no_lead_decides() -> None:
    turns = 2.0 * np.pi * 0.4 * TIME_S
    check = bent_off(signal.sawtooth(turns, 0.5), 4.0, 2)
    (limit,) = discover(bent_off(np.sin(turns), 3.05, 1), PAPER, validation=check).effects
    assert {limit.name, *limit.alternatives} == {"saturation", "overflow"}
    assert limit.confidence < 0.6


def test_a_linear_path_that_fits_to_a_hundredth_lacks_nothing_with_a_name(monkeypatch: pytest.MonkeyPatch) -> None:
    """An oscillator read a twentieth of a sample early: no path of its order can lead, and nothing is missing.

    That shows in the null: the model is not searched as a known one first.
    """
    looks: list[bool] = []
    examine = inspection.examine

    def counted(problem: Problem, *rest: Any) -> Finding:
        looks.append(problem.rough)
        return examine(problem, *rest)

    monkeypatch.setattr(inspection, "examine", counted)
    fine, n = 20, 3000
    drive = np.repeat(np.random.default_rng(8).standard_normal(n // 5), 5)
    b, a = signal.butter(2, 6.0 * 2.0 * STEP_S, fs=2.0)
    mode = signal.cont2discrete(([180.0], [1.0, 2.0, 180.0]), STEP_S / fine, "zoh")
    answer = signal.lfilter(np.ravel(mode[0]), mode[1], np.repeat(signal.lfilter(b, a, drive), fine))
    early = answer[1::fine]
    run = Run(STEP_S, {"servo_voltage_v": signal.lfilter(b, a, drive)[: early.size], "position_m": early})
    model = {"name": "m", "paths": {"position": {"numerator": [140.0], "denominator": [1.0, 2.5, 200.0]}}}
    result = discover(run, ModelSpec.model_validate(model))
    assert (result.verdict, looks) == (Verdict.PARAMETERS_ONLY, [True])


def bench_for(path: PathSpec) -> Bench:
    """What a run of a path is examined with where the plain axis is known."""
    voltage = 1.5 * np.sin(2.0 * np.pi * 0.4 * TIME_S)
    position = PathSimulator(Channel.POSITION, STEP_S, voltage, np.zeros(0), 0.0, 0.0).simulate(path)
    noise = 1e-4 * np.random.default_rng(3).standard_normal(voltage.size)
    run = Run(STEP_S, {"servo_voltage_v": voltage, "position_m": position + noise})
    problem = make_problem(run, AXIS, Channel.POSITION, DiscoverySettings())
    return Bench(problem, nominal_terms(path, problem.signal))


def fitted(bench: Bench, path: PathSpec) -> Explanation:
    """The effects of a path fitted in their plain forms."""
    names = tuple(effect.name for effect in path.effects)
    freed = {name: Candidate(name).required for name in names}
    fit = fit_hypothesis(bench.problem, hypothesis(bench.problem, path, bench.nominal, freed), iterations=20)
    return bench.judged(bench.explained(fit, names, freed))


def test_effects_are_added_to_single_ones_that_were_grown_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    """A loop on two levels has many forms: where one of them foretells the other run, nothing is to be added to it."""
    path = AXIS.paths[Channel.POSITION]
    lapped = add_effect(path, Candidate("dead_zone"), {"half_width_v": 0.3})
    bench = bench_for(lapped)
    found, anew = fitted(bench, lapped), fitted(bench, lapped)
    added_to: list[Explanation] = []

    class Grown:
        def __init__(self, *given: Any) -> None:
            added_to.extend(given[2])

        def run(self) -> None:
            pass

    passed_on: list[list[Explanation]] = []

    def regrown(
        *given: Any, where_full: bool = False, begun: Sequence[Explanation] = ()
    ) -> tuple[list[Explanation], list[Explanation]]:
        passed_on.append(list(begun))
        return [anew if e is found and where_full else e for e in given[2]], [*begun, found]

    monkeypatch.setattr(channel, "scan", lambda *_: [found])
    monkeypatch.setattr(channel, "regrown", regrown)
    monkeypatch.setattr(channel, "Growth", Grown)
    channel.examine(bench.problem, path, DiscoverySettings())
    assert [e is anew for e in added_to if e.added] == [True]
    assert passed_on == [[], [found]]


@pytest.mark.parametrize(("others", "verdict"), [(5, Verdict.NAMED), (6, Verdict.UNEXPLAINED)])
def test_a_name_in_whose_place_six_others_could_stand_is_none(
    monkeypatch: pytest.MonkeyPatch, others: int, verdict: Verdict
) -> None:
    path = AXIS.paths[Channel.POSITION]
    lapped = add_effect(path, Candidate("dead_zone"), {"half_width_v": 0.3})
    bench = bench_for(lapped)
    null, one = fit_null(bench, path), fitted(bench, lapped)
    monkeypatch.setattr(channel, "alternatives", lambda *_: (tuple(f"name {k}" for k in range(others)),))
    given = bench.problem.residual(path)
    assert channel._decide(bench, given, null, [null, one], False).verdict is verdict


@pytest.mark.parametrize(
    ("second", "numbers", "kept"),
    [("extra_lag", {"time_constant_s": 0.06}, True), ("bias", {"bias_v": 0.004}, False)],
)
def test_fewer_effects_that_need_parameters_far_off_do_not_stand_for_more(
    monkeypatch: pytest.MonkeyPatch, second: str, numbers: dict[str, float], kept: bool
) -> None:
    """Three names could stand in the place of the second of two effects; one alone bends a time constant, or none."""
    path = AXIS.paths[Channel.POSITION]
    lapped = add_effect(path, Candidate("dead_zone"), {"half_width_v": 0.3})
    whole = add_effect(lapped, Candidate(second), numbers)
    bench = bench_for(whole)
    null, one, two = fit_null(bench, path), fitted(bench, lapped), fitted(bench, whole)
    assert (one.fit.penalty - two.fit.penalty > BENT) is kept
    monkeypatch.setattr(channel, "alternatives", lambda best, _: ((),) * (len(best.added) - 1) + (("a", "b", "c"),))
    monkeypatch.setattr(channel, "with_namesakes", lambda _, instead, *__: instead)
    finding = channel._decide(bench, bench.problem.residual(path), null, [null, one, two], False)
    assert finding.verdict is Verdict.NAMED
    assert finding.best.added == (two.added if kept else one.added)
