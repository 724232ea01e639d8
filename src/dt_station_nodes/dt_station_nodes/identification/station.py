"""Identification of the station's paths: pressure, position (two ways), disturbance."""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from ..core.channels import Channel
from ..core.run import Run
from .errors import IdentificationError
from .estimate import Estimate, Interval
from .excitation import check_excitation, check_not_limited, check_response, signal_of
from .fitting import estimate
from .selection import Candidate, Selection, choose, orders, scored, select, undetermined_pole
from .structure import Data, Hold, PathStructure, Structure
from .transfer import TransferFunction

USUAL_SCALES = {"Pa": 1.0e6, "m": 0.01}
DISTURBANCE_PER_PA = 1.0e-6
DISTURBANCE_ORDERS = (3, 1)


class Method(str, Enum):
    """How a path was identified."""

    DIRECT = "direct"
    CLOSED_LOOP = "closed-loop"
    DISTURBANCE = "disturbance"


@dataclass(frozen=True)
class IdentifiedPath:
    """A channel's path in units of `scale` (SI per unit), its disturbance path if identified, and what it rests on."""

    channel: Channel
    method: Method
    selection: Selection
    data: Data
    transfer: TransferFunction
    gain: Interval
    disturbance: TransferFunction | None
    scale: float
    rest: float
    bias_v: Interval | None = None
    notes: tuple[str, ...] = ()

    @property
    def estimate(self) -> Estimate:
        """The chosen candidate's fit."""
        return self.selection.chosen.estimate


def output_scale(run: Run, channel: Channel) -> float:
    """SI units per unit of the transfer function's output: MPa and cm as in the paper, 1 for other units."""
    return USUAL_SCALES.get(run.unit(channel.signal), 1.0)


def direct_data(run: Run, channel: Channel, rest_pressure_pa: float | None = None) -> Data:
    """Voltage (and, given the rest pressure, pressure in MPa above it) to output in units of `output_scale`."""
    check_excitation(run, channel.voltage_signal)
    check_response(run, channel)
    names = [channel.voltage_signal]
    inputs = [signal_of(run, channel.voltage_signal)]
    if rest_pressure_pa is not None:
        check_excitation(run, Channel.PRESSURE.signal)
        inputs.append((signal_of(run, Channel.PRESSURE.signal) - rest_pressure_pa) * DISTURBANCE_PER_PA)
        names.append(Channel.PRESSURE.signal)
    output = signal_of(run, channel.signal) / output_scale(run, channel)
    return Data(run.sample_time_s, tuple(inputs), output, tuple(names), channel.signal)


def identify_direct(
    run: Run,
    channel: Channel,
    poles: Iterable[int] | None = None,
    zeros: Iterable[int] | None = None,
    integrators: int | None = None,
    delay_s: float | None = 0.0,
    rest_pressure_pa: float | None = None,
    disturbance_orders: Sequence[tuple[int, int]] = (DISTURBANCE_ORDERS,),
    advance: Callable[[str], None] = lambda text: None,
) -> IdentifiedPath:
    """Voltage to output, whether the loop was open or closed; with the disturbance path given a rest pressure.

    `delay_s` None: estimated where that pays. The position path has one integrator unless `integrators` says otherwise.
    """
    if integrators is None:
        integrators = 1 if channel is Channel.POSITION else 0
    if poles is None:
        poles = range(1 + integrators, 4) if integrators else range(1, 7)
    grid = tuple((n, m) for n, m in orders(poles, zeros) if n >= max(integrators, 1))
    if not grid:
        raise IdentificationError(
            f"A path with {integrators} integrators needs at least that many poles; ask for more."
        )
    data = direct_data(run, channel, rest_pressure_pa)
    structure = Structure(
        (PathStructure(grid[0][0], 0, integrators, Hold.HELD, delay_s or 0.0),), drift=integrators > 0
    )
    if rest_pressure_pa is not None:
        first, zero_count = disturbance_orders[0]
        aside = PathStructure(first, zero_count, min(integrators, first), Hold.SMOOTH)
        structure = replace(structure, paths=(*structure.paths, aside))
    selection = select(structure, data, grid, advance=advance)
    if rest_pressure_pa is not None and len(disturbance_orders) > 1:
        selection = select(selection.chosen.estimate.structure, data, disturbance_orders, path=1, advance=advance)
    if delay_s is None:
        selection = with_delay(selection, data, advance)
    fitted = selection.chosen.estimate
    scale = output_scale(run, channel)
    aside_path = fitted.paths[1] if rest_pressure_pa is not None else None
    notes: tuple[str, ...] = ()
    if aside_path is not None and undetermined_pole(fitted, 1):
        aside_path = None
        notes = (
            "the run does not determine the disturbance path, so it is left out of the model; "
            "run the experiment disturbance",
        )
    bias = None
    if integrators:
        bias = fitted.bias(0)
    return IdentifiedPath(
        channel,
        Method.DIRECT,
        selection,
        data,
        fitted.paths[0],
        fitted.gain(0),
        aside_path,
        scale,
        0.0 if integrators else fitted.offset.value * scale,
        bias if bias is not None and not bias.holds(0.0) else None,
        notes,
    )


def with_delay(selection: Selection, data: Data, advance: Callable[[str], None] = lambda text: None) -> Selection:
    """The selection with candidates whose delay is estimated added, no larger than the chosen one."""
    chosen = selection.chosen
    structure = chosen.estimate.structure
    added: list[Candidate] = []
    wanted = {(chosen.poles, chosen.zeros)}
    least = max(1, structure.paths[0].integrators)
    for n in range(max(chosen.poles - 2, least), chosen.poles):
        wanted |= {(n, m) for m in (0, chosen.zeros - 1) if 0 <= m < n}
    for poles, zeros in sorted(wanted):
        advance(f"{poles} poles, {zeros} zeros, delay")
        best: Estimate | None = None
        for samples in (0.5, 2.0):
            path = replace(
                structure.paths[0],
                poles=poles,
                zeros=zeros,
                delay_s=samples * data.sample_time_s,
                estimate_delay=True,
            )
            try:
                fitted = estimate(structure.with_path(0, path), data, refinements=1)
            except IdentificationError:
                continue
            if best is None or fitted.cost < best.cost:
                best = fitted
        if best is not None and best.delay(0).low > 0.0:
            added.append(scored(best, data, 0))
    return choose((*selection.candidates, *added))


def identify_closed_loop(
    run: Run, channel: Channel = Channel.POSITION, scaling_gain: float | None = None
) -> IdentifiedPath:
    """The paper's way for a first-order astatic path (equations (3) to (5)).

    The loop from set-point to output is estimated with 2 poles and no zero; without the free term of its denominator
    and divided by the scaling gain (V per output unit; read off the run where None) it is the open path.
    """
    check_excitation(run, channel.setpoint_signal)
    check_response(run, channel)
    scale = output_scale(run, channel)
    setpoint = signal_of(run, channel.setpoint_signal) / scale
    output = signal_of(run, channel.signal) / scale
    notes: list[str] = []
    if run.get(channel.voltage_signal) is not None:
        check_not_limited(run, channel)
    if scaling_gain is None:
        scaling_gain = proportional_gain(run, channel)
        notes.append(f"scaling gain {scaling_gain:.6g} V per output unit read off the run")
    if not (math.isfinite(scaling_gain) and scaling_gain > 0.0):
        raise IdentificationError(f"The scaling gain must be above 0 V per output unit, got {scaling_gain:g}.")
    data = Data(run.sample_time_s, (setpoint,), output, (channel.setpoint_signal,), channel.signal)
    fitted = estimate(Structure((PathStructure(2, 0),)), data)
    closed = fitted.paths[0]
    lead = closed.numerator[0] / scaling_gain
    transfer = TransferFunction((lead,), (1.0, closed.denominator[1], 0.0))
    velocity_gain = fitted.interval(lambda theta: float(theta[0] / scaling_gain / theta[1]))
    static = fitted.gain(0)
    doubt = "" if 0.9 < static.value < 1.1 else ": the path is not astatic, or the set-point was not reached"
    # to first order the hold delays by half a sample, which takes b0 h / 2 from the middle coefficient
    slowed = closed.denominator[1] + 0.5 * run.sample_time_s * closed.numerator[0]
    notes.append(
        f"the hold between samples is taken for dynamics of the path; with half a sample taken out the gain is "
        f"{lead / slowed:.4g} and the pole at {-slowed:.4g} rad/s"
    )
    notes.append(f"static gain of the closed loop {static.value:.4f} (1 for an astatic path){doubt}")
    selection = choose((scored(fitted, data, 0),))
    return IdentifiedPath(
        channel, Method.CLOSED_LOOP, selection, data, transfer, velocity_gain, None, scale, 0.0, notes=tuple(notes)
    )


def identify_disturbance(
    run: Run,
    rest_pressure_pa: float,
    grid: Sequence[tuple[int, int]] = (DISTURBANCE_ORDERS,),
    integrators: int = 1,
    advance: Callable[[str], None] = lambda text: None,
) -> IdentifiedPath:
    """Pressure (MPa above rest) to position with the servo valve at a constant voltage, as in the paper's figure 13."""
    channel = Channel.POSITION
    check_excitation(run, Channel.PRESSURE.signal)
    check_response(run, channel)
    scale = output_scale(run, channel)
    pressure = (signal_of(run, Channel.PRESSURE.signal) - rest_pressure_pa) * DISTURBANCE_PER_PA
    data = Data(run.sample_time_s, (pressure,), signal_of(run, channel.signal) / scale, (Channel.PRESSURE.signal,))
    structure = Structure((PathStructure(grid[0][0], 0, min(integrators, grid[0][0]), Hold.SMOOTH),))
    selection = select(structure, data, grid, advance=advance)
    fitted = selection.chosen.estimate
    return IdentifiedPath(
        channel, Method.DISTURBANCE, selection, data, fitted.paths[0], fitted.gain(0), fitted.paths[0], scale, 0.0
    )


def proportional_gain(run: Run, channel: Channel) -> float:
    """Gain of a proportional controller, V per output unit of `output_scale`, from the run's own signals."""
    scale = output_scale(run, channel)
    error = (signal_of(run, channel.setpoint_signal) - signal_of(run, channel.signal)) / scale
    voltage = signal_of(run, channel.voltage_signal)
    columns = np.column_stack([error, np.ones_like(error)])
    solution = np.linalg.lstsq(columns, voltage, rcond=None)[0]
    left = float(np.std(voltage - columns @ solution))
    if solution[0] <= 0.0 or left > 0.05 * float(np.std(voltage)):
        raise IdentificationError(
            "The closed-loop method needs a proportional controller, and this run's voltage is not proportional to the "
            "error; name the scaling gain, or use the direct method."
        )
    return float(solution[0])
