import numpy as np
import pytest

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.run import Run
from dt_station_nodes.identification import IdentificationError, identify_closed_loop, identify_direct


def run(**signals):
    rng = np.random.default_rng(0)
    usual = {"load_voltage_v": rng.integers(0, 2, 400) * 5.0, "pressure_pa": 1e6 * (1.0 + rng.normal(size=400))}
    usual |= {"servo_voltage_v": rng.normal(size=400), "position_m": np.cumsum(rng.normal(size=400))}
    return Run(
        0.02, {name: np.asarray(values, dtype=float) for name, values in {**usual, **signals}.items()}, source="r.csv"
    )


STUCK = np.where(np.arange(400) < 392, 10.0, 3.0)
BAD = {
    "no excitation": ({"load_voltage_v": np.full(400, 2.5)}, "load_voltage_v stays at 2.5 V"),
    "saturated input": ({"load_voltage_v": STUCK}, "stuck at its limit 10 V in 98 %"),
    "dead sensor": ({"pressure_pa": np.full(400, 1e6)}, r"pressure_pa stays at 1e\+06 Pa"),
    "not a number": ({"pressure_pa": np.r_[np.ones(9), np.nan, np.ones(390)]}, "not a finite number in row 10"),
}


@pytest.mark.parametrize("name", BAD)
def test_an_unidentifiable_run_gets_one_sentence(name):
    signals, says = BAD[name]
    with pytest.raises(IdentificationError, match=says) as error:
        identify_direct(run(**signals), Channel.PRESSURE, poles=(2,))
    assert str(error.value).startswith("r.csv")
    assert "\n" not in str(error.value)


def test_a_clipped_sensor_is_named():
    rng = np.random.default_rng(1)
    clipped = np.clip(rng.normal(size=400), -0.3, 0.3)
    with pytest.raises(IdentificationError, match="clipped"):
        identify_direct(run(pressure_pa=clipped), Channel.PRESSURE, poles=(1,))


def test_a_missing_signal_is_named():
    lone = Run(0.02, {"pressure_pa": np.zeros(5)}, source="r.csv")
    with pytest.raises(IdentificationError, match="has no load_voltage_v"):
        identify_direct(lone, Channel.PRESSURE)


def test_a_saturated_loop_is_not_taken_for_linear():
    setpoint = np.sign(np.sin(np.arange(400) / 20.0))
    limited = np.clip(20.0 * setpoint + np.random.default_rng(0).normal(size=400), -10.0, 10.0)
    with pytest.raises(IdentificationError, match="saturated at -10 or 10 V"):
        identify_closed_loop(run(position_setpoint_m=setpoint, servo_voltage_v=limited))
