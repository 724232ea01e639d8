"""Every backend keeps the same manners; the factory says what it cannot do."""

import math

import numpy as np
import pytest

from dt_station_nodes.core.errors import StationError
from dt_station_nodes.core.run import Run
from dt_station_nodes.hardware import FakeBackend, Reading, ReplayBackend, open_backend
from dt_station_nodes.hardware.virtual import RigInput, VirtualRig, load_rig


@pytest.fixture
def measured() -> Run:
    n = 5
    return Run(
        0.02,
        {
            "load_voltage_v": np.linspace(0, 4, n),
            "servo_voltage_v": np.linspace(-1, 1, n),
            "pressure_pa": np.linspace(1e6, 5e6, n),
            "position_m": np.linspace(0, 0.1, n),
        },
    )


def test_replay_gives_the_rows_and_ends_with_the_last(measured):
    backend = open_backend("replay", {"run": measured})
    assert backend.sample_time_s == 0.02
    for _ in range(2):
        backend.open()
        for k in range(5):
            reading = backend.read()
            assert (reading.pressure_pa, reading.position_m) == (
                measured.signals["pressure_pa"][k],
                measured.signals["position_m"][k],
            )
            assert reading.ended is (k == 4)
            applied = backend.write(9.0, 9.0)
            assert applied.load_voltage_v == measured.signals["load_voltage_v"][k]
            assert applied.servo_voltage_v == measured.signals["servo_voltage_v"][k]
        assert backend.read() == reading
    backend.close()
    backend.close()


def test_what_a_run_did_not_measure_is_absent(measured):
    only = Run(0.001, {"servo_voltage_v": measured.signals["servo_voltage_v"], "position_m": np.full(5, 0.2)})
    backend = ReplayBackend(only)
    backend.open()
    assert backend.read().position_m == 0.2
    assert math.isnan(backend.read().pressure_pa)
    assert backend.write(1.0, 1.0).load_voltage_v == 0.0


def test_virtual_is_the_rig_sample_by_sample():
    backend = open_backend("virtual", {"sample_time_s": 0.02, "rig": "paper", "seed": 7})
    rig = VirtualRig(load_rig("paper").model_copy(update={"seed": 7}), 0.02)
    for _ in range(2):
        backend.open()
        state = rig.initial_state()
        for k in range(20):
            reading = backend.read()
            applied = backend.write(0.1 * k, 0.05 * k)
            state, out = rig.step(state, RigInput(0.1 * k, 0.05 * k))
            assert (reading.pressure_pa, reading.position_m) == (out.pressure_pa, out.position_m)
            assert (applied.load_voltage_v, applied.servo_voltage_v) == (out.load_voltage_v, out.servo_voltage_v)
            assert not reading.ended
    backend.close()
    backend.close()


def test_fake_answers_the_last_voltages_and_notes_them():
    backend = FakeBackend(0.01, samples=3)
    backend.open()
    assert backend.read() == Reading(0.0, 0.0)
    backend.write(2.0, -1.0)
    assert backend.read() == Reading(-0.01, 2.0e6)
    backend.write(0.0, 0.0)
    assert backend.read().ended
    assert backend.written == [(2.0, -1.0), (0.0, 0.0)]
    backend.close()
    assert not backend.is_open


def test_fake_plays_a_script():
    backend = FakeBackend(script=lambda k: Reading(float(k), 0.0, ended=k == 1))
    backend.open()
    assert backend.read() == Reading(0.0, 0.0)
    backend.write(0.0, 0.0)
    assert backend.read() == Reading(1.0, 0.0, ended=True)


@pytest.mark.parametrize(
    ("kind", "options", "says"),
    [
        ("magic", {}, "no backend is called 'magic'; choose one of virtual, replay, fake"),
        ("virtual", {"sample_time_s": 0.02}, "needs rig"),
        ("virtual", {"rig": "paper"}, "needs sample_time_s"),
        ("virtual", {"rig": "paper", "sample_time_s": "often"}, "needs sample_time_s"),
        ("virtual", {"rig": "paper", "sample_time_s": 0.02, "speed": 2}, "no option 'speed'"),
        ("virtual", {"rig": "paper", "sample_time_s": 0.02, "seed": -1}, "seed"),
        ("virtual", {"rig": "nosuch", "sample_time_s": 0.02}, "no rig is called nosuch"),
        ("replay", {}, "needs run"),
        ("fake", {}, "needs sample_time_s"),
    ],
)
def test_bad_options_get_one_sentence(kind, options, says):
    with pytest.raises(StationError) as caught:
        open_backend(kind, options)
    assert says in str(caught.value)


def test_replay_keeps_to_the_runs_sample_time(measured):
    assert open_backend("replay", {"run": measured, "sample_time_s": 0.02}).sample_time_s == 0.02
    with pytest.raises(StationError, match="sampled every"):
        open_backend("replay", {"run": measured, "sample_time_s": 0.01})
