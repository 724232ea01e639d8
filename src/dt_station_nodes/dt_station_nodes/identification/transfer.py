"""A continuous transfer function as a value: coefficients, poles, gains, delay."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..core.run import Array
from .errors import IdentificationError

Complex = NDArray[np.complex128]


@dataclass(frozen=True, slots=True)
class TransferFunction:
    """numerator(s) / denominator(s) * exp(-delay_s s), highest power first, t in s.

    The denominator is monic; trailing zeros of it are integrators. Raises IdentificationError
    where the function is improper or not finite.
    """

    numerator: tuple[float, ...]
    denominator: tuple[float, ...]
    delay_s: float = 0.0

    def __post_init__(self) -> None:
        numerator = np.trim_zeros(np.asarray(self.numerator, dtype=np.float64), "f")
        denominator = np.trim_zeros(np.asarray(self.denominator, dtype=np.float64), "f")
        if not denominator.size or not (np.isfinite(numerator).all() and np.isfinite(denominator).all()):
            raise IdentificationError(
                "A transfer function needs finite coefficients and a denominator that is not zero."
            )
        if numerator.size >= denominator.size:
            raise IdentificationError(
                f"A transfer function with {numerator.size - 1} zeros and {denominator.size - 1} poles is not strictly "
                "proper; ask for fewer zeros than poles."
            )
        if self.delay_s < 0.0:
            raise IdentificationError(f"A delay cannot be negative, got {self.delay_s} s.")
        lead = denominator[0]
        numerator = numerator if numerator.size else np.zeros(1)
        object.__setattr__(self, "numerator", tuple(float(c) for c in numerator / lead))
        object.__setattr__(self, "denominator", tuple(float(c) for c in denominator / lead))

    @property
    def order(self) -> int:
        """Number of poles."""
        return len(self.denominator) - 1

    @property
    def integrators(self) -> int:
        """Number of poles at exactly zero."""
        return len(self.denominator) - len(np.trim_zeros(np.asarray(self.denominator), "b"))

    def poles(self) -> Complex:
        """Poles, rad/s, slowest first, shape (order,)."""
        return by_size(np.roots(self.denominator))

    def zeros(self) -> Complex:
        """Zeros, rad/s, smallest first."""
        return by_size(np.roots(self.numerator))

    def gain(self) -> float:
        """DC gain, or of an integrating path its gain K in K/s^r (output units per input unit and s^r)."""
        return self.numerator[-1] / self.denominator[-1 - self.integrators]

    def stable(self) -> bool:
        """Whether all poles but the exact integrators lie in the open left half-plane."""
        rest = self.denominator[: len(self.denominator) - self.integrators]
        return bool(np.all(np.roots(rest).real < 0.0))

    def frequency_response(self, frequency_rad_s: Array) -> Complex:
        """Values at s = j frequency, shape as given."""
        s = 1j * frequency_rad_s
        value = np.polyval(np.asarray(self.numerator), s) / np.polyval(np.asarray(self.denominator), s)
        return np.asarray(value * np.exp(-s * self.delay_s))

    def scaled(self, factor: float) -> "TransferFunction":
        """The same dynamics with the gain multiplied by factor."""
        return TransferFunction(tuple(factor * c for c in self.numerator), self.denominator, self.delay_s)


def by_size(roots: NDArray[np.generic]) -> Complex:
    """Roots ordered by magnitude, of a conjugate pair the one above the real axis first."""
    values = np.asarray(roots, dtype=np.complex128)
    order = np.lexsort((-values.imag, np.round(np.abs(values), 9)))
    return values[order]
