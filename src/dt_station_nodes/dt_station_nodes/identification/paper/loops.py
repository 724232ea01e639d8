"""The paper's closed-loop experiments: the load's square response and the held position under square load."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...core.closed_loop import Plant, run_loops
from ...core.control import LoopController
from ...core.run import Run
from ...core.waveforms import Shape, Waveform, waveform_samples
from ..tuning import StepFigures, error_index, step_figures
from .bench import Bench

Array = NDArray[np.float64]

MPA, CM, MM = 1e-6, 100.0, 1000.0
LOW_PA, HIGH_PA = 2.0e6, 3.0e6
HALF_S, CYCLES = 4.0, 5
LOAD = Waveform(Shape.SQUARE, 1.5e6, 3.0e6, 0.25)
PLACE_M = 0.1
LENGTH_S, FROM_S, TO_S = 24.0, 4.0, 20.0
MOVE_S = 4.0


@dataclass(frozen=True, slots=True)
class PressureResponse:
    """The load loop's square response; `mean_pa` is the mean rising edge, which rids it of noise."""

    run: Run
    mean_pa: Array
    within_2_percent: StepFigures
    within_5_percent: StepFigures


def pressure_response(bench: Bench, plant: Plant, pi: str) -> PressureResponse:
    """Square set-point between 2 and 3 MPa, 4 s each, the piston held; figures in MPa of the mean rising edge."""
    half = bench.samples(HALF_S)
    setpoint = np.tile(np.repeat([LOW_PA, HIGH_PA], half), CYCLES)
    run = run_loops(
        plant, bench.controller(pi), bench.controller("position_pid"), setpoint, np.zeros(setpoint.size), pi
    )
    edges = [(2 * k + 1) * half for k in range(CYCLES)]
    mean = np.mean([run.signals["pressure_pa"][e : e + half] for e in edges], axis=0)
    voltage = np.mean([run.signals["load_voltage_v"][e : e + half] for e in edges], axis=0)

    def figures(band: float) -> StepFigures:
        return step_figures(LOW_PA * MPA, HIGH_PA * MPA, mean * MPA, voltage, bench.sample_time_s, band)

    return PressureResponse(run, mean, figures(0.02), figures(0.05))


@dataclass(frozen=True, slots=True)
class Hold:
    """A position moved to and held under square load for 24 s.

    `index` is (8) over 4 to 20 s (mm^2); `static_error_cm` the mean error over it, four whole load cycles;
    `growth_cm` by how much the mean error of the last cycle exceeds that of the first; `overshoot_percent` of the
    move.
    """

    run: Run
    index: float
    static_error_cm: float
    growth_cm: float
    overshoot_percent: float


def hold(bench: Bench, plant: Plant, controller: str | LoopController) -> Hold:
    """Load square of 0.25 Hz, 3 MPa plus and minus 1.5 MPa, by the optimised PI; position to 10 cm at the start."""
    n = bench.samples(LENGTH_S)
    loop = bench.controller(controller) if isinstance(controller, str) else controller
    load = waveform_samples(LOAD, bench.sample_time_s, n)
    run = run_loops(plant, bench.controller("pressure_pi"), loop, load, np.full(n, PLACE_M), loop.config.name)
    position = CM * run.signals["position_m"]
    part = slice(bench.samples(FROM_S), bench.samples(TO_S))
    error = (CM * PLACE_M - position)[part]
    cycle = bench.samples(1.0 / LOAD.frequency_hz)
    move = position[: bench.samples(MOVE_S)]
    start = float(position[0])
    return Hold(
        run,
        error_index(np.full(error.size, MM * PLACE_M), MM * run.signals["position_m"][part]),
        float(np.mean(error)),
        float(abs(np.mean(error[-cycle:])) - abs(np.mean(error[:cycle]))),
        max(0.0, 100.0 * float(np.max(move) - CM * PLACE_M) / (CM * PLACE_M - start)),
    )
