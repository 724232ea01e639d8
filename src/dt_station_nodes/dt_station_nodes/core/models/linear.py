"""Linear paths: well-scaled state space of a transfer function and its exact zero-order-hold discretisation."""

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from .matrix import exponential
from .spec import Outlet, TransferFunction

Array = NDArray[np.float64]


class Coefficients(NamedTuple):
    """A transfer function as a key, see `TransferFunction`."""

    numerator: tuple[float, ...]
    denominator: tuple[float, ...]
    gain: float
    time_scale: float


@dataclass(frozen=True, slots=True)
class LinearPath:
    """x' = A x + B u + E w, y = C x + D u, discretised: x+ = a x + b u + e w.

    `velocity` and `velocity_direct` read dy/dt = velocity x + velocity_direct u (u held). `e` injects a flow
    w (output units per s) into the store behind the output, whose content alone decays with `outlet_rate` (1/s):
    oil or water lost or gained there; zeros where that pole is not seen at the output. Where no pole is real there is
    no store but a mass on a spring: w moves it, its speed as it was, and `outlet_rate` is 0. `inlet_rate` (1/s) is that
    of the one store before it, where the path is two such stores in a row, else 0. `static_gain` and `settling_rate`
    (1/s, one over the mean lag of its poles) are 0 for an integrating path. A path stands still where only the last
    state is not 0: the output is `standing_gain` times it. `speed_gain` is the velocity per volt in steady motion of a
    path that integrates once, else 0.
    """

    a: Array
    b: Array
    c: Array
    d: float
    e: Array
    velocity: Array
    velocity_direct: float
    outlet_rate: float
    inlet_rate: float
    static_gain: float
    settling_rate: float
    standing_gain: float
    speed_gain: float


def coefficients(transfer: TransferFunction) -> tuple[Array, Array]:
    """Numerator (padded) and monic denominator, each shape (n + 1,), with gain and time scale applied."""
    numerator, denominator = _monic(transfer.numerator, transfer.denominator, transfer.time_scale)
    return numerator * transfer.gain, denominator


def coefficients_key(transfer: TransferFunction) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Numerator and denominator of `coefficients`, hashable."""
    numerator, denominator = coefficients(transfer)
    return tuple(numerator.tolist()), tuple(denominator.tolist())


def real_poles(denominator: Array | tuple[float, ...]) -> list[float]:
    """Real roots of a denominator: a mass on a spring that swings has none."""
    roots = np.roots(denominator)
    return [float(p.real) for p in roots if abs(p.imag) < 1e-9 * max(abs(p), 1e-9)]


def discretise(
    transfer: TransferFunction | Coefficients, scale: float, step_s: float, outlet: Outlet | None = Outlet.SLOWEST
) -> LinearPath:
    """Exact zero-order-hold equivalent over `step_s` of the path times `scale`; its arrays are shared: read only.

    Without an `outlet` nothing can be injected, which saves looking for poles.
    """
    normal = _normal(transfer.numerator, transfer.denominator, outlet)
    unit, rate = normal.path, normal.rate / transfer.time_scale
    a, b, flow = _moved(transfer.numerator, transfer.denominator, outlet, rate * step_s)
    factor = transfer.gain * scale * transfer.time_scale**normal.integrators
    return LinearPath(
        a,
        b,
        unit.c * factor,
        unit.d * factor,
        flow / (rate * factor) if factor != 0.0 else np.zeros_like(flow),
        unit.velocity * (factor * rate),
        unit.velocity_direct * factor * rate,
        unit.outlet_rate * rate,
        unit.inlet_rate * rate,
        unit.static_gain * factor,
        unit.settling_rate * rate,
        unit.standing_gain * factor,
        # Steady motion does not feel a time scale.
        unit.speed_gain * transfer.gain * scale,
    )


def _monic(given: tuple[float, ...], below: tuple[float, ...], time_scale: float) -> tuple[Array, Array]:
    denominator = np.array(below, dtype=np.float64)
    order = denominator.size - 1
    integrators = order - max(i for i, value in enumerate(below) if value != 0.0)
    tail = given[-(order + 1) :]
    numerator = np.zeros(order + 1)
    numerator[order + 1 - len(tail) :] = tail
    stretch = time_scale ** np.arange(order, -1, -1.0)
    denominator = denominator * stretch
    numerator = numerator * stretch * time_scale**integrators
    return numerator / denominator[0], denominator / denominator[0]


class _Normal(NamedTuple):
    """A path of unit gain in its own time unit, 1 / `rate` (geometric mean of its non-zero poles) at a time scale of 1.

    In that unit a `path` of any time scale has the same numbers, not discretised: x' = a x + b u + e w.
    """

    path: LinearPath
    rate: float
    integrators: int


@lru_cache(maxsize=512)
def _normal(given: tuple[float, ...], below: tuple[float, ...], outlet: Outlet | None) -> _Normal:
    """What of `discretise` no time scale changes, remembered; it keeps coefficients up to 1e10 well conditioned."""
    numerator, denominator = _monic(given, below, 1.0)
    n = denominator.size - 1
    d = float(numerator[0])
    slow = max(i for i, value in enumerate(denominator.tolist()) if value != 0.0)
    rate = abs(float(denominator[slow])) ** (1.0 / slow) if slow else 1.0
    powers = rate ** -np.arange(n + 1.0)
    den = denominator * powers
    num = numerator * powers
    c = num[1:] - den[1:] * num[0]
    a = np.zeros((n, n))
    b = np.zeros(n)
    if n == 0:
        return _Normal(LinearPath(a, b, c, d, b, b, 0.0, 0.0, 0.0, d, 0.0, 0.0, 0.0), rate, 0)
    a[0] = -den[1:]
    a[1:, :-1] = np.eye(n - 1)
    b[0] = 1.0
    e, outlet_rate, inlet_rate = (np.zeros(n), 0.0, 0.0) if outlet is None else _injection(den, c, outlet)
    path = LinearPath(
        a=a,
        b=b,
        c=c,
        d=d,
        e=e,
        velocity=c @ a,
        velocity_direct=float(c @ b),
        outlet_rate=outlet_rate,
        inlet_rate=inlet_rate,
        static_gain=float(num[-1] / den[-1]) if den[-1] != 0.0 else 0.0,
        settling_rate=float(den[-1] / den[-2]) if den[-2] != 0.0 else 0.0,
        standing_gain=float(c[-1]) + d * float(den[-1]),
        speed_gain=float(numerator[-1] / denominator[-2]) if den[-1] == 0.0 and den[-2] != 0.0 else 0.0,
    )
    return _Normal(path, rate, n - slow)


@lru_cache(maxsize=512)
def _moved(
    given: tuple[float, ...], below: tuple[float, ...], outlet: Outlet | None, units: float
) -> tuple[Array, Array, Array]:
    """How states, voltage and flow move the states (n, n), (n,), (n,) in so many time units of the path."""
    path = _normal(given, below, outlet).path
    return _after(path.a, path.b, path.e, units)


@njit(cache=True)
def _after(a: Array, b: Array, e: Array, units: float) -> tuple[Array, Array, Array]:
    n = b.size
    augmented = np.zeros((n + 2, n + 2))
    augmented[:n, :n], augmented[:n, n], augmented[:n, n + 1] = a, b, e
    phi = exponential(augmented * units)
    return phi[:n, :n].copy(), phi[:n, n].copy(), phi[:n, n + 1].copy()


def _injection(denominator: Array, c: Array, outlet: Outlet) -> tuple[Array, float, float]:
    """The outlet's real pole: eigenvector with unit readout, rate of decay (1 / time); the inlet's rate.

    Without a real pole: the state in which the output stands still.
    """
    n = denominator.size - 1
    real = sorted(real_poles(denominator), key=abs, reverse=outlet is Outlet.FASTEST)
    pole = real[0] if real else 0.0
    # Eigenvector of a companion matrix: powers of its eigenvalue; of 0, the state that stands still.
    vector = pole ** np.arange(n - 1, -1, -1.0)
    readout = float(c @ vector)
    if abs(readout) < 1e-12 * float(np.abs(c).max()):
        return np.zeros(n), 0.0, 0.0
    two_stores = n == len(real) == 2 and min(abs(p) for p in real) > 1e-9 * max(abs(p) for p in real)
    return vector / readout, -pole, -real[1] if two_stores else 0.0
