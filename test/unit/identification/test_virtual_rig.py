"""From the virtual rig: identified models are at least as good as the paper's own on a run they have not seen."""

from pathlib import Path

import pytest

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import ModelSpec
from dt_station_nodes.hardware import open_backend
from dt_station_nodes.identification import identify_direct, identify_disturbance
from dt_station_nodes.identification.experiments import experiments, run_in_process
from dt_station_nodes.identification.modelfile import model_of
from dt_station_nodes.identification.static_characteristic import static_characteristic
from dt_station_nodes.identification.validation import model_fit, path_lag_s

CONFIG = Path(__file__).resolve().parents[3] / "config"
PAPER = ModelSpec.from_yaml((CONFIG / "models" / "paper.yaml").read_text(encoding="utf-8"))


def on_rig(name, seed, **changes):
    device = open_backend("virtual", {"rig": str(CONFIG / "rigs" / "paper.yaml"), "sample_time_s": 0.02, "seed": seed})
    device.open()

    def read():
        reading = device.read()
        return reading.pressure_pa, reading.position_m

    def write(load, servo):
        applied = device.write(load, servo)
        return applied.load_voltage_v, applied.servo_voltage_v

    return run_in_process(experiments(**changes)[name], 0.02, read, write, name)


CASES = {
    "pressure-square": (Channel.PRESSURE, lambda run: identify_direct(run, Channel.PRESSURE, (3, 4), (1, 2))),
    "position-square": (Channel.POSITION, lambda run: identify_direct(run, Channel.POSITION, (2,))),
    "disturbance": (Channel.POSITION, lambda run: identify_disturbance(run, 1e6)),
}


@pytest.mark.parametrize("name", CASES)
def test_identified_paths_beat_the_papers_on_a_run_not_seen(name):
    channel, identify = CASES[name]
    found = identify(on_rig(name, 1))
    other = on_rig(name, 2, duration_s=35.0, amplitude=0.8)
    ours = model_fit(model_of([found], "rig", "a test", PAPER), other, channel)
    assert ours >= model_fit(PAPER, other, channel)
    assert ours > 94.0


def test_the_slow_triangle_shows_the_relief_valves_hysteresis():
    run = on_rig("pressure-triangle", 1, duration_s=60.0)
    shape = static_characteristic(run, Channel.PRESSURE, path_lag_s(PAPER, Channel.PRESSURE))
    spread = 0.0 if shape.hysteresis_spread is None else shape.hysteresis_spread.value
    width = shape.hysteresis_half_width_v.value * (1.0 + 0.25 * spread)
    assert 0.1 < width < 0.3
    assert shape.gain.value == pytest.approx(1.0, rel=0.1)
    middle = 0.5 * (shape.rising.output.min() + shape.rising.output.max())
    assert middle == pytest.approx(3.4, abs=0.3)
