"""Quantities as people write them (2MPa, 0.5Hz, 3cm) to and from SI. Converted here once, at the edge."""

import math
import re

from .errors import StationError


class QuantityError(StationError):
    """A quantity that cannot be read, or has the wrong dimension."""


# dimension -> unit -> factor to SI; the first is the SI unit itself
UNITS: dict[str, dict[str, float]] = {
    "pressure": {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9, "bar": 1e5, "mbar": 1e2, "psi": 6894.757293168361},
    "length": {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "um": 1e-6, "in": 0.0254},
    "frequency": {"Hz": 1.0, "mHz": 1e-3, "kHz": 1e3},
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0, "h": 3600.0},
    "voltage": {"V": 1.0, "mV": 1e-3},
    "angle": {"rad": 1.0, "deg": math.pi / 180.0},
    "ratio": {"": 1.0, "%": 0.01},
}

_FORM = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(\S*)\s*")


def parse_quantity(text: str, dimension: str) -> float:
    """SI value of a number with or without unit (without: SI). Raises QuantityError."""
    units = UNITS[dimension]
    known = ", ".join(unit for unit in units if unit) or "no unit"
    match = _FORM.fullmatch(text)
    if match is None:
        raise QuantityError(f"{text!r} is not a {dimension}; write a number with a unit of {known}")
    number, unit = float(match[1]), match[2].replace("µ", "u")
    if unit == "":
        return number
    if unit not in units:
        for other, table in UNITS.items():
            if unit in table:
                raise QuantityError(f"{text!r} is a {other}, not a {dimension}; use a unit of {known}")
        raise QuantityError(f"the unit {unit!r} in {text!r} is unknown; a {dimension} has {known}")
    # dividing by the reciprocal keeps 2 mm at 0.002 exactly
    factor = units[unit]
    inverse = round(1.0 / factor)
    return number / inverse if factor < 1.0 and inverse * factor == 1.0 else number * factor
