"""Units a file may be written in, and their factors to SI."""

from .errors import RecordError

FACTORS = {
    "s": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0},
    "V": {"V": 1.0, "mV": 1e-3, "kV": 1e3},
    "Pa": {"Pa": 1.0, "hPa": 1e2, "kPa": 1e3, "MPa": 1e6, "mbar": 1e2, "bar": 1e5, "psi": 6894.757293168},
    "m": {"m": 1.0, "dm": 1e-1, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "in": 0.0254},
}
UNKNOWN = "1"


def si_unit(signal: str) -> str:
    """SI unit of a run's signal, by the ending of its name."""
    return {"pa": "Pa", "m": "m", "v": "V", "s": "s"}[signal.rsplit("_", 1)[-1]]


def factor_to_si(signal: str, unit: str, keep_unit: bool) -> tuple[float, str]:
    """Factor that takes `unit` to the unit the run states for `signal`, and that unit.

    A unit of another kind, or "1" for an unknown one, is kept as it is: the latter always,
    the former only where `keep_unit` says that it is meant.
    """
    known = FACTORS[si_unit(signal)]
    if unit in known and not keep_unit:
        return known[unit], si_unit(signal)
    if unit == UNKNOWN or keep_unit:
        return 1.0, unit
    raise RecordError(
        f"{signal} has the wrong unit {unit!r}: write one of {', '.join(known)}, "
        f"or '1' where it is unknown, or add keep_unit: true if the quantity really is another"
    )
