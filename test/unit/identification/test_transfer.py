import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dt_station_nodes.identification import IdentificationError, TransferFunction
from support.known_systems import DISTURBANCE, POSITION, PRESSURE


def test_gain_of_the_papers_paths():
    assert PRESSURE.gain() == pytest.approx(0.9923, abs=5e-5)
    assert POSITION.gain() == pytest.approx(8.843, abs=5e-4)
    assert DISTURBANCE.gain() == pytest.approx(-0.0082, abs=5e-5)
    assert [path.integrators for path in (PRESSURE, POSITION, DISTURBANCE)] == [0, 1, 1]


@given(st.floats(0.1, 1e3), st.floats(-1e3, 1e3))
def test_a_common_factor_of_numerator_and_denominator_changes_nothing(lead, gain):
    assert TransferFunction((lead * gain,), (lead, 2.0 * lead)).numerator == pytest.approx((gain,))


@pytest.mark.parametrize("numerator", [(1.0, 0.0), (1.0, 2.0, 3.0)])
def test_an_improper_function_is_refused_in_a_sentence(numerator):
    with pytest.raises(IdentificationError, match="ask for fewer zeros than poles"):
        TransferFunction(numerator, (1.0, 2.0))


def test_frequency_response_tends_to_the_gain():
    low = np.array([1e-6])
    assert abs(PRESSURE.frequency_response(low)[0]) == pytest.approx(PRESSURE.gain())
    assert abs(POSITION.frequency_response(low)[0]) * 1e-6 == pytest.approx(POSITION.gain())


def test_stability_leaves_integrators_aside():
    assert POSITION.stable()
    assert not TransferFunction((1.0,), (1.0, -1.0)).stable()
