"""Linear paths: well-scaled state space of a transfer function and its exact zero-order-hold discretisation."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from .spec import TransferFunction

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class LinearPath:
    """x' = A x + B u + E w, y = C x + D u, discretised: x+ = a x + b u + e w.

    `velocity` and `velocity_direct` read dy/dt = velocity x + velocity_direct u (u held). `e` injects a flow
    w (output units per s) at the slowest real pole, as oil lost or gained there; zeros where there is none.
    """

    a: Array
    b: Array
    c: Array
    d: float
    e: Array
    velocity: Array
    velocity_direct: float


def coefficients(transfer: TransferFunction) -> tuple[Array, Array]:
    """Numerator (padded) and monic denominator, each shape (n + 1,), with gain and time scale applied."""
    denominator = np.asarray(transfer.denominator, dtype=np.float64)
    order = denominator.size - 1
    numerator = np.zeros(order + 1)
    given = np.trim_zeros(np.asarray(transfer.numerator, dtype=np.float64), "f")
    if given.size:
        numerator[order + 1 - given.size :] = given
    integrators = order + 1 - np.trim_zeros(denominator, "b").size
    stretch = transfer.time_scale ** np.arange(order, -1, -1.0)
    denominator = denominator * stretch
    numerator = numerator * stretch * transfer.gain * transfer.time_scale**integrators
    return numerator / denominator[0], denominator / denominator[0]


def discretise(transfer: TransferFunction, scale: float, step_s: float) -> LinearPath:
    """Exact zero-order-hold equivalent over `step_s` of the path times `scale`; its arrays are shared, never write them.

    Remembered: a fit asks for the same few paths thousands of times.
    """
    return _discretised(*coefficients_key(transfer), scale, step_s)


def coefficients_key(transfer: TransferFunction) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Numerator and denominator of `coefficients`, hashable."""
    numerator, denominator = coefficients(transfer)
    return tuple(numerator.tolist()), tuple(denominator.tolist())


@lru_cache(maxsize=256)
def _discretised(
    given_numerator: tuple[float, ...], given_denominator: tuple[float, ...], scale: float, step_s: float
) -> LinearPath:
    """The work of `discretise`.

    The companion form is built in the path's own time unit (geometric mean of its non-zero poles), which keeps
    a sixth-order path with coefficients up to 1e10 well conditioned.
    """
    numerator, denominator = np.array(given_numerator), np.array(given_denominator)
    n = denominator.size - 1
    d = float(numerator[0]) * scale
    if n == 0:
        empty = np.zeros(0)
        return LinearPath(np.zeros((0, 0)), empty, empty, d, empty, empty, 0.0)
    nonzero = np.trim_zeros(denominator, "b")
    rate = abs(nonzero[-1]) ** (1.0 / (nonzero.size - 1)) if nonzero.size > 1 else 1.0
    powers = rate ** -np.arange(n + 1.0)
    den = denominator * powers
    num = numerator * powers
    a = np.zeros((n, n))
    a[0] = -den[1:]
    a[1:, :-1] = np.eye(n - 1)
    b = np.zeros(n)
    b[0] = 1.0
    c = (num[1:] - den[1:] * num[0]) * scale
    e = _slow_injection(a, c)
    augmented = np.zeros((n + 2, n + 2))
    augmented[:n, :n] = a
    augmented[:n, n] = b
    augmented[:n, n + 1] = e
    phi = expm(augmented * (rate * step_s))
    return LinearPath(
        a=np.ascontiguousarray(phi[:n, :n]),
        b=np.ascontiguousarray(phi[:n, n]),
        c=c,
        d=d,
        e=np.ascontiguousarray(phi[:n, n + 1] / rate),
        velocity=c @ a * rate,
        velocity_direct=float(c @ b) * rate,
    )


def _slow_injection(a: Array, c: Array) -> Array:
    """Eigenvector of the slowest real pole with unit readout, zeros if no real pole is seen at the output."""
    values, vectors = np.linalg.eig(a)
    real = [i for i in range(values.size) if abs(values[i].imag) < 1e-9 * max(abs(values[i]), 1e-9)]
    if not real:
        return np.zeros(a.shape[0])
    slowest = min(real, key=lambda i: abs(values[i].real))
    vector = np.real(vectors[:, slowest])
    readout = float(c @ vector)
    return np.zeros(a.shape[0]) if abs(readout) < 1e-12 * float(np.abs(c).max()) else vector / readout
