"""The plain C loop of the benchmark is an independent witness: it and the compiled kernel give the same outputs."""

import importlib.util
import shutil
from pathlib import Path

import numpy as np
import pytest

from dt_station_nodes.core.models import PlantModel

SCRIPT = Path(__file__).resolve().parents[3] / "benchmarks" / "simulation.py"


@pytest.mark.skipif(shutil.which("gcc") is None, reason="needs gcc")
def test_kernel_and_c_loop_agree_on_the_full_station_with_five_effects():
    spec = importlib.util.spec_from_file_location("benchmark_simulation", SCRIPT)
    benchmark = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(benchmark)
    station = benchmark.station()
    given = benchmark.voltages(4000)
    ours = PlantModel(station, benchmark.STEP_S).simulate(given[:, 0], given[:, 1])
    plain = benchmark.c_loop(benchmark.linear_paths(station), given)()
    assert sum(len(path.effects) for path in station.paths.values()) == 5
    for mine, other in ((ours.pressure_pa, plain[:, 0]), (ours.position_m, plain[:, 1])):
        assert np.abs(mine - other).max() < 1e-8 * np.ptp(other)
