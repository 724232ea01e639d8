"""Every waveform against its definition, and the phase against exact arithmetic."""

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import signal

from dt_station_nodes.core.waveforms import (
    Shape,
    Waveform,
    WaveformError,
    WaveformGenerator,
    WaveformState,
    waveform_samples,
)

MOVING = [Shape.SINE, Shape.SQUARE, Shape.TRIANGLE, Shape.SAWTOOTH]
waveforms = st.builds(
    Waveform,
    shape=st.sampled_from(list(Shape)),
    amplitude=st.floats(0.0, 1e7),
    offset=st.floats(-1e7, 1e7),
    frequency_hz=st.floats(1e-3, 400.0),
    phase_rad=st.floats(-20.0, 20.0),
    duty=st.floats(0.0, 1.0),
)


def advance(generator: WaveformGenerator, state: WaveformState, samples: int) -> WaveformState:
    for _ in range(samples):
        state, _ = generator.step(state)
    return state


def test_constant_is_its_offset_whatever_the_frequency() -> None:
    assert set(waveform_samples(Waveform(Shape.CONSTANT, 3.0, 7.0, 0.0), 0.02, 50)) == {7.0}


def test_sine_follows_its_formula_with_phase() -> None:
    t = 0.02 * np.arange(1000)
    got = waveform_samples(Waveform(Shape.SINE, 2.0, 1.0, 0.7, 0.4), 0.02, 1000)
    np.testing.assert_allclose(got, 1.0 + 2.0 * np.sin(2 * np.pi * 0.7 * t + 0.4), atol=1e-11)


@pytest.mark.parametrize("duty", [0.1, 0.25, 0.5, 0.9])
def test_square_is_high_for_its_duty_exactly(duty: float) -> None:
    got = waveform_samples(Waveform(Shape.SQUARE, 1.5, 0.5, 0.25, 0.0, duty), 0.02, 2000)
    period = got.reshape(10, 200)
    high = round(200 * duty)
    assert (period[:, :high] == 2.0).all()
    assert (period[:, high:] == -1.0).all()


@pytest.mark.parametrize("duty", [0.0, 0.3, 0.5, 1.0])
def test_triangle_is_the_textbook_one_with_symmetry(duty: float) -> None:
    t = 0.01 * np.arange(777) + 1e-9
    got = waveform_samples(Waveform(Shape.TRIANGLE, 2.0, -1.0, 0.31, 2 * np.pi * 0.31e-9, duty), 0.01, 777)
    np.testing.assert_allclose(got, -1.0 + 2.0 * signal.sawtooth(2 * np.pi * 0.31 * t, width=duty), atol=1e-6)


def test_full_sawtooth_rises_through_the_whole_period() -> None:
    got = waveform_samples(Waveform(Shape.SAWTOOTH, 1.0, 0.0, 1.0, 0.0, Shape.SAWTOOTH.usual_duty), 0.02, 100)
    np.testing.assert_allclose(got, np.tile(-1.0 + 2.0 * np.arange(50) / 50, 2), atol=1e-12)


def test_short_sawtooth_rises_for_its_duty_then_rests_low() -> None:
    got = waveform_samples(Waveform(Shape.SAWTOOTH, 1.0, 0.0, 1.0, 0.0, 0.4), 0.02, 50)
    np.testing.assert_allclose(got[:20], -1.0 + 0.1 * np.arange(20), atol=1e-12)
    assert (got[20:] == -1.0).all()


@pytest.mark.parametrize("shape", MOVING)
def test_phase_shifts_in_time(shape: Shape) -> None:
    plain = waveform_samples(Waveform(shape, 1.0, 0.0, 0.5, 0.0, 0.25), 0.02, 300)
    shifted = waveform_samples(Waveform(shape, 1.0, 0.0, 0.5, math.pi / 2, 0.25), 0.02, 275)
    np.testing.assert_allclose(shifted, plain[25:], atol=1e-9)


@given(waveforms, st.floats(0.0, 1.0, exclude_max=True))
def test_values_stay_within_amplitude_of_offset(waveform: Waveform, cycles: float) -> None:
    slack = 1e-9 * (1.0 + waveform.amplitude)
    assert abs(waveform.at(cycles) - waveform.offset) <= waveform.amplitude + slack


@given(waveforms, st.integers(0, 400))
@settings(max_examples=50)
def test_restarting_with_the_same_waveform_changes_nothing(waveform: Waveform, at: int) -> None:
    generator = WaveformGenerator(0.02)
    state = advance(generator, generator.initial_state(waveform), at)
    assert generator.step(state, waveform) == generator.step(state, None)


@given(st.lists(st.tuples(waveforms, st.integers(1, 30)), min_size=1, max_size=8))
@settings(max_examples=50)
def test_live_changes_keep_the_exact_running_phase(changes: list[tuple[Waveform, int]]) -> None:
    generator = WaveformGenerator(0.003)
    state = generator.initial_state(changes[0][0])
    cycles = Fraction(0)
    for waveform, samples in changes:
        for k in range(samples):
            assert Fraction(state.position, state.modulus) == cycles
            state, value = generator.step(state, waveform if k == 0 else None)
            assert value == waveform.at(float(cycles))
            moving = waveform.shape is not Shape.CONSTANT
            cycles = (cycles + (Fraction("0.003") * Fraction(repr(waveform.frequency_hz)) if moving else 0)) % 1


def test_frequency_change_of_a_sine_makes_no_jump() -> None:
    generator = WaveformGenerator(0.001)
    state = generator.initial_state(Waveform(Shape.SINE, 1.0, 0.0, 1.0))
    values = []
    for k in range(4000):
        state, value = generator.step(state, Waveform(Shape.SINE, 1.0, 0.0, 3.0) if k == 1234 else None)
        values.append(value)
    assert np.abs(np.diff(values)).max() <= 2 * np.pi * 3.0 * 0.001


def test_amplitude_change_takes_effect_at_that_very_sample() -> None:
    generator = WaveformGenerator(0.02)
    first, second = Waveform(Shape.SINE, 1.0, 0.0, 0.7), Waveform(Shape.SINE, 2.0, 0.5, 0.7)
    state = advance(generator, generator.initial_state(first), 17)
    _, before = generator.step(state)
    _, after = generator.step(state, second)
    assert after == pytest.approx(0.5 + 2.0 * before)


def test_period_that_is_no_multiple_of_the_sample_is_kept_on_average() -> None:
    got = waveform_samples(Waveform(Shape.SQUARE, 1.0, 0.0, 0.37), 0.02, 100_000)
    edges = np.flatnonzero(np.diff(got) > 0)
    assert len(edges) == pytest.approx(0.37 * 0.02 * 100_000, abs=1)
    assert set(np.diff(edges)) == {135, 136}


def test_no_drift_over_ten_million_samples() -> None:
    generator = WaveformGenerator(0.02)
    start = generator.initial_state(Waveform(Shape.SQUARE, 1.0, 0.0, 0.37))
    # Whole-number steps commute with addition, so a jump of n equals n steps; checked on a thousand.
    jump = WaveformState(start.waveform, start.increment * 1000 % start.modulus, start.increment, start.modulus)
    assert advance(generator, start, 1000) == jump
    far = start.increment * 10_000_000 % start.modulus
    assert Fraction(far, start.modulus) == Fraction("0.02") * Fraction("0.37") * 10_000_000 % 1
    state = generator.initial_state(Waveform(Shape.SQUARE, 1.0, 0.0, 0.25))
    assert advance(generator, state, 200) == state


@pytest.mark.parametrize(
    "bad",
    [
        {"amplitude": -1.0},
        {"frequency_hz": 0.0},
        {"frequency_hz": float("nan")},
        {"offset": float("inf")},
        {"duty": 1.2},
        {"shape": 9},
    ],
)
def test_unplayable_waveforms_are_refused_in_a_sentence(bad: dict[str, float]) -> None:
    with pytest.raises(WaveformError, match="waveform"):
        Waveform(**{"shape": Shape.SINE, "frequency_hz": 1.0, **bad})  # type: ignore[arg-type]


def test_zero_sample_time_is_refused() -> None:
    with pytest.raises(WaveformError, match="sample time"):
        WaveformGenerator(0.0)
