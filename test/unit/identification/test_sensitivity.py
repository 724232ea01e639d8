import numpy as np
import pytest

from dt_station_nodes.identification import Data, Hold, PathStructure, Structure
from dt_station_nodes.identification.sensitivity import respond, shifted, simulated
from dt_station_nodes.identification.structure import time_weights, unpack

STRUCTURES = {
    "two paths, delays, drift": (
        Structure(
            (PathStructure(3, 1, 1, Hold.HELD, 0.0, True), PathStructure(2, 1, 0, Hold.SMOOTH, 0.0, True)), True, True
        ),
        [2.0, 3.0, 1.5, 2.0, 0.033, 0.3, 0.2, 1.0, 2.0, 3.0, 4.0, 0.013, 0.1, 0.7, 5.0, 0.2],
    ),
    "from rest": (Structure((PathStructure(4, 3),), False), [1.0, 2.0, 3.0, 4.0, 4.0, 6.0, 4.0, 1.5, 0.5]),
    "a bare integrator": (Structure((PathStructure(1, 0, 1),), True, True), [2.0, 0.5, 0.1]),
    "a whole sample's delay": (
        Structure((PathStructure(2, 0, 0, Hold.HELD, 0.0, True),), True),
        [3.0, 3.0, 4.0, 0.04, 0.2, 0.3, 1.0],
    ),
}


def data(seed=1, samples=80):
    rng = np.random.default_rng(seed)
    return Data(0.02, (rng.normal(size=samples), rng.normal(size=samples)), np.zeros(samples))


@pytest.mark.parametrize("name", STRUCTURES)
def test_the_jacobian_is_that_of_finite_differences(name):
    structure, theta = STRUCTURES[name][0], np.array(STRUCTURES[name][1])
    given = Data(0.02, data().inputs[: len(structure.paths)], data().output)
    _, jacobian = respond(structure, theta, given, 7.0)
    assert theta.size == structure.size
    kinks = {i for i, v in enumerate(theta) if v == 0.04}
    for i in range(theta.size):
        step = np.zeros(theta.size)
        step[i] = 1e-6
        if i in kinks:
            continue
        numeric = (
            respond(structure, theta + step, given, 7.0)[0] - respond(structure, theta - step, given, 7.0)[0]
        ) / 2e-6
        assert jacobian[:, i] == pytest.approx(numeric, rel=1e-5, abs=1e-6 * np.abs(numeric).max())


@pytest.mark.parametrize("name", STRUCTURES)
def test_simulating_alone_gives_the_same_output(name):
    structure, theta = STRUCTURES[name][0], np.array(STRUCTURES[name][1])
    given = Data(0.02, data().inputs[: len(structure.paths)], data().output)
    assert simulated(structure, theta, given, 7.0) == pytest.approx(respond(structure, theta, given, 7.0)[0], abs=1e-10)


def test_the_time_normalisation_does_not_matter():
    structure, theta = STRUCTURES["two paths, delays, drift"]
    physical = np.array(theta) * time_weights(structure, 5.0)
    outputs = [respond(structure, physical / time_weights(structure, r), data(), r)[0] for r in (5.0, 20.0)]
    assert outputs[0] == pytest.approx(outputs[1], rel=1e-9, abs=1e-12)


def test_a_delay_of_whole_samples_shifts_the_response():
    structure = Structure((PathStructure(2, 0, delay_s=0.06),), False)
    prompt = Structure((PathStructure(2, 0),), False)
    signal = np.concatenate(([0.0], np.random.default_rng(0).normal(size=60)))
    given = Data(0.02, (signal,), signal)
    theta = np.array([3.0, 1.0, 2.0, 0.0])
    late, now = (respond(s, theta, given, 9.0)[0] for s in (structure, prompt))
    assert late[3:] == pytest.approx(now[:-3], abs=1e-12)
    assert shifted(signal, 100) == pytest.approx(np.full(61, signal[0]))


def test_layout_is_taken_apart_as_it_was_put_together():
    structure, theta = STRUCTURES["two paths, delays, drift"]
    paths, ends = unpack(structure, np.array(theta))
    assert paths[0].delay_s == 0.033
    assert paths[1].numerator.tolist() == [1.0, 2.0]
    assert ends.tolist() == [5.0, 0.2]
