"""The paper's open-loop experiments: what the paths do when driven by hand."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...core.closed_loop import Plant, run_loops
from ...core.control import LoopConfig, LoopController, PidConfig
from ...core.run import Run
from ...core.samples import ControlMode
from ...core.waveforms import Shape, Waveform, waveform_samples
from .bench import Bench

Array = NDArray[np.float64]

CM, MPA = 100.0, 1e-6
TRIANGLE_S = 60.0
SERVO_V = (-3.0, -2.0, -1.0, -0.5, -0.2, 0.2, 0.5, 1.0, 2.0, 3.0)
SERVO_S = 0.5
LAG_V = 1.0
STEP_S, DRIFT_FROM_S, DISTURBANCE_S = 1.0, 4.0, 12.0


def driven(plant: Plant, load_v: Array, servo_v: Array, source: str) -> Run:
    """An object driven by voltages of shape (n,)."""
    n = len(load_v)
    table = np.empty((n, 4))
    for k in range(n):
        seen = plant.read()
        applied = plant.write(float(load_v[k]), float(servo_v[k]))
        table[k] = applied.load_voltage_v, applied.servo_voltage_v, seen.pressure_pa, seen.position_m
    names = ("load_voltage_v", "servo_voltage_v", "pressure_pa", "position_m")
    return Run(plant.sample_time_s, {name: table[:, i].copy() for i, name in enumerate(names)}, source=source)


def square_on_valve(bench: Bench, plant: Plant) -> Run:
    """Figure 6: the relief valve driven by a 0/5 V square wave of 0.25 Hz for 12 s."""
    load = waveform_samples(Waveform(Shape.SQUARE, 2.5, 2.5, 0.25), bench.sample_time_s, bench.samples(12.0))
    return driven(plant, load, np.zeros(load.size), "0/5 V square")


@dataclass(frozen=True, slots=True)
class StaticPressure:
    """Figure 7: pressure over voltage, slowly up and down; gain in MPa/V, width of the loop at 2.5 V in V."""

    run: Run
    gain_mpa_v: float
    rest_mpa: float
    width_v: float


def static_pressure(bench: Bench, plant: Plant) -> StaticPressure:
    """A triangle of 0 to 5 V and back in a minute, read between 1 and 4 V."""
    wave = Waveform(Shape.TRIANGLE, 2.5, 2.5, 1.0 / TRIANGLE_S)
    load = waveform_samples(wave, bench.sample_time_s, bench.samples(TRIANGLE_S))
    run = driven(plant, load, np.zeros(load.size), "slow triangle")
    pressure, half = run.signals["pressure_pa"] * MPA, load.size // 2
    up, down = slice(0, half), slice(half, None)
    lines = []
    for part in (up, down):
        inside = (load[part] > 1.0) & (load[part] < 4.0)
        lines.append(np.polyfit(load[part][inside], pressure[part][inside], 1))
    gain = float(np.mean([line[0] for line in lines]))
    width = float(np.polyval(lines[1], 2.5) - np.polyval(lines[0], 2.5)) / gain
    return StaticPressure(run, gain, float(np.mean(pressure[:5])), width)


@dataclass(frozen=True, slots=True)
class ServoPath:
    """Figure 12b: velocity (cm/s) over servo voltage; K in cm/s/V and T in s from the ramps of 1 V either way."""

    voltage_v: Array
    velocity_cm_s: Array
    gain_cm_s_v: float
    lag_s: float


def servo_path(bench: Bench, fresh: Callable[[], Plant]) -> ServoPath:
    """Constant voltages for half a second, each from rest; a ramp K u (t - T) is fitted to the later half."""
    velocities, lags = [], []
    n = bench.samples(SERVO_S)
    time_s = bench.sample_time_s * np.arange(n)
    later = slice(n // 2, n)
    for voltage in SERVO_V:
        run = driven(fresh(), np.zeros(n), np.full(n, voltage), f"{voltage:g} V")
        position = CM * run.signals["position_m"]
        slope, offset = np.polyfit(time_s[later], (position - position[0])[later], 1)
        velocities.append(float(slope))
        lags.append(-float(offset) / float(slope))
    voltages = np.array(SERVO_V)
    at_one = np.abs(voltages) == LAG_V
    gain = float(np.mean(np.array(velocities)[at_one] / voltages[at_one]))
    return ServoPath(voltages, np.array(velocities), gain, float(np.mean(np.array(lags)[at_one])))


def closed_square(bench: Bench, plant: Plant) -> Run:
    """Figure 12a: the position loop closed by 1 V/cm, square set-point of 1 cm either way, 0.5 Hz, 8 s."""
    config = LoopConfig(name="scaling gain", mode=ControlMode.PID, pid=PidConfig(p=1.0, error_scale=CM))
    setpoint = waveform_samples(Waveform(Shape.SQUARE, 0.01, 0.0, 0.5), bench.sample_time_s, bench.samples(8.0))
    rest = LoopController(LoopConfig(name="rest", mode=ControlMode.MANUAL), bench.sample_time_s)
    loop = LoopController(config, bench.sample_time_s)
    return run_loops(plant, rest, loop, np.zeros(setpoint.size), setpoint, "closed-loop square")


@dataclass(frozen=True, slots=True)
class Disturbance:
    """Figure 13: the piston under a step of load, servo valve at 0 V; kick (cm/MPa) and drift (cm/s/MPa)."""

    run: Run
    kick_cm_mpa: float
    drift_cm_s_mpa: float


def disturbance(bench: Bench, plant: Plant) -> Disturbance:
    """A step of the relief valve's voltage worth about 1 MPa at 1 s; both figures per MPa really reached."""
    n, at = bench.samples(DISTURBANCE_S), bench.samples(STEP_S)
    load = np.zeros(n)
    load[at:] = 1.0
    run = driven(plant, load, np.zeros(n), "load step")
    position, pressure = CM * run.signals["position_m"], run.signals["pressure_pa"] * MPA
    step = float(np.mean(pressure[-at:]) - np.mean(pressure[:at]))
    base = float(np.mean(position[:at]))
    time_s = bench.sample_time_s * np.arange(n)
    late = slice(bench.samples(STEP_S + DRIFT_FROM_S), n)
    slope = float(np.polyfit(time_s[late], position[late], 1)[0])
    before = float(np.polyfit(time_s[:at], position[:at], 1)[0])
    return Disturbance(run, (float(np.max(position[at:])) - base) / step, (slope - before) / step)


def pure_disturbance(bench: Bench) -> tuple[float, float]:
    """Kick (cm) and drift (cm/s) of the model under a true step of 1 MPa, as in path (6) alone."""
    plant = bench.fresh_model()
    n = bench.samples(DISTURBANCE_S)
    rest = plant.read().pressure_pa
    simulation = plant.model.simulate(np.zeros(n), np.zeros(n), pressure_pa=np.full(n, rest + 1e6))
    position = CM * simulation.position_m
    late = slice(bench.samples(DRIFT_FROM_S), n)
    time_s = bench.sample_time_s * np.arange(n)
    return float(np.max(position)), float(np.polyfit(time_s[late], position[late], 1)[0])
