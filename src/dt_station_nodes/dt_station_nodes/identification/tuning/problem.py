"""What an optimisation tries: an experiment on the simulated loops, and the cost it gives a setting."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from ...core.channels import Channel
from ...core.closed_loop import ModelPlant, run_loops
from ...core.control import LoopConfig, LoopController
from ...core.models import ModelSpec, PlantModel
from ...core.run import Run
from ...core.waveforms import Shape, Waveform, waveform_samples
from .criteria import StepFigures, error_index, step_figures
from .errors import TuningError
from .stability import Stability, stability

Array = NDArray[np.float64]


class Goal(BaseModel):
    """What is wanted: weights of what to make small, and bounds not to cross.

    Each weighted figure is taken relative to that of the setting started from, so weights are plain shares.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    ise: float = Field(default=1.0, ge=0.0)
    itae: float = Field(default=1.0, ge=0.0)
    hold: float = Field(default=1.0, ge=0.0, description="the paper's index (8) under load; position loop only")
    travel: float = Field(default=0.02, ge=0.0, description="voltage use: the sum of its changes")
    overshoot_percent: float = Field(default=0.5, ge=0.0, description="at most")
    gain_margin: float = Field(default=2.0, gt=1.0, description="at least, ratio")
    phase_margin_deg: float = Field(default=45.0, gt=0.0, lt=180.0, description="at least")
    peak_v: float | None = Field(default=None, gt=0.0, description="at most")


@dataclass(frozen=True, slots=True)
class Trial:
    """One setting, tried: its step, its index (8) under load (position loop, mm^2), its margins."""

    config: LoopConfig
    step: StepFigures
    hold_index: float | None
    stability: Stability


@dataclass(frozen=True, slots=True)
class Experiment:
    """The simulated experiment of one loop.

    The load loop follows a step up from `low` and down again, `half` samples each; the position loop makes a move
    of `low` to `high` and then holds it for `hold` samples under a square load of the `load_waveform`, run by the
    `other` loop.
    """

    model: ModelSpec
    channel: Channel
    other: LoopConfig
    sample_time_s: float
    low: float
    high: float
    half: int
    hold: int
    load_waveform: Waveform

    def run(self, config: LoopConfig) -> Run:
        """Both loops on the model, with all of its effects."""
        plant = PlantModel(self.model, self.sample_time_s)
        tuned = LoopController(config, self.sample_time_s)
        other = LoopController(self.other, self.sample_time_s)
        if self.channel is Channel.PRESSURE:
            state = plant.initial_state(pressure_pa=self.low)
            load = np.concatenate([np.full(self.half, self.low), np.full(self.half, self.high)])
            load = np.concatenate([load, np.full(self.half, self.low)])
            return run_loops(ModelPlant(plant, state), tuned, other, load, np.zeros(load.size))
        n = self.half + self.hold
        load = waveform_samples(self.load_waveform, self.sample_time_s, n)
        load[: self.half] = self.load_waveform.offset
        state = plant.initial_state(position_m=self.low)
        return run_loops(ModelPlant(plant, state), other, tuned, load, np.full(n, self.high))

    def figures(self, run: Run, error_scale: float) -> tuple[StepFigures, float | None]:
        """Figures of the step in the controller's error units, and the index (8) of the hold in mm^2."""
        response = run.signals[self.channel.signal] * error_scale
        voltage = run.signals[self.channel.voltage_signal]
        low, high, half = self.low * error_scale, self.high * error_scale, self.half
        if self.channel is Channel.PRESSURE:
            part = slice(half, 2 * half)
            return step_figures(low, high, response[part], voltage[part], self.sample_time_s), None
        step = step_figures(low, high, response[:half], voltage[:half], self.sample_time_s)
        position = 1e3 * run.signals[self.channel.signal][half:]
        return step, error_index(np.full(self.hold, 1e3 * self.high), position)

    def trial(self, config: LoopConfig, error_scale: float) -> Trial:
        """One setting, judged in full."""
        step, hold = self.figures(self.run(config), error_scale)
        return Trial(config, step, hold, stability(self.model, self.channel, config, self.sample_time_s))


def usual_experiment(model: ModelSpec, channel: Channel, other: LoopConfig, sample_time_s: float = 0.02) -> Experiment:
    """The paper's: a step of 1 MPa well inside the valve's range; a move of 10 cm, then two cycles of square load."""
    if channel not in model.paths:
        raise TuningError(f"model {model.name} has no {channel.value} path; choose another model or channel")
    square = Waveform(Shape.SQUARE, 1.5e6, 3.0e6, 0.25)
    if channel is Channel.PRESSURE:
        samples = max(1, round(3.0 / sample_time_s))
        return Experiment(model, channel, other, sample_time_s, 2.0e6, 3.0e6, samples, 0, square)
    move, hold = max(1, round(4.0 / sample_time_s)), max(1, round(8.0 / sample_time_s))
    return Experiment(model, channel, other, sample_time_s, 0.0, 0.1, move, hold, square)
