"""Names that lead by far and are doubtful all the same."""

from types import SimpleNamespace
from typing import Any

import pytest

from dt_station_nodes.discovery.doubts import DOUBT, crowded, doubted, outdone
from dt_station_nodes.discovery.growth import MISSES

ONE, TWO = ("saturation",), ("hysteresis", "saturation")
MEASURE: Any = SimpleNamespace(rough=False, noise=1.0, left=lambda explanation: explanation.power)


def leaving(power: float, names: tuple[str, ...] = ONE) -> Any:
    return SimpleNamespace(added=names, power=power)


@pytest.mark.parametrize(
    ("names", "left", "rough", "doubted"),
    [
        (("overflow", "hysteresis", "saturation"), 0.3, False, True),
        (("overflow", "hysteresis", "saturation"), 0.1, False, False),
        (("overflow", "hysteresis", "saturation"), 0.3, True, False),
        (("hysteresis", "saturation"), 0.3, False, False),
    ],
)
def test_three_effects_have_to_leave_noise_alone(
    names: tuple[str, ...], left: float, rough: bool, doubted: bool
) -> None:
    assert crowded(names, left, SimpleNamespace(rough=rough, noise=1.0)) is doubted


@pytest.mark.parametrize(
    ("names", "left", "other", "behind", "gap", "doubtful"),
    [
        (ONE, 2.0, 0.3, -2.0 * DOUBT, 50.0, True),
        (ONE, 2.0, 0.5, -2.0 * DOUBT, 50.0, False),
        (TWO, 2.0, 0.3, -2.0 * DOUBT, 50.0, True),
        (TWO, 2.0, 0.3, -0.5 * DOUBT, 50.0, False),
        (TWO, 2.0, 0.3, -2.0 * DOUBT, 1e4, False),
        (TWO, 0.1, 0.01, -2.0 * DOUBT, 5.0, False),
    ],
)
def test_names_are_not_all_where_what_is_not_believed_leaves_a_fraction(
    names: tuple[str, ...], left: float, other: float, behind: float, gap: float, doubtful: bool
) -> None:
    assert outdone(leaving(left, names), gap, [(behind, leaving(other))], MEASURE) is doubtful


@pytest.mark.parametrize(("missed", "rough", "doubtful"), [(0.5, False, False), (2.0, False, True), (2.0, True, False)])
def test_what_misses_much_of_the_signal_has_not_been_understood(missed: float, rough: bool, doubtful: bool) -> None:
    measure: Any = SimpleNamespace(**{**vars(MEASURE), "rough": rough, "missed": lambda _: missed * MISSES})
    assert doubted(leaving(0.1), 50.0, [], measure) is doubtful
