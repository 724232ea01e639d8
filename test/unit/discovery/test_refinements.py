"""Refined forms: which numbers are tried together, and a contact of which only that finds the way."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))

from cases import Case, make

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import ModelInput, ModelSpec, PlantModel
from dt_station_nodes.core.models.effects import Attachment
from dt_station_nodes.core.run import Run
from dt_station_nodes.discovery import DiscoverySettings, Verdict, discover
from dt_station_nodes.discovery.candidates import Candidate, add_effect
from dt_station_nodes.discovery.problem import make_problem
from dt_station_nodes.discovery.refinements import ANSWER, GRIP, refinements, step_starts

MODEL = Path(__file__).parents[3] / "config" / "models" / "paper.yaml"
PAPER = ModelSpec.from_yaml(MODEL.read_text(encoding="utf-8"))
BARE = ModelSpec(
    name="axis", paths={Channel.POSITION: PAPER.paths[Channel.POSITION].model_copy(update={"effects": ()})}
)


def hunting(shape: np.ndarray, **friction: float) -> Run:
    """A slow loop about a set-point (m) whose piston sticks and slips."""
    plant = PlantModel(BARE.with_effect(Channel.POSITION, "friction", friction), 0.02)
    state, noise = plant.initial_state(), 5e-5 * np.random.default_rng(4).standard_normal(len(shape))
    volts, moved = np.zeros(len(shape)), np.zeros(len(shape))
    for k, wanted in enumerate(shape):
        moved[k] = plant.output(state).position_m + noise[k]
        volts[k] = np.clip(140.0 * (wanted - moved[k]), -10.0, 10.0)
        state, _ = plant.step(state, ModelInput(0.0, float(volts[k]), 1e6))
    return Run(0.02, {"servo_voltage_v": volts, "position_m": moved})


def test_what_grips_more_at_rest_is_tried_as_one() -> None:
    path, candidate = PAPER.paths[Channel.POSITION], Candidate("friction")
    problem = make_problem(make(Case(seconds=12.0)), PAPER, Channel.POSITION, DiscoverySettings())
    plain = add_effect(path, candidate, {"coulomb_v": 0.4})
    forms = refinements(problem, plain, candidate, problem.residual(plain))
    assert GRIP in forms.steps
    assert not any(name in GRIP for names in forms.steps for name in names if names != GRIP)
    starts = [start.effect("friction").parameters for start in step_starts(plain, forms, GRIP)]
    assert all(p["static_excess_v"] > 0.0 and p["stribeck_velocity"] > 0.0 for p in starts)
    sizes = [p["coulomb_v"] for p in starts]
    assert min(sizes) < 0.5 * 0.4 + 1e-9
    assert max(sizes) > 0.4 - 1e-9


def test_a_spring_that_answers_late_is_begun_about_no_pressure_with_its_stiffening_too() -> None:
    path, candidate = PAPER.paths[Channel.PRESSURE], Candidate("cubic_stiffness", Attachment.OUTPUT)
    problem = make_problem(make(Case(seconds=12.0)), PAPER, Channel.PRESSURE, DiscoverySettings())
    plain = add_effect(path, candidate, {"coefficient": 7e-21, "centre": -1.7e6})
    forms = refinements(problem, plain, candidate, problem.residual(plain))
    assert {(ANSWER,), (ANSWER, "stiffening")} <= set(forms.steps)
    for names in ((ANSWER,), (ANSWER, "stiffening")):
        starts = [start.effect("cubic_stiffness").parameters for start in step_starts(plain, forms, names)]
        assert starts
        assert all(numbers[ANSWER] > 0.0 and numbers["centre"] == 0.0 for numbers in starts)


def test_a_piston_that_hunts_is_friction_with_its_numbers() -> None:
    time_s = 0.02 * np.arange(1200)
    true = {"coulomb_v": 0.52, "static_excess_v": 0.31, "stribeck_velocity": 0.0093}
    slow = 0.016 * (2.0 * np.abs((0.35 * time_s) % 2.0 - 1.0) - 1.0)
    result = discover(hunting(slow, **true), BARE, settings=DiscoverySettings(max_effects=1))
    assert [effect.name for effect in result.effects] == ["friction"]
    found = result.effects[0].parameters
    for name, value in true.items():
        assert abs(found[name].value - value) < 0.1 * value


@pytest.mark.parametrize(
    ("channel", "candidate", "plain", "pair"),
    [
        (Channel.PRESSURE, Candidate("overflow", Attachment.OUTPUT), {"limit": 3e6}, ("rounding", "override")),
        (Channel.POSITION, Candidate("cross_coupling"), {"share": 0.05}, ("lag_s", "changes")),
        (Channel.POSITION, Candidate("delay"), {"delay_s": 0.05}, ("stretch_per_v", "stretch_levels_v")),
    ],
    ids=[
        "a soft bend and what passes it",
        "changes that cross over and the lag they fade with",
        "a flow that makes a delay shorter and where that ends",
    ],
)
def test_what_comes_together_is_tried_together(
    channel: Channel, candidate: Candidate, plain: dict[str, float], pair: tuple[str, str]
) -> None:
    problem = make_problem(make(Case(seconds=12.0)), PAPER, channel, DiscoverySettings())
    path = add_effect(PAPER.paths[channel], candidate, plain)
    forms = refinements(problem, path, candidate, problem.residual(path))
    assert pair in forms.steps
    starts = [start.effect(candidate.name).parameters for start in step_starts(path, forms, pair)]
    neutral = {name: candidate.effect.parameter(name).neutral for name in pair}
    assert any(all(p[name] != neutral[name] for name in pair) for p in starts)
    assert any(all(p[name] == neutral[name] for name in pair) for p in starts)


def test_what_a_load_presses_on_is_tried_where_a_load_moves_only() -> None:
    candidate, path = Candidate("friction"), PAPER.paths[Channel.POSITION]
    run = make(Case(seconds=12.0))
    still = Run(run.sample_time_s, {**run.signals, "pressure_pa": np.full(len(run), 2e6)})
    names = {}
    for key, one in (("moving", run), ("still", still)):
        problem = make_problem(one, PAPER, Channel.POSITION, DiscoverySettings())
        plain = add_effect(path, candidate, {"coulomb_v": 0.4})
        names[key] = refinements(problem, plain, candidate, problem.residual(plain)).names
    assert "per_load" in names["moving"]
    assert "per_load" not in names["still"]


def test_a_fine_difference_is_not_sought_in_rough_data() -> None:
    path, candidate = PAPER.paths[Channel.PRESSURE], Candidate("saturation")
    problem = make_problem(make(Case(seconds=12.0)), PAPER, Channel.PRESSURE, DiscoverySettings())
    plain = add_effect(path, candidate, {"upper_v": 3.0, "lower_v": -3.0})
    clean, rough = (refinements(problem, plain, candidate, problem.residual(plain), timed=t) for t in (True, False))
    assert set(clean.names) - set(rough.names) == {"straight", "centre_v"}


def test_one_of_a_few_lags_may_come_before_a_limit_and_which_of_many_is_not_asked() -> None:
    candidate, run = Candidate("saturation"), make(Case(seconds=12.0))
    few = PAPER.with_path(Channel.PRESSURE, numerator=(1.0,), denominator=(0.0012, 0.08, 1.0), effects=())
    tried = []
    for spec in (PAPER, few):
        problem = make_problem(run, spec, Channel.PRESSURE, DiscoverySettings())
        plain = add_effect(spec.paths[Channel.PRESSURE], candidate, {"upper_v": 3.0, "lower_v": -3.0})
        tried.append(refinements(problem, plain, candidate, problem.residual(plain)))
    of_many, of_few = tried
    assert "behind_s" not in of_many.names
    assert of_few.grids["behind_s"] == pytest.approx([0.02, 0.06])


def test_iron_that_saturates_behind_its_coils_lag_is_a_limit_with_its_numbers() -> None:
    coil_s, volume_s, step_s, fine = 0.022, 0.055, 0.005, 20
    rng = np.random.default_rng(9)
    volts = np.repeat(rng.uniform(0.0, 10.0, 40), 30)
    current, pressure, measured = 0.0, 0.0, np.zeros(len(volts))
    for k, drive in enumerate(volts):
        measured[k] = pressure
        for _ in range(fine):
            current += step_s / fine / coil_s * (drive - current)
            pressure += step_s / fine / volume_s * (min(current, 6.2) - pressure)
    measured += 0.01 * rng.standard_normal(len(volts))
    crude = {"numerator": [1.15], "denominator": [0.019 * 0.062, 0.019 + 0.062, 1.0]}
    spec = ModelSpec.model_validate({"name": "crude", "paths": {Channel.PRESSURE: crude}})
    found = discover(Run(step_s, {"load_voltage_v": volts, "pressure_pa": measured}), spec)
    (effect,) = found.effects
    assert (effect.name, found.verdict) == ("saturation", Verdict.NAMED)
    assert effect.parameters["upper_v"].value == pytest.approx(6.2, rel=0.01)
    assert effect.parameters["behind_s"].value == pytest.approx(coil_s, rel=0.1)


def test_a_loop_of_relays_is_sought_alone_as_one_form() -> None:
    path, candidate = PAPER.paths[Channel.POSITION], Candidate("hysteresis")
    problem = make_problem(make(Case(seconds=12.0)), PAPER, Channel.POSITION, DiscoverySettings())
    plain = add_effect(path, candidate, {"half_width_v": 0.2})
    residual = problem.residual(plain)
    alone, beside = (refinements(problem, plain, candidate, residual, alone=a) for a in (True, False))
    assert ("spread", "depth", "bend_per_v", "steepness") in alone.steps
    assert set(alone.names) - set(beside.names) == {"bend_per_v", "steepness"}
    assert not any("bend_per_v" in names for names in beside.steps)


def test_a_linkage_that_gives_is_a_form_of_its_own() -> None:
    path, candidate = PAPER.paths[Channel.PRESSURE], Candidate("backlash", Attachment.INPUT)
    problem = make_problem(make(Case(seconds=12.0)), PAPER, Channel.PRESSURE, DiscoverySettings())
    plain = add_effect(path, candidate, {"half_width": 0.2})
    forms = refinements(problem, plain, candidate, problem.residual(plain))
    # Beside joints, drag and a soft contact it would be any loop.
    assert {"spread", "lag_s", "coast_s"} <= set(forms.names)
    assert "give" not in forms.names
    assert ("give",) in forms.steps
    assert {start.effect("backlash").parameters["give"] for start in step_starts(plain, forms, ("give",))} == {0.0, 0.1}


def test_a_flow_that_turns_turbulent_begins_as_large_where_the_run_goes() -> None:
    path, candidate = PAPER.paths[Channel.POSITION], Candidate("leakage")
    problem = make_problem(make(Case(seconds=12.0)), PAPER, Channel.POSITION, DiscoverySettings())
    plain = add_effect(path, candidate, {"coefficient": 1e-10, "sag_per_s": 0.1})
    forms = refinements(problem, plain, candidate, problem.residual(plain))
    starts = [start.effect("leakage").parameters for start in step_starts(plain, forms, ("sag_bend",))]
    bent = [p for p in starts if p["sag_bend"] > 0.0]
    assert bent
    (lengths,) = candidate.effect.parameter("sag_bend").starts
    for start in bent:
        reach = lengths / start["sag_bend"]
        flow = start["sag_per_s"] * reach / (1.0 + start["sag_bend"] * reach) ** 0.5
        assert abs(flow - 0.1 * reach) < 1e-9
    assert any(p["sag_per_s"] == 0.1 and p["sag_bend"] == 0.0 for p in starts)


def test_a_loop_of_exponentials_begins_as_wide_as_the_plain_one() -> None:
    path, candidate = PAPER.paths[Channel.PRESSURE], Candidate("hysteresis")
    problem = make_problem(make(Case(seconds=12.0)), PAPER, Channel.PRESSURE, DiscoverySettings())
    plain = add_effect(path, candidate, {"half_width_v": 0.05})
    forms = refinements(problem, plain, candidate, problem.residual(plain))
    names = ("bouc_wen", "depth", "way_back")
    assert names in forms.steps
    starts = [start.effect("hysteresis").parameters for start in step_starts(plain, forms, names)]
    loops = [p for p in starts if p["bouc_wen"] == p["way_back"] == 1.0]
    assert {p["depth"] for p in loops} == {1.0, *candidate.effect.parameter("depth").starts}
    for loop in loops:
        assert abs(loop["half_width_v"] * loop["depth"] - 0.05) < 1e-12
