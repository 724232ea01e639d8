import numpy as np
import pytest

from dt_station_nodes.identification import (
    Data,
    IdentificationError,
    PathStructure,
    Structure,
    TransferFunction,
    orders,
    select,
)
from support.known_systems import SAMPLE_TIME_S, noisy, response, switching

TRUTH = TransferFunction((40.0, 900.0), (1.0, 18.0, 500.0, 900.0))


def data(seed, share=0.01):
    signal = switching(1500, 8, 0.0, 5.0, seed)
    return Data(SAMPLE_TIME_S, (signal,), noisy(response(TRUTH, signal), seed, share))


def test_the_true_order_is_chosen_among_smaller_and_larger_ones():
    said = []
    found = select(Structure((PathStructure(1, 0),)), data(1), orders(range(1, 5)), advance=said.append)
    assert (found.chosen.poles, found.chosen.zeros) == (3, 1)
    assert len(found.candidates) == len(orders(range(1, 5))) == 10
    assert len(said) == 11
    fits = {(c.poles, c.zeros): c.estimate.fit_percent for c in found.candidates}
    assert fits[3, 1] > fits[2, 1] > fits[1, 0]
    scores = [c.estimate.bic for c in found.candidates if not c.doubt]
    assert found.chosen.estimate.bic <= min(scores) + 3.0


def test_held_out_error_tells_overfitting_from_fitting():
    found = select(Structure((PathStructure(1, 0),)), data(2, 0.05), ((3, 1), (1, 0)))
    best = found.chosen
    assert (best.poles, best.zeros) == (3, 1)
    assert best.validation_fit_percent <= best.estimate.fit_percent + 1e-9
    assert best.validation_fit_percent == pytest.approx(best.estimate.fit_percent, abs=1.0)


def test_a_grid_without_a_proper_model_is_refused():
    with pytest.raises(IdentificationError, match="improper"):
        orders((1, 2), (2, 3))
    assert orders((2,), None) == ((2, 0), (2, 1))


def test_a_run_too_short_for_every_candidate_is_refused():
    short = data(0).window(0, 6)
    with pytest.raises(IdentificationError, match="6 samples"):
        select(Structure((PathStructure(1, 0),)), short, ((4, 2), (5, 3)))


def test_selection_is_repeatable_to_the_bit():
    grid = ((2, 1), (3, 1))
    one, two = (select(Structure((PathStructure(1, 0),)), data(3), grid) for _ in range(2))
    assert np.array_equal(one.chosen.estimate.theta, two.chosen.estimate.theta)
    assert np.array_equal(one.chosen.estimate.covariance, two.chosen.estimate.covariance)
