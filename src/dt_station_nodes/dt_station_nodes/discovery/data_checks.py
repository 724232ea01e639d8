"""Stage 1: what is wrong with the data, and what therefore cannot be concluded from them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..core.channels import Channel
from ..core.errors import StationError
from ..core.run import Run
from .noise import driven_noise, quantisation_step

Array = NDArray[np.float64]

MIN_SAMPLES = 100
FROZEN_SAMPLES = 8
WAKES = 4.0
NOISY_STEPS = 2.0  # steps of a quantised sensor: where neighbours differ by less, they may well be equal
BEFORE = 30  # samples looked at before such a stretch
FAINT = 6.0  # times the noise: a channel that moves less was held
MOVES = 1e-3  # of the voltage's standard deviation


class UnusableRunError(StationError):
    """The run cannot be examined at all."""


@dataclass(frozen=True, slots=True)
class ChannelCheck:
    """What one channel's data allow. `frozen_share`: of the samples, in stretches where the sensor stands still."""

    channel: Channel
    excited: bool
    clipped_share: float
    frozen_share: float
    frozen: NDArray[np.bool_]
    notes: tuple[str, ...]


def _stretches(flags: NDArray[np.bool_], shortest: int) -> NDArray[np.bool_]:
    """Flags kept only in stretches of at least `shortest`."""
    padded = np.concatenate(([False], flags, [False]))
    changes = np.flatnonzero(np.diff(padded.astype(np.int8)))
    kept = np.zeros(len(flags), dtype=np.bool_)
    for start, stop in zip(changes[::2], changes[1::2], strict=True):
        if stop - start >= shortest:
            kept[start:stop] = True
    return kept


def frozen_samples(measured: Array, voltage: Array) -> NDArray[np.bool_]:
    """Samples (n,) inside stretches of exactly equal values away from the extremes, while the voltage moves.

    Only where the signal otherwise changes at most samples. A noisy sensor cannot repeat itself for long unless it
    stands still. Without noise an object that stands repeats itself too, but it then sets off gently; a sensor that
    wakes up jumps to where the object has gone.
    """
    still = np.diff(measured) == 0.0
    kept = np.zeros(len(measured), dtype=np.bool_)
    if still.mean() > 0.6:
        return kept
    span = float(measured.max() - measured.min())
    inside = (measured > measured.min() + 1e-6 * span) & (measured < measured.max() - 1e-6 * span)
    flags = _stretches(np.concatenate(([False], still)) & inside, FROZEN_SAMPLES)
    step = quantisation_step(measured)
    moves = MOVES * float(np.std(voltage))
    edges = np.flatnonzero(np.diff(np.concatenate(([False], flags, [False])).astype(np.int8)))
    for start, stop in zip(edges[::2], edges[1::2], strict=True):
        if float(np.ptp(voltage[start : stop - 1])) <= moves:
            continue
        noisy = _like_noise(measured[max(0, start - BEFORE) : start], step)
        if noisy or (stop - start >= 4 * FROZEN_SAMPLES and _jumps(measured[stop - 1 : stop + 6], step)):
            kept[start:stop] = True
    return kept


def _like_noise(before: Array, step: float) -> bool:
    """Whether neighbouring samples differ as those of noise do: high differences far above the first ones.

    Noise below the `step` of a quantised sensor repeats itself.
    """
    if len(before) < BEFORE // 2:
        return False
    first = float(np.sqrt(np.mean(np.diff(before) ** 2)))
    return first > NOISY_STEPS * step and float(np.sqrt(np.mean(np.diff(before, 4) ** 2))) > 2.0 * first


def _jumps(after: Array, step: float) -> bool:
    """Whether what follows a stretch begins with a jump far above the movement after it."""
    changes = np.abs(np.diff(after))
    return len(changes) > 1 and bool(changes[0] > WAKES * max(float(np.median(changes[1:])), step))


def check_channel(run: Run, channel: Channel) -> ChannelCheck:
    """Excitation, clipping and frozen stretches of one channel."""
    voltage = run.signals[channel.voltage_signal]
    measured = run.signals[channel.signal]
    notes: list[str] = []
    span = float(measured.max() - measured.min())
    swing = float(np.std(voltage))
    excited = swing > 1e-6 * max(1.0, float(np.abs(voltage).max())) and span > 0.0
    if not excited:
        notes.append(f"{channel.value}: the voltage does not move, so nothing about this path can be concluded")
    elif float(np.std(measured)) < FAINT * driven_noise(measured, voltage):
        excited = False
        notes.append(
            f"{channel.value}: it moves by less than {FAINT:g} times its noise, so nothing about this path can be "
            "concluded; let it move further"
        )
    limit = span * 1e-9
    top = measured >= measured.max() - limit
    bottom = measured <= measured.min() + limit
    clipped = _stretches(top, 10) | _stretches(bottom, 10)
    clipped_share = float(clipped.mean()) if excited else 0.0
    if clipped_share > 0.02:
        notes.append(
            f"{channel.value}: {clipped_share:.0%} of the samples stand exactly at the highest or lowest value; "
            "that is a stop, an overflow or a clipped sensor"
        )
    frozen = frozen_samples(measured, voltage) if excited else np.zeros(len(measured), dtype=np.bool_)
    if frozen.any():
        notes.append(
            f"{channel.value}: the sensor repeats exactly the same value for {frozen.mean():.1%} of the samples, "
            "so it may be frozen at times"
        )
    elif span and excited:
        moves = int(np.count_nonzero(np.abs(np.diff(voltage)) > 1e-9 * swing))
        if moves < 5:
            notes.append(f"{channel.value}: the voltage changes {moves} times only; a richer waveform would say more")
    return ChannelCheck(channel, excited, clipped_share, float(frozen.mean()), frozen, tuple(notes))


def check_run(run: Run) -> tuple[ChannelCheck, ...]:
    """Checks of every channel with a voltage and a measurement.

    Raises UnusableRunError where nothing can be examined: no such channel, too few samples,
    values that are not finite.
    """
    channels = run.channels()
    if not channels:
        raise UnusableRunError(
            f"{run.source or 'the run'} has no channel with both a voltage and a measured quantity; "
            "give load_voltage_v with pressure_pa or servo_voltage_v with position_m"
        )
    if len(run) < MIN_SAMPLES:
        raise UnusableRunError(
            f"{run.source or 'the run'} has {len(run)} samples; discovery needs at least {MIN_SAMPLES}"
        )
    for name, values in run.signals.items():
        if name.endswith(("setpoint_pa", "setpoint_m")):
            continue
        bad = np.flatnonzero(~np.isfinite(values))
        if len(bad):
            raise UnusableRunError(f"{run.source or 'the run'}: {name} is not a number in row {int(bad[0]) + 1}")
    return tuple(check_channel(run, channel) for channel in channels)
