"""Is the sampled loop stable, by how much, and which pole says otherwise."""

import math
from dataclasses import dataclass
from functools import lru_cache

import control
import numpy as np
from numpy.typing import NDArray

from ...core.channels import Channel
from ...core.control import LoopConfig
from ...core.models import ModelSpec, PathSpec, coefficients
from ...core.samples import ControlMode
from .errors import TuningError
from .forms import error_scale, fuzzy_slopes, fuzzy_steepest, linear

Array = NDArray[np.float64]

# A pole so near the unit circle that no run of usual length shows its growth.
SLOW_S = 60.0
ON_CIRCLE = 1e-9


@dataclass(frozen=True, slots=True)
class SlowPole:
    """An unstable pole whose growth takes longer than `SLOW_S`: |z| and its e-folding time (s)."""

    magnitude: float
    e_folding_s: float


@dataclass(frozen=True, slots=True)
class Stability:
    """Margins of a sampled loop on its linear path (zero-order hold, no computing delay).

    `gain_margin` (ratio) is by how much the gain may grow, `gain_reduction` (ratio) by how much it may fall (inf:
    to nothing); `phase_margin_deg` and `delay_margin_s` are the least over all crossovers; infinite where there is
    none. `poles` are the closed loop's, largest first.
    """

    stable: bool
    gain_margin: float
    gain_reduction: float
    phase_margin_deg: float
    delay_margin_s: float
    crossover_rad_s: float
    poles: tuple[complex, ...]
    slow_poles: tuple[SlowPole, ...]
    findings: tuple[str, ...]

    @property
    def gain_margin_db(self) -> float:
        """Gain margin in dB."""
        return 20.0 * math.log10(self.gain_margin) if self.gain_margin > 0.0 else -math.inf


def continuous_path(model: ModelSpec, channel: Channel) -> control.TransferFunction:
    """The channel's linear path, V to the path's unit, gain and time scale applied."""
    path = model.paths.get(channel)
    if path is None:
        raise TuningError(f"model {model.name} has no {channel.value} path; choose another model or channel")
    return _transfer(*_key(path))


def sampled_path(model: ModelSpec, channel: Channel, sample_time_s: float) -> control.TransferFunction:
    """Zero-order-hold equivalent of the path at the sample time."""
    continuous_path(model, channel)
    return _sampled(*_key(model.paths[channel]), sample_time_s)


def _key(path: PathSpec) -> tuple[tuple[float, ...], tuple[float, ...]]:
    numerator, denominator = coefficients(path)
    return tuple(numerator.tolist()), tuple(denominator.tolist())


@lru_cache(maxsize=32)
def _transfer(numerator: tuple[float, ...], denominator: tuple[float, ...]) -> control.TransferFunction:
    return control.tf(np.trim_zeros(np.array(numerator), "f"), denominator)


@lru_cache(maxsize=32)
def _sampled(
    numerator: tuple[float, ...], denominator: tuple[float, ...], sample_time_s: float
) -> control.TransferFunction:
    return control.c2d(_transfer(numerator, denominator), sample_time_s, "zoh")


def open_loop(
    model: ModelSpec, channel: Channel, config: LoopConfig, sample_time_s: float, fuzzy_slope: float | None = None
) -> control.TransferFunction:
    """Controller times path, both sampled, dimensionless."""
    scale = model.paths[channel].scale * error_scale(config) if channel in model.paths else 1.0
    path = sampled_path(model, channel, sample_time_s)
    return linear(config, sample_time_s, fuzzy_slope) * path * scale


def stability(model: ModelSpec, channel: Channel, config: LoopConfig, sample_time_s: float) -> Stability:
    """Poles and margins of one loop; a fuzzy one is judged at its steepest slope, wherever on its surface that is.

    Effects of the model (dead zone, saturation ...) and limits are left out: margins are of the linear loop.
    """
    slope = None
    notes: list[str] = []
    if config.mode is ControlMode.FUZZY and config.fuzzy is not None:
        low, high = fuzzy_slopes(config.fuzzy)
        slope = fuzzy_steepest(config.fuzzy)
        notes.append(
            f"fuzzy surface: {low:.3g} to {high:.3g} V/{config.fuzzy.error.unit} at no error, "
            f"judged at its steepest, {slope:.3g} V/{config.fuzzy.error.unit}"
        )
    loop = open_loop(model, channel, config, sample_time_s, slope)
    poles = np.roots(np.polyadd(loop.num[0][0], loop.den[0][0])).astype(complex)
    poles = poles[np.argsort(-np.abs(poles), kind="stable")]
    outside = [p for p in poles if abs(p) > 1.0 + ON_CIRCLE]
    slow = tuple(
        SlowPole(float(abs(p)), sample_time_s / math.log(abs(p)))
        for p in outside
        if sample_time_s / math.log(abs(p)) > SLOW_S
    )
    notes.extend(_name(pole, config) for pole in slow)
    fast = [p for p in outside if sample_time_s / math.log(abs(p)) <= SLOW_S]
    if fast:
        growth = sample_time_s / math.log(abs(fast[0]))
        notes.append(
            f"unstable: {len(fast)} pole(s) outside the unit circle, |z| = {abs(fast[0]):.6g}, "
            f"growing e-fold in {growth:.3g} s"
        )
    gain, reduction, phase, delay, crossover = _margins(loop, sample_time_s)
    return Stability(
        stable=not outside,
        gain_margin=gain,
        gain_reduction=reduction,
        phase_margin_deg=phase,
        delay_margin_s=delay,
        crossover_rad_s=crossover,
        poles=tuple(complex(p) for p in poles),
        slow_poles=slow,
        findings=tuple(notes),
    )


def _name(pole: SlowPole, config: LoopConfig) -> str:
    minutes = pole.e_folding_s / 60.0
    why = ""
    if config.mode is ControlMode.PID and config.pid is not None and config.pid.i < 0.0:
        why = f", from the negative integral gain I = {config.pid.i:g}"
    return (
        f"slow unstable pole |z| = {pole.magnitude:.6f}{why}: the loop drifts away e-fold in {minutes:.0f} minutes; "
        "runs much shorter than that do not show it"
    )


def _margins(loop: control.TransferFunction, sample_time_s: float) -> tuple[float, float, float, float, float]:
    """Gain margin, gain reduction margin, phase margin (deg), delay margin (s), crossover (rad/s).

    Read off the frequency response on a fine grid: python-control's own margins are the same (a test compares)
    but take a third of a second, and the optimiser asks hundreds of times.
    """
    omega, z = _grid(sample_time_s)
    response = np.polyval(loop.num[0][0], z) / np.polyval(loop.den[0][0], z)
    log_size, phase = np.log(np.abs(response)), np.unwrap(np.angle(response))
    gain, reduction = math.inf, math.inf
    lowest, highest = float(phase.min()), float(phase.max())
    for turn in range(
        math.floor((lowest - math.pi) / (2 * math.pi)), math.ceil((highest + math.pi) / (2 * math.pi)) + 1
    ):
        for _, log_gain in _crossings(phase - (2 * turn + 1) * math.pi, omega, log_size):
            if log_gain < 0.0:
                gain = min(gain, math.exp(-log_gain))
            elif log_gain > 0.0:
                reduction = min(reduction, math.exp(log_gain))
    # At the Nyquist frequency the response is real: its last point may lie on the negative axis.
    if response[-1].real < 0.0 and abs(response[-1].imag) < 1e-6 * abs(response[-1]) and abs(response[-1]) < 1.0:
        gain = min(gain, 1.0 / abs(response[-1]))
    margin, delay, crossover = math.inf, math.inf, math.nan
    for frequency, angle in _crossings(log_size, omega, phase):
        degrees = math.remainder(math.degrees(angle) + 180.0, 360.0)
        delay = min(delay, math.radians(degrees % 360.0) / frequency)
        if abs(degrees) < abs(margin):
            margin, crossover = degrees, frequency
    return gain, reduction, margin, delay, crossover


@lru_cache(maxsize=8)
def _grid(sample_time_s: float) -> tuple[Array, NDArray[np.complex128]]:
    # Fine enough for six digits; from far below any crossover of interest up to the Nyquist frequency.
    omega = np.geomspace(1e-4 / sample_time_s, math.pi / sample_time_s, 3000)
    return omega, np.exp(1j * omega * sample_time_s)


def _crossings(values: Array, omega: Array, reading: Array) -> list[tuple[float, float]]:
    """Frequencies where `values` changes sign, with `reading` there; linear in the logarithm of frequency."""
    at = np.flatnonzero((values[:-1] < 0.0) != (values[1:] < 0.0))
    share = values[at] / (values[at] - values[at + 1])
    frequency = np.exp(np.log(omega[at]) + share * (np.log(omega[at + 1]) - np.log(omega[at])))
    return list(zip(frequency.tolist(), (reading[at] + share * (reading[at + 1] - reading[at])).tolist(), strict=True))
