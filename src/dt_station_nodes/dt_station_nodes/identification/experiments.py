"""Identification experiments as pure plans: what drives each valve, sample by sample."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from ..core.channels import Channel
from ..core.run import Run
from ..core.waveforms import Shape, Waveform, WaveformGenerator, WaveformState
from .errors import IdentificationError

CONSTANT = Waveform(Shape.CONSTANT)


@dataclass(frozen=True, slots=True)
class Drive:
    """One valve: voltage = voltage waveform + gain (set-point waveform - measurement), within limits.

    `voltage` is a schedule of (from s, waveform in V); `setpoint` in Pa or m; `gain_v_per_unit` in V per Pa or m,
    0 for an open loop.
    """

    voltage: tuple[tuple[float, Waveform], ...] = ((0.0, CONSTANT),)
    setpoint: Waveform = CONSTANT
    gain_v_per_unit: float = 0.0
    low_v: float = -10.0
    high_v: float = 10.0

    def __post_init__(self) -> None:
        if not self.low_v < self.high_v or not math.isfinite(self.gain_v_per_unit):
            raise IdentificationError("A drive needs its low limit below its high one and a finite gain.")


@dataclass(frozen=True, slots=True)
class ExperimentPlan:
    """A whole experiment; it ends early where the piston is further than `travel_m` from mid-stroke."""

    name: str
    purpose: str
    duration_s: float
    load: Drive
    position: Drive
    travel_m: float = 0.25


@dataclass(frozen=True, slots=True)
class DriverState:
    """Sample count and the running waveforms: (voltage, set-point) of load and position."""

    sequence: int
    load: tuple[WaveformState, WaveformState]
    position: tuple[WaveformState, WaveformState]


@dataclass(frozen=True, slots=True)
class DriverOutput:
    """Set-point (Pa or m) and voltage (V) of each channel for one sample."""

    setpoint: Mapping[Channel, float]
    voltage_v: Mapping[Channel, float]


class ExperimentDriver:
    """Plays a plan: step(state, measurements) -> state, voltages."""

    def __init__(self, plan: ExperimentPlan, sample_time_s: float) -> None:
        """Raises IdentificationError where a waveform is faster than the sampling."""
        self.plan = plan
        self.sample_time_s = sample_time_s
        self.samples = round(plan.duration_s / sample_time_s)
        if self.samples < 2:
            raise IdentificationError(f"An experiment of {plan.duration_s:g} s has fewer than 2 samples; lengthen it.")
        for drive in (plan.load, plan.position):
            for waveform in (*(w for _, w in drive.voltage), drive.setpoint):
                if waveform.shape is not Shape.CONSTANT and waveform.frequency_hz > 0.25 / sample_time_s:
                    raise IdentificationError(
                        f"A waveform of {waveform.frequency_hz:g} Hz is too fast for samples every {sample_time_s:g} s."
                    )
        self._generator = WaveformGenerator(sample_time_s)

    def initial_state(self) -> DriverState:
        """Before sample 0."""
        return DriverState(0, self._begin(self.plan.load), self._begin(self.plan.position))

    def finished(self, state: DriverState) -> bool:
        """Whether the plan is through."""
        return state.sequence >= self.samples

    def step(self, state: DriverState, pressure_pa: float, position_m: float) -> tuple[DriverState, DriverOutput]:
        """Voltages for this sample. Raises IdentificationError where the piston has left its allowed travel."""
        plan = self.plan
        if abs(position_m) > plan.travel_m:
            raise IdentificationError(
                f"Experiment {plan.name} stopped at {state.sequence * self.sample_time_s:.2f} s: the piston is at "
                f"{position_m:.3f} m, more than {plan.travel_m:g} m from mid-stroke; lower the amplitude."
            )
        time_s = state.sequence * self.sample_time_s
        load, load_setpoint, load_v = self._drive(plan.load, state.load, time_s, pressure_pa)
        position, position_setpoint, servo_v = self._drive(plan.position, state.position, time_s, position_m)
        return DriverState(state.sequence + 1, load, position), DriverOutput(
            {Channel.PRESSURE: load_setpoint, Channel.POSITION: position_setpoint},
            {Channel.PRESSURE: load_v, Channel.POSITION: servo_v},
        )

    def _begin(self, drive: Drive) -> tuple[WaveformState, WaveformState]:
        return self._generator.initial_state(drive.voltage[0][1]), self._generator.initial_state(drive.setpoint)

    def _drive(
        self, drive: Drive, state: tuple[WaveformState, WaveformState], time_s: float, measured: float
    ) -> tuple[tuple[WaveformState, WaveformState], float, float]:
        playing = [waveform for start, waveform in drive.voltage if start <= time_s + 1e-9][-1]
        voltage_state, voltage = self._generator.step(state[0], playing)
        setpoint_state, setpoint = self._generator.step(state[1])
        total = voltage + drive.gain_v_per_unit * (setpoint - measured)
        return (voltage_state, setpoint_state), setpoint, min(max(total, drive.low_v), drive.high_v)


Exchange = Callable[[float, float], tuple[float, float]]


def run_in_process(
    plan: ExperimentPlan,
    sample_time_s: float,
    read: Callable[[], tuple[float, float]],
    write: Exchange,
    source: str = "",
    advance: Callable[[], None] = lambda: None,
) -> Run:
    """Play a plan on an object: `read` gives (pressure Pa, position m), `write` takes and returns (load V, servo V)."""
    driver = ExperimentDriver(plan, sample_time_s)
    state = driver.initial_state()
    rows = np.empty((driver.samples, 6))
    for k in range(driver.samples):
        pressure, position = read()
        state, output = driver.step(state, pressure, position)
        applied = write(output.voltage_v[Channel.PRESSURE], output.voltage_v[Channel.POSITION])
        setpoints = (output.setpoint[Channel.PRESSURE], output.setpoint[Channel.POSITION])
        rows[k] = (*setpoints, *applied, pressure, position)
        advance()
    names = [c.setpoint_signal for c in Channel] + [c.voltage_signal for c in Channel] + [c.signal for c in Channel]
    drives = {Channel.PRESSURE: plan.load, Channel.POSITION: plan.position}
    open_loops = {c.setpoint_signal for c, drive in drives.items() if drive.gain_v_per_unit == 0.0}
    signals = {name: rows[:, i].copy() for i, name in enumerate(names) if name not in open_loops}
    return Run(sample_time_s, signals, source=source)


def _squares(low: float, high: float, *frequencies_hz: float, duration_s: float) -> tuple[tuple[float, Waveform], ...]:
    """Square waves one after the other, each for the same share of the time: richer than one alone."""
    half, middle = 0.5 * (high - low), 0.5 * (high + low)
    share = duration_s / len(frequencies_hz)
    return tuple((i * share, Waveform(Shape.SQUARE, half, middle, f)) for i, f in enumerate(frequencies_hz))


HOLD_V_PER_M = 100.0


def _load(*voltage: tuple[float, Waveform]) -> Drive:
    """An open-loop drive of the relief valve, 0 to 5 V."""
    return Drive(voltage, low_v=0.0, high_v=5.0)


def experiments(
    centre_m: float = 0.0, duration_s: float | None = None, amplitude: float = 1.0
) -> dict[str, ExperimentPlan]:
    """The station's identification experiments by name; `amplitude` (0..1] shrinks what drives the tested path."""
    if not 0.0 < amplitude <= 1.0:
        raise IdentificationError(
            f"The amplitude is a share of the usual one, above 0 and at most 1, got {amplitude:g}."
        )
    if duration_s is not None and not 0.0 < duration_s < 1e5:
        raise IdentificationError(f"The duration must be above 0 s, got {duration_s:g} s.")
    t = 60.0 if duration_s is None else duration_s
    slow = 120.0 if duration_s is None else duration_s
    top = 5.0 * amplitude
    hold = Drive(setpoint=Waveform(Shape.CONSTANT, offset=centre_m), gain_v_per_unit=HOLD_V_PER_M)
    square = Waveform(Shape.SQUARE, 0.01 * amplitude, centre_m, 0.5)
    rest = _load((0.0, CONSTANT))
    plans = (
        ExperimentPlan(
            "pressure-square",
            "pressure path (1): load voltage 0/5 V square, open loop, position held",
            t,
            _load(*_squares(0.0, top, 0.5, 1.1, 2.3, 4.1, duration_s=t)),
            hold,
        ),
        ExperimentPlan(
            "position-square",
            "position path (5): square set-point in a proportional loop, load at rest",
            t,
            rest,
            Drive(setpoint=square, gain_v_per_unit=HOLD_V_PER_M),
        ),
        ExperimentPlan(
            "disturbance",
            "disturbance path (6): load voltage square, servo valve at 0 V",
            t,
            _load(*_squares(0.0, top, 0.7, 1.3, 2.9, duration_s=t)),
            Drive(),
        ),
        ExperimentPlan(
            "pressure-triangle",
            "static characteristic of the pressure path: slow triangle 0/5 V, position held",
            slow,
            _load((0.0, Waveform(Shape.TRIANGLE, 0.5 * top, 0.5 * top, 2.0 / slow))),
            hold,
        ),
        ExperimentPlan(
            "position-triangle",
            "static characteristic of the position path: slow triangle on the servo valve, drift held by a weak loop",
            slow,
            rest,
            Drive(
                ((0.0, Waveform(Shape.TRIANGLE, amplitude, 0.0, 0.125, 0.5 * math.pi)),),
                Waveform(Shape.CONSTANT, offset=centre_m),
                2.0,
            ),
        ),
        ExperimentPlan(
            "joint",
            "all three paths from one run: load voltage square and set-point square together",
            t,
            _load(*_squares(0.0, top, 0.5, 1.1, 2.3, 4.1, duration_s=t)),
            Drive(setpoint=replace(square, frequency_hz=0.37), gain_v_per_unit=HOLD_V_PER_M),
        ),
    )
    return {plan.name: plan for plan in plans}
