"""Quantities as people write them."""

import math

import pytest

from dt_station_nodes.core.latency import LatencyHistogram
from dt_station_nodes.core.units import UNITS, QuantityError, parse_quantity


@pytest.mark.parametrize(
    ("text", "dimension", "value"),
    [
        ("2MPa", "pressure", 2e6),
        ("2 MPa", "pressure", 2e6),
        ("-1.5e1bar", "pressure", -1.5e6),
        ("3cm", "length", 0.03),
        ("2mm", "length", 0.002),
        ("0.5Hz", "frequency", 0.5),
        ("20ms", "time", 0.02),
        ("5min", "time", 300.0),
        ("90deg", "angle", math.pi / 2),
        ("30%", "ratio", 0.3),
        ("7", "length", 7.0),
        ("5µm", "length", 5e-6),
    ],
)
def test_read(text, dimension, value):
    assert parse_quantity(text, dimension) == value


@pytest.mark.parametrize(
    ("text", "dimension", "word"),
    [("2MPa", "length", "pressure"), ("2", "nothing", None), ("zwei", "length", "number"), ("2ells", "length", "ells")],
)
def test_refused_in_a_sentence(text, dimension, word):
    if word is None:
        with pytest.raises(KeyError):
            parse_quantity(text, dimension)
        return
    with pytest.raises(QuantityError, match=word):
        parse_quantity(text, dimension)


def test_the_si_unit_comes_first_with_factor_one():
    assert all(next(iter(units.values())) == 1.0 for units in UNITS.values())


def test_percentiles_to_two_percent_and_the_maximum_exactly():
    histogram = LatencyHistogram()
    for k in range(1, 10001):
        histogram.add(k * 1e-6)
    assert histogram.percentile(0.5) == pytest.approx(5e-3, rel=0.02)
    assert histogram.percentile(0.99) == pytest.approx(9.9e-3, rel=0.02)
    assert histogram.maximum_s == 1e-2
    assert LatencyHistogram().percentile(0.5) == 0.0
    histogram.add(1e9)
    histogram.add(0.0)
    assert histogram.percentile(1.0) <= 1e9
