"""The least-squares descent."""

import numpy as np
import pytest
from numpy.typing import NDArray

from dt_station_nodes.discovery.fit import Fitted, least_squares

Array = NDArray[np.float64]
BOUNDS = np.array([-5.0, -5.0]), np.array([5.0, 5.0])


def valley(x: Array) -> Array:
    """Rosenbrock's, and a floor of 1 that no point gets below."""
    return np.array([10.0 * (x[1] - x[0] ** 2), 1.0 - x[0], 1.0])


def descend(rival: float = np.inf, iterations: int = 40) -> Fitted:
    return least_squares(
        valley, np.array([-1.9, 2.0]), *BOUNDS, np.array([1e-6, 1e-6]), iterations, tolerance=1e-9, rival=rival
    )


def test_the_bottom_of_a_bent_valley_is_found() -> None:
    assert descend().x == pytest.approx([1.0, 1.0], abs=1e-4)


def test_a_descent_that_cannot_catch_up_is_given_up() -> None:
    whole, short = descend(), descend(rival=0.5)
    assert short.evaluations < whole.evaluations
    assert short.cost > 0.5


def test_a_rival_that_is_worse_changes_nothing() -> None:
    whole, beside = descend(), descend(rival=1e3)
    assert np.array_equal(whole.x, beside.x)
    assert whole.evaluations == beside.evaluations


def test_without_iterations_a_point_stays_and_knows_its_slopes() -> None:
    stays = descend(iterations=0)
    assert stays.x == pytest.approx([-1.9, 2.0])
    assert stays.jacobian == pytest.approx(np.array([[38.0, 10.0], [-1.0, 0.0], [0.0, 0.0]]), abs=1e-3)
    assert not stays.idle.any()


def near_a_line(x: Array) -> Array:
    """One number that does the same wherever it is, and one that does not."""
    return np.array([x[0] - 1.0 + 0.2 * np.tanh(x[1]), 0.5 * x[0] + x[1] ** 2 - 1.5, 0.2])


def test_slopes_that_last_are_taken_once_and_lead_to_the_same_place() -> None:
    start, steps = np.array([0.8, 0.9]), np.array([1e-6, 1e-6])
    anew = least_squares(near_a_line, start, *BOUNDS, steps, 12, tolerance=1e-9)
    kept = least_squares(near_a_line, start, *BOUNDS, steps, 12, tolerance=1e-9, lasting=1)
    assert kept.x == pytest.approx(anew.x, abs=1e-4)
    assert kept.evaluations < anew.evaluations


def test_slopes_are_taken_anew_where_the_cost_has_halved() -> None:
    """The slope at the beginning is six times that at the end: with it alone the way would be crept down."""
    steps = np.array([1e-6])
    found = least_squares(lambda x: x**3 - 8.0, np.array([5.0]), *np.array([[-5.0], [5.0]]), steps, 8, lasting=1)
    assert found.x == pytest.approx([2.0], abs=1e-3)


def test_slopes_of_a_coarse_model_lead_to_where_the_fine_one_is_least() -> None:
    asked = {"fine": 0, "coarse": 0}

    def fine(x: Array) -> Array:
        asked["fine"] += 1
        return valley(x)

    def coarse(x: Array) -> Array:
        asked["coarse"] += 1
        return 1.02 * valley(x) + 0.3

    start, steps = np.array([-1.9, 2.0]), np.array([1e-6, 1e-6])
    found = least_squares(fine, start, *BOUNDS, steps, 40, tolerance=1e-9, coarse=coarse)
    assert found.x == pytest.approx([1.0, 1.0], abs=1e-4)
    assert found.cost == pytest.approx(1.0, abs=1e-6)
    assert np.array_equal(found.residual, valley(found.x))
    assert asked["coarse"] > asked["fine"]
    assert found.evaluations == sum(asked.values())


def test_a_point_that_stays_knows_its_slopes_as_they_are_however_coarse_others_are() -> None:
    steps = np.array([1e-6, 1e-6])
    stays = least_squares(valley, np.array([-1.9, 2.0]), *BOUNDS, steps, 0, coarse=lambda x: 2.0 * valley(x))
    assert stays.jacobian == pytest.approx(np.array([[38.0, 10.0], [-1.0, 0.0], [0.0, 0.0]]), abs=1e-3)
