"""The fuzzy surface against scikit-fuzzy's own inference, and what its rules promise."""

import os
import time
from pathlib import Path

import numpy as np
import pytest
import skfuzzy
from hypothesis import given
from hypothesis import strategies as st
from skfuzzy import control as library

from dt_station_nodes.core.control import ControlError, ControlInput, LoopConfig, LoopController, infer, surface
from dt_station_nodes.core.control.fuzzy_config import trapezoid

CONTROLLERS = Path(__file__).resolve().parents[4] / "config" / "controllers"
# scikit-fuzzy 0.5.0 calls numpy in a way that numpy 2.4 frowns upon.
pytestmark = pytest.mark.filterwarnings("ignore:Passing more than 2 positional:DeprecationWarning")
NAMES = ["position_fuzzy", "position_fuzzy_integral", "position_fuzzy_tuned"]


def load(name: str = "position_fuzzy") -> LoopConfig:
    return LoopConfig.from_yaml((CONTROLLERS / f"{name}.yaml").read_text(encoding="utf-8"))


FUZZY = load().fuzzy
TEXT = (CONTROLLERS / "position_fuzzy.yaml").read_text(encoding="utf-8")


def library_controller(config) -> library.ControlSystemSimulation:
    """The same controller built with nothing but scikit-fuzzy."""

    def fill(variable, spec):
        for name, corners in spec.terms.items():
            variable[name] = skfuzzy.trapmf(variable.universe, trapezoid(corners))
        return variable

    def axis(spec):
        return np.linspace(*spec.range, 3001)

    error = fill(library.Antecedent(axis(config.error), "error"), config.error)
    pressure = fill(library.Antecedent(axis(config.load), "load"), config.load)
    voltage = fill(library.Consequent(axis(config.voltage), "voltage", "centroid"), config.voltage)
    rules = [library.Rule(error[e] & pressure[p], voltage[u]) for e, p, u in config.rule_list()]
    return library.ControlSystemSimulation(library.ControlSystem(rules))


@pytest.mark.parametrize("name", NAMES)
def test_surface_is_within_half_a_percent_of_the_library_s_inference(name) -> None:
    config = load(name).fuzzy
    reference = library_controller(config)
    table = surface(config)
    rng = np.random.default_rng(7)
    span = config.voltage.range[1] - config.voltage.range[0]
    errors = rng.uniform(*config.error.range, 40)
    errors[:20] *= 0.1  # half of them where a held piston lives
    for error, pressure in zip(errors, rng.uniform(*config.load.range, 40), strict=True):
        reference.input["error"], reference.input["load"] = error, pressure
        reference.compute()
        assert table.at(error, pressure) == pytest.approx(reference.output["voltage"], abs=0.005 * span)


@pytest.mark.parametrize("name", NAMES)
def test_interpolation_error_is_bounded_everywhere(name) -> None:
    config = load(name).fuzzy
    table = surface(config)
    rng = np.random.default_rng(8)
    errors, loads = rng.uniform(*config.error.range, 4000), rng.uniform(*config.load.range, 4000)
    exact = infer(config, errors, loads)
    got = np.array([table.at(e, p) for e, p in zip(errors, loads, strict=True)])
    span = config.voltage.range[1] - config.voltage.range[0]
    assert np.abs(got - exact).max() <= 0.003 * span


def test_surface_meets_the_inference_at_its_grid_points() -> None:
    table = surface(FUZZY)
    for i in range(0, len(table.error), 17):
        got = [table.at(table.error[i], p) for p in table.load]
        np.testing.assert_allclose(got, table.values[i], atol=1e-12)


@pytest.mark.parametrize("name", NAMES)
def test_no_error_asks_for_exactly_no_voltage_at_any_load(name) -> None:
    table = surface(load(name).fuzzy)
    assert {table.at(0.0, p) for p in np.linspace(-1.0, 9.0, 101)} == {0.0}


@given(st.floats(-8.0, 8.0), st.floats(-1.0, 8.0))
def test_surface_is_odd_in_the_error(error, pressure) -> None:
    table = surface(FUZZY)
    assert table.at(error, pressure) == pytest.approx(-table.at(-error, pressure), abs=1e-9)


@given(st.floats(-8.0, 8.0), st.floats(0.0, 1.0), st.floats(-1.0, 8.0))
def test_more_error_never_asks_for_less(error, more, pressure) -> None:
    # A centre of gravity ripples where plateaus meet; it must never turn back by more than a hair.
    table = surface(FUZZY)
    assert table.at(error + more, pressure) >= table.at(error, pressure) - 0.02


def test_inputs_beyond_the_range_are_held_at_its_edge() -> None:
    table = surface(FUZZY)
    assert table.at(99.0, 99.0) == table.at(FUZZY.error.range[1], FUZZY.load.range[1])
    assert table.at(-99.0, -99.0) == table.at(FUZZY.error.range[0], FUZZY.load.range[0])


def test_surface_is_deterministic_shared_and_quick() -> None:
    assert surface(FUZZY) is surface(FUZZY.model_copy(update={"output_gain": 2.0, "integral_gain": 1.0}))
    other = FUZZY.model_copy(update={"grid": (121, 21)})
    start = time.process_time()
    fresh = type(surface(FUZZY))(other)
    assert time.process_time() - start < 1.0
    assert (fresh.values == type(fresh)(other).values).all()


def step_voltages(config: LoopConfig, errors, pressure=2e6) -> list[float]:
    controller = LoopController(config, 0.02)
    state, out = controller.initial_state(), []
    for error in errors:
        state, answer = controller.step(state, ControlInput(error, 0.0, pressure))
        out.append(answer.voltage_v)
    return out


def test_law_is_the_surface_in_the_rules_units_and_scaled_by_its_gains() -> None:
    scaled = load().changed(
        fuzzy=FUZZY.model_copy(update={"error_gain": 2.0, "output_gain": 0.5, "load_gain": 1.5}), limits={}
    )
    assert step_voltages(scaled, [0.013]) == [0.5 * surface(FUZZY).at(2.0 * 1.3, 1.5 * 2.0)]


def test_integrating_term_grows_with_the_error_it_has_seen() -> None:
    config = load().changed(fuzzy=FUZZY.model_copy(update={"integral_gain": 3.0}), limits={})
    got = np.array(step_voltages(config, [0.01] * 50))
    np.testing.assert_allclose(np.diff(got), 3.0 * 0.02 * 1.0, atol=1e-12)


def test_error_lead_answers_the_rate_and_leaves_a_steady_error_alone() -> None:
    led = load().changed(fuzzy=FUZZY.model_copy(update={"error_lead_s": 0.02}), limits={})
    got = step_voltages(led, [0.0, 0.01, 0.01])
    table = surface(FUZZY)
    assert got == pytest.approx([table.at(0.0, 2.0), table.at(2.0, 2.0), table.at(1.0, 2.0)])


def test_a_pure_one_drifts_and_the_integrating_one_does_not() -> None:
    """A leaking piston: constant drift against the valve, as under a constant load."""
    settled = {}
    for name in ("position_fuzzy", "position_fuzzy_integral"):
        controller = LoopController(load(name), 0.02)
        state, y, v = controller.initial_state(), 0.05, 0.0
        for _ in range(3000):
            state, out = controller.step(state, ControlInput(0.05, y, 2e6))
            for _ in range(10):
                v += 0.002 / 0.0428 * (0.0884 * out.voltage_v - 0.01 - v)
                y += 0.002 * v
        settled[name] = abs(0.05 - y)
    assert settled["position_fuzzy"] > 1e-5
    assert settled["position_fuzzy_integral"] < 1e-8


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("zero:            [-2.0, 0.0, 2.0]", "zero: [-2.0, 3.0, 2.0]", "term zero needs corners in rising order"),
        ("[-2.0, 0.0, 2.0]", "[-2.0, 0.0]", "zero"),
        ("medium: [1.0, 3.0, 5.0]", "medium: [1.0, 1.5, 2.0]", "no term of load covers 3"),
        ("{slight: hold,          medium: hold,          heavy: hold}", "{slight: hold}", "lacks the load term medium"),
        ("{slight: down,          medium", "{slight: sideways, medium", "names the voltage sideways"),
        ("range: [0.0, 6.0]", "range: [6.0, 0.0]", "range must go up"),
    ],
)
def test_mistakes_in_the_rules_are_named(old, new, says) -> None:
    assert old in TEXT
    with pytest.raises(ControlError) as caught:
        LoopConfig.from_yaml(TEXT.replace(old, new), "mine.yaml")
    assert says in str(caught.value)


@pytest.mark.timing
@pytest.mark.parametrize("name", ["pressure_pi", "position_pid", "position_fuzzy"])
def test_a_step_costs_less_than_120_multiplications(name) -> None:
    """Under 5 µs where Python multiplies and adds in 40 ns; a slower machine is slower at both."""
    if os.getloadavg()[0] > (os.cpu_count() or 1):
        pytest.skip("the machine is too busy to judge a step of microseconds")
    controller = LoopController(load(name), 0.001)
    state, given_input = controller.initial_state(), ControlInput(0.01, 0.0, 2e6)
    steps_s = multiplications_s = 1.0
    # The least of many short spells of both in turn: a busy neighbour lasts longer than a few of them.
    for _ in range(300):
        start = time.perf_counter()
        for _ in range(200):
            state, _ = controller.step(state, given_input)
        steps_s = min(steps_s, (time.perf_counter() - start) / 200)
        x, start = 0.0, time.perf_counter()
        for _ in range(2000):
            x = 0.5 * x + 1.0
        multiplications_s = min(multiplications_s, (time.perf_counter() - start) / 2000)
    assert steps_s < 120 * multiplications_s
