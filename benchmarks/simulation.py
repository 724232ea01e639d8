"""How fast a model is simulated: our kernel beside a plain C loop, scipy.signal.dlsim and python-control.

    python benchmarks/simulation.py [--seconds 60] [--json]

The full station at 1 ms: pressure path (1), position path (5), disturbance path (6), five effects active. The C loop
(gcc -O2) does the same arithmetic and must give the same outputs. scipy and python-control's forced_response get the
three linear paths only, which flatters them; nlsys gets all of it. Each figure is the best of several runs in this
one process.
"""

import argparse
import ctypes
import json
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "src" / "dt_station_nodes"))

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import ModelSpec, PlantModel
from dt_station_nodes.core.models.linear import LinearPath, discretise

ROOT = Path(__file__).resolve().parents[1]
STEP_S = 0.001
HYSTERESIS_V, DEAD_ZONE_V, UPPER_V, LOWER_V = 0.15, 0.2, 4.0, 0.0
SERVO_DEAD_ZONE_V, BACKLASH_M = 0.05, 1e-4
REST_PA = 1.0e6


def station() -> ModelSpec:
    """The paper's models with five effects."""
    spec = ModelSpec.from_yaml((ROOT / "config" / "models" / "paper.yaml").read_text(encoding="utf-8"))
    spec = spec.with_path(Channel.PRESSURE, effects=()).with_path(Channel.POSITION, effects=())
    spec = spec.with_effect(Channel.PRESSURE, "hysteresis", {"half_width_v": HYSTERESIS_V})
    spec = spec.with_effect(Channel.PRESSURE, "dead_zone", {"half_width_v": DEAD_ZONE_V})
    spec = spec.with_effect(Channel.PRESSURE, "saturation", {"upper_v": UPPER_V, "lower_v": LOWER_V})
    spec = spec.with_effect(Channel.POSITION, "dead_zone", {"half_width_v": SERVO_DEAD_ZONE_V})
    return spec.with_effect(Channel.POSITION, "backlash", {"half_width": BACKLASH_M})


def linear_paths(spec: ModelSpec) -> tuple[LinearPath, LinearPath, LinearPath]:
    """Pressure, position and disturbance at 1 ms, SI."""
    pressure, position = spec.paths[Channel.PRESSURE], spec.paths[Channel.POSITION]
    away = position.disturbance
    return (
        discretise(pressure, pressure.scale, STEP_S),
        discretise(position, position.scale, STEP_S),
        discretise(away, position.scale * away.input_scale, STEP_S),
    )


def voltages(samples: int) -> np.ndarray:
    """Load and servo voltage, shape (samples, 2)."""
    time_s = STEP_S * np.arange(samples)
    load = 2.5 + 2.5 * np.sin(2.0 * np.pi * 0.25 * time_s)
    return np.column_stack([load, np.sin(2.0 * np.pi * 0.6 * time_s)])


def c_loop(paths: tuple[LinearPath, ...], given: np.ndarray) -> Callable[[], np.ndarray]:
    """The C loop, compiled now."""
    folder = Path(tempfile.mkdtemp(prefix="dt-station-benchmark-"))
    library = folder / "simulation.so"
    source = Path(__file__).with_suffix(".c")
    subprocess.run(["gcc", "-O2", "-shared", "-fPIC", "-o", library, source, "-lm"], check=True)
    run = ctypes.CDLL(str(library)).run
    pointer = np.ctypeslib.ndpointer(np.float64, flags="C_CONTIGUOUS")
    run.argtypes = [ctypes.c_long, pointer, pointer, pointer, pointer]
    run.restype = None
    matrices = np.concatenate([part.ravel() for path in paths for part in (path.a, path.b, path.c)])
    parameters = np.array([HYSTERESIS_V, DEAD_ZONE_V, UPPER_V, LOWER_V, REST_PA, SERVO_DEAD_ZONE_V, BACKLASH_M])
    given = np.ascontiguousarray(given)

    def simulate() -> np.ndarray:
        outputs = np.empty_like(given)
        run(len(given), matrices, parameters, given, outputs)
        return outputs

    return simulate


def scipy_loop(paths: tuple[LinearPath, ...], given: np.ndarray) -> Callable[[], object]:
    """scipy.signal.dlsim on the three linear paths."""
    from scipy.signal import dlsim

    systems = [(p.a, p.b[:, None], p.c[None, :], np.zeros((1, 1)), STEP_S) for p in paths]

    def simulate() -> object:
        _, pressure, _ = dlsim(systems[0], given[:, 0])
        _, position, _ = dlsim(systems[1], given[:, 1])
        _, away, _ = dlsim(systems[2], pressure[:, 0])
        return pressure, position + away

    return simulate


def control_linear(paths: tuple[LinearPath, ...], given: np.ndarray) -> Callable[[], object]:
    """control.forced_response on the three linear paths."""
    import control

    systems = [control.ss(p.a, p.b[:, None], p.c[None, :], 0.0, STEP_S) for p in paths]
    time_s = STEP_S * np.arange(len(given))

    def simulate() -> object:
        pressure = control.forced_response(systems[0], time_s, given[:, 0]).outputs
        position = control.forced_response(systems[1], time_s, given[:, 1]).outputs
        return pressure, position + control.forced_response(systems[2], time_s, pressure).outputs

    return simulate


def control_nonlinear(paths: tuple[LinearPath, ...], given: np.ndarray) -> Callable[[], object]:
    """control.nlsys with all five effects in its update function."""
    import control

    one, two, three = paths

    def play(value: float, half_width: float, memory: float) -> float:
        return min(max(memory, value - half_width), value + half_width)

    def dead(value: float, half_width: float) -> float:
        return np.sign(value) * max(abs(value) - half_width, 0.0)

    def update(_t: float, x: np.ndarray, u: np.ndarray, _p: object) -> np.ndarray:
        magnet = play(u[0], HYSTERESIS_V, x[11])
        valve = min(max(dead(magnet, DEAD_ZONE_V), LOWER_V), UPPER_V)
        pressure = one.a @ x[:6] + one.b * valve
        position = two.a @ x[6:8] + two.b * dead(u[1], SERVO_DEAD_ZONE_V)
        away = three.a @ x[8:11] + three.b * (0.5 * (one.c @ x[:6] + one.c @ pressure))
        seen = play(two.c @ position + three.c @ away, BACKLASH_M, x[12])
        return np.concatenate([pressure, position, away, [magnet, seen]])

    def output(_t: float, x: np.ndarray, _u: np.ndarray, _p: object) -> np.ndarray:
        return np.array([one.c @ x[:6] + REST_PA, x[12]])

    system = control.nlsys(update, output, inputs=2, outputs=2, states=13, dt=STEP_S)
    time_s = STEP_S * np.arange(len(given))
    start = np.zeros(13)
    start[11] = given[0, 0]

    def simulate() -> object:
        return control.input_output_response(system, time_s, given.T, start)

    return simulate


def best_of(simulate: Callable[[], object], seconds: float, most: int) -> float:
    """Least time of one call within a budget, s."""
    best, spent, calls = np.inf, 0.0, 0
    while calls < 2 or (spent < seconds and calls < most):
        begin = time.perf_counter()
        simulate()
        took = time.perf_counter() - begin
        best, spent, calls = min(best, took), spent + took, calls + 1
    return best


def measure(seconds: float) -> dict[str, object]:
    """All times, per simulated second, and what they mean."""
    spec = station()
    paths = linear_paths(spec)
    given = voltages(round(seconds / STEP_S))
    short = given[: max(len(given) // 30, 100)]
    model = PlantModel(spec, STEP_S)

    def ours() -> np.ndarray:
        simulated = model.simulate(given[:, 0], given[:, 1])
        return np.column_stack([simulated.pressure_pa, simulated.position_m])

    plain = c_loop(paths, given)
    apart = np.abs(ours() - plain()).max(axis=0) / np.ptp(plain(), axis=0)
    # ours and C alternate, so that a busy machine treats both alike
    own, c = np.inf, np.inf
    for _ in range(5):
        own = min(own, best_of(ours, 0.3, 20))
        c = min(c, best_of(plain, 0.3, 20))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        per_second = {
            "ours": own / seconds,
            "C loop (gcc -O2)": c / seconds,
            "scipy dlsim, linear part": best_of(scipy_loop(paths, given), 1.0, 5) / seconds,
            "control forced_response, linear part": best_of(control_linear(paths, given), 1.0, 5) / seconds,
            "control nlsys response": best_of(control_nonlinear(paths, short), 2.0, 3) / (len(short) * STEP_S),
        }
    return {
        "sample_time_s": STEP_S,
        "simulated_s": seconds,
        "largest_relative_difference_to_c": float(apart.max()),
        "times_real_time": {name: 1.0 / value for name, value in per_second.items()},
        "time_relative_to_ours": {name: value / per_second["ours"] for name, value in per_second.items()},
        "ours_over_c": own / c,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--json", action="store_true")
    given = parser.parse_args()
    result = measure(given.seconds)
    if given.json:
        print(json.dumps(result, indent=2))
        return
    print(f"full station, five effects, 1 ms, {given.seconds:g} s simulated")
    for name, factor in result["times_real_time"].items():
        ratio = result["time_relative_to_ours"][name]
        print(f"  {name:38s} {factor:10.0f} times real time   {ratio:9.2f} of our time")
    print(f"  ours takes {result['ours_over_c']:.2f} times the C loop's time   (aim at most 2)")
    print(f"  ours and C differ by {result['largest_relative_difference_to_c']:.1e} of the output's span at most")


if __name__ == "__main__":
    main()
