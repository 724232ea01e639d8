"""Quantisation grids and the counter-based noise."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dt_station_nodes.hardware.virtual.config import AnalogOutput, Sensor
from dt_station_nodes.hardware.virtual.converters import driven, normal, quantised, sensed


@given(value=st.floats(-20, 20), bits=st.integers(1, 24))
def test_a_reading_is_the_nearest_code(value, bits):
    step = 20.0 / 2**bits
    read = quantised(value, -10.0, 10.0, bits)
    assert (read + 10.0) / step == pytest.approx(round((read + 10.0) / step), abs=1e-6)
    assert -10.0 <= read <= 10.0 - step
    if -10.0 <= value <= 10.0 - step:
        assert abs(read - value) <= step / 2 * (1 + 1e-9)


@given(value=st.floats(-20, 20))
def test_no_bits_only_clip(value):
    assert quantised(value, -10.0, 10.0, 0) == min(max(value, -10.0), 10.0)


@pytest.mark.parametrize("bits", [8, 12, 16])
def test_a_symmetric_range_has_a_code_for_zero(bits):
    assert quantised(0.0, -10.0, 10.0, bits) == 0.0


@given(value=st.floats(-20, 20))
def test_quantising_twice_changes_nothing(value):
    once = quantised(value, 0.0, 5.0, 16)
    assert quantised(once, 0.0, 5.0, 16) == once


def test_an_output_says_when_its_range_cuts():
    output = AnalogOutput(low_v=0.0, high_v=5.0, bits=16)
    assert driven(output, 5.0)[1] is False
    assert driven(output, 5.01) == (pytest.approx(5.0, abs=1e-4), True)
    assert driven(output, -0.01) == (0.0, True)


def test_a_sensor_says_when_it_is_out_of_range():
    sensor = Sensor(low=0.0, high=10.0, bits=8)
    assert sensed(sensor, 4.0, 1, 1, 0)[1] is False
    assert sensed(sensor, 11.0, 1, 1, 0) == (pytest.approx(10.0, abs=0.05), True)


def test_noise_is_standard_normal_and_streams_are_independent():
    one, two = (np.array([normal(3, stream, k) for k in range(4000)]) for stream in (1, 2))
    assert one.mean() == pytest.approx(0.0, abs=0.05)
    assert one.std() == pytest.approx(1.0, abs=0.04)
    assert np.mean(np.abs(one) < 1.0) == pytest.approx(0.6827, abs=0.025)
    assert abs(np.corrcoef(one, two)[0, 1]) < 0.05
    assert abs(np.corrcoef(one[1:], one[:-1])[0, 1]) < 0.05


@given(seed=st.integers(0, 2**53 - 1), sequence=st.integers(0, 2**40))
def test_noise_is_a_function_of_seed_and_sample(seed, sequence):
    assert normal(seed, 1, sequence) == normal(seed, 1, sequence)
    assert abs(normal(seed, 1, sequence)) < 9.0
