"""One channel of one run as a fitting problem: its residual, and its scale of every quantity."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from ..core.channels import Channel
from ..core.models import ModelSpec, PathSimulator, PathSpec, at_places
from ..core.models.effects import Quantity
from ..core.run import Run
from .condense import slowest_s
from .noise import difference_noise, driven_noise
from .scales import excitations_hz, scales
from .settings import DiscoverySettings
from .terms import refits_all
from .windows import Windows, make_windows

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Problem:
    """Everything fixed about fitting one channel of one run.

    `weights` (n,) are 0 where a sample says nothing (start-up, frozen sensor), else 1; `signal` is the
    standard deviation of the compared part of the measured signal; `scales` the run's range of each quantity;
    `excitations_hz` the fundamentals of what drives the run, where it is periodic; `inherited` what the noise and the
    coarse sampling of the measured load leave in any simulation driven by it; `rough`: a linear path of foreign data,
    refitted as a whole, no model of which reaches the noise; `may_be_rough`: one that may turn out to be such; `limit`:
    a residual beyond which a simulation has run away.
    """

    channel: Channel
    simulator: PathSimulator
    measured: Array
    windows: Windows
    weights: Array
    noise: float
    signal: float
    scales: Mapping[Quantity, float]
    excitations_hz: tuple[float, ...] = ()
    inherited: float = 0.0
    rough: bool = False
    may_be_rough: bool = False
    limit: float = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "limit", 1e3 * (float(np.abs(self.measured).max()) + self.signal))

    @property
    def sigma(self) -> float:
        """Size of a residual that counts as nothing: noise and a trace of form error."""
        return float(np.sqrt(self.noise**2 + (0.002 * self.signal) ** 2 + self.inherited**2))

    @property
    def negligible(self) -> float:
        """Size of a residual that no one would call a gap, noise apart."""
        return float(np.hypot(NEGLIGIBLE * self.signal, self.inherited))

    @property
    def standing_load(self) -> bool:
        """Whether the measured load hardly moves about where it stands."""
        load = self.simulator.load_pa
        return bool(len(load)) and float(np.std(load)) < _STANDING * abs(float(np.mean(load)))

    @property
    def loaded(self) -> bool:
        """Whether a load that moves was measured."""
        return len(self.simulator.load_pa) > 0 and not self.standing_load

    def coarse(self, path: PathSpec) -> "Problem":
        """The same with a path simulated coarsely: enough for its slopes, and to tell which start is the best."""
        simulator = self.simulator.coarse(path)
        return self if simulator is self.simulator else replace(self, simulator=simulator)

    @property
    def length_s(self) -> float:
        """How long the run lasts."""
        return len(self.measured) * self.simulator.sample_time_s

    def excited_at(self, frequency_hz: float, turns: float) -> bool:
        """Whether a frequency is a harmonic or a beat of what drives the run: less than `turns` in it apart."""
        bases = self.excitations_hz
        orders = [(base, round(frequency_hz / base)) for base in bases]
        known = [order * base for base, order in orders if 1 <= order <= _HARMONICS]
        known += [abs(one + sign * other) for one, other in combinations(bases, 2) for sign in (1.0, -1.0)]
        return any(abs(frequency_hz - one) * self.length_s < turns for one in known)

    def residual(self, path: PathSpec) -> Array:
        """Measured minus simulated, offsets of anchored windows taken out, shape (n,)."""
        return self.compare(self.simulate(path))

    def simulate(self, path: PathSpec) -> Array:
        """Output of a path (SI), shape (n,): where its place counts, kept about where it was measured."""
        if at_places(path):
            return self.simulator.simulate_beside(path, self.measured)
        return self.simulator.simulate(path)

    def compare(self, simulated: Array) -> Array:
        """The residual of a simulated output (n,)."""
        gap = self.measured - simulated
        if np.abs(gap).max() < self.limit:
            return self.windows.project(gap) * self.weights
        # A simulation that runs away is far off everywhere: within a window its offset would be all there is of it.
        sane = np.abs(gap) < self.limit
        gap = np.clip(np.nan_to_num(gap, nan=self.limit), -self.limit, self.limit)
        return np.where(sane, self.windows.project(gap), self.limit) * self.weights


# A residual below this share of the signal is form error that no one would call a gap.
NEGLIGIBLE = 1e-3
# Long windows see slow effects, short ones keep drift from swamping the rest: as many samples, up to
# so long a time, and more only as long as noise hides what moves within a window.
_WINDOW_SAMPLES = 150
_LONGEST_WINDOW_S = 3.0
_TELLING = 100.0
# A run that does not begin at rest is compared from where its beginning is forgotten, time constants; at most
# so many seconds, or so much of a long run, twice that where samples are many.
_FORGOTTEN = 7.0
_STANDING = 0.05
_SETTLING_S = 0.4
_HARMONICS = 5
_SETTLING_SHARE = 0.05
_MANY = 2000


def integrates(path: PathSpec) -> bool:
    """Whether the path has a pole at zero."""
    return path.denominator[-1] == 0.0


def telling_window(measured: Array, sample_time_s: float, noise: float) -> float:
    """Length (s) of the shortest windows in which an integrating output moves well above its noise."""
    longest = max(_LONGEST_WINDOW_S, _WINDOW_SAMPLES * sample_time_s)
    length = _WINDOW_SAMPLES * sample_time_s
    while length < longest:
        moved = make_windows(len(measured), sample_time_s, length, True).project(measured)
        if float(np.std(moved)) >= _TELLING * noise:
            break
        length = min(2.0 * length, longest)
    return length


def _first_velocity(measured: Array, sample_time_s: float, path: PathSpec, samples: int = 12) -> float | None:
    """How fast the output moves at the start, where the path is slow enough to tell and it clearly moves."""
    poles = np.roots(path.denominator)
    fastest = float(np.abs(poles).max()) / path.time_scale
    if samples * sample_time_s * fastest > 1.1:
        return None
    time = np.arange(samples) * sample_time_s
    coefficients, covariance = np.polyfit(time, measured[:samples], 2, cov=True)
    slope = float(coefficients[1])
    return slope if abs(slope) > 4.0 * float(covariance[1, 1]) ** 0.5 else None


def _inherited(simulator: PathSimulator, path: PathSpec, windows: Windows) -> float:
    """What noise and sampling of the measured load leave in a simulation: it drives the path, and is known so well."""
    load = simulator.load_pa
    if not len(load):
        return 0.0
    count = np.arange(len(load))

    def answer(other: Array) -> Array:
        return windows.project(replace(simulator, load_pa=np.ascontiguousarray(other)).simulate(path))

    as_given = answer(load)
    hiss = difference_noise(load) * np.random.default_rng(7).standard_normal(len(load))
    noisy = float(np.std(answer(load + hiss) - as_given))
    # Interpolation errs with the square of the step where the load is smooth, with the step itself at its jumps;
    # twice that, as the error is no noise but repeats with the load.
    twice, four = (answer(np.interp(count, count[::k], load[::k])) for k in (2, 4))
    coarse, coarser = float(np.std(twice - as_given)), float(np.std(four - twice))
    order = min(max(coarser / max(coarse, 1e-300), 2.0), 4.0)
    return float(np.hypot(noisy, coarse * max(1.0, 2.0 / (order - 1.0))))


def _start_samples(path: PathSpec, sample_time_s: float, samples: int) -> int:
    """How long what moved before the run began is felt: six times the slowest decay, at most a twentieth of the run."""
    denominators = [path.denominator] + ([path.disturbance.denominator] if path.disturbance else [])
    decays = [-float(pole.real) for d in denominators for pole in np.roots(d) if pole.real < -1e-9]
    if not decays:
        return 0
    return min(int(np.ceil(6.0 * path.time_scale / min(decays) / sample_time_s)), samples // 20)


def make_problem(
    run: Run, spec: ModelSpec, channel: Channel, settings: DiscoverySettings, frozen: NDArray[np.bool_] | None = None
) -> Problem:
    """The fitting problem of a channel of a run."""
    path = spec.paths[channel]
    measured = np.ascontiguousarray(run.signals[channel.signal], dtype=np.float64)
    voltage = np.ascontiguousarray(run.signals[channel.voltage_signal], dtype=np.float64)
    pressure_path = spec.paths.get(Channel.PRESSURE)
    rest = 0.0 if pressure_path is None else pressure_path.rest
    pressure = run.get(Channel.PRESSURE.signal)
    load = np.zeros(0) if channel is Channel.PRESSURE or pressure is None else np.ascontiguousarray(pressure)
    anchored = integrates(path)
    noise = driven_noise(measured, voltage)
    window_s = settings.window_s or telling_window(measured, run.sample_time_s, noise)
    velocity = _first_velocity(measured, run.sample_time_s, path)
    start = _start_samples(path, run.sample_time_s, len(run)) if velocity is None else 0
    windows = make_windows(len(run), run.sample_time_s, window_s, anchored, first=start if anchored else 0)
    weights = np.ones(len(run))
    weights[:start] = 0.0
    first, standing = float(measured[0]), path.rest
    if not anchored and abs(first - standing) <= 5.0 * noise + 1e-3 * float(np.ptp(measured)):
        first = standing
    elif not anchored:
        share = _SETTLING_SHARE if len(run) < _MANY else 2.0 * _SETTLING_SHARE
        settling = min(_FORGOTTEN * slowest_s(path), max(_SETTLING_S, share * len(run) * run.sample_time_s))
        weights[: max(1, round(settling / run.sample_time_s))] = 0.0
    if frozen is not None:
        weights[frozen] = 0.0
    compared = windows.project(measured) if anchored else measured - measured.mean()
    other = run.get((Channel.POSITION if channel is Channel.PRESSURE else Channel.PRESSURE).voltage_signal)
    simulator = PathSimulator(channel, run.sample_time_s, voltage, load, rest, first, velocity, other)
    return Problem(
        channel,
        simulator,
        measured,
        windows,
        weights,
        noise,
        float(np.std(compared)),
        scales(run, channel, path, load),
        excitations_hz(run),
        _inherited(simulator, path, windows),
        settings.rough and refits_all(path),
        refits_all(path) and not settings.rough,
    )
