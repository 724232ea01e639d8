"""What a running station's listener keeps, and the run table made of it."""

import numpy as np

from dt_station_nodes.cli.improve_station import Listener, as_run
from dt_station_nodes.core.samples import PlantSample
from dt_station_nodes.nodes import convert


def sample(sequence, load_v=0.0, pressure=1e6):
    return PlantSample(sequence, 20_000_000 * sequence, 0.1, pressure, load_v, 0.0)


def tell(listener, numbers):
    for number in numbers:
        listener.on_state(convert.state_to_bytes(sample(number)))


def residual(stamp_ns):
    return convert.residual_to_bytes(convert.ResidualSample(0, stamp_ns, (0.0,) * 4, (1.0,) * 4))


def test_samples_from_before_a_change_are_not_taken_however_late_they_come():
    listener = Listener()
    tell(listener, range(100))
    listener.samples_from(120)
    tell(listener, range(90, 130))
    assert [s.sequence for s in listener.samples] == list(range(120, 130))


def test_a_missing_sample_ends_what_was_kept_before_it():
    listener = Listener()
    tell(listener, [0, 1, 2, 5, 6])
    assert [s.sequence for s in listener.samples] == [5, 6]


def test_residuals_count_from_after_the_change():
    listener = Listener()
    listener.on_residual(residual(10))
    listener.residuals_after(20)
    for stamp_ns in (15, 20, 25):
        listener.on_residual(residual(stamp_ns))
    assert [r.stamp_ns for r in listener.residuals] == [25]


def test_a_row_has_the_voltage_that_the_next_sample_says_was_applied_until_it():
    run = as_run([sample(k, load_v=float(k), pressure=1e5 * k) for k in range(5)], 0.02, "here")
    np.testing.assert_array_equal(run.signals["load_voltage_v"], [1.0, 2.0, 3.0, 4.0])
    np.testing.assert_array_equal(run.signals["pressure_pa"], [0.0, 1e5, 2e5, 3e5])
