"""Whether a run can tell anything about a path, said before time is spent on fitting it."""

import numpy as np

from ..core.channels import Channel
from ..core.run import Array, Run
from .errors import IdentificationError

STUCK_SHARE = 0.95
LIMITED_SHARE = 0.2


def signal_of(run: Run, name: str) -> Array:
    """A measured signal, finite throughout; IdentificationError where it is missing or not."""
    values = run.get(name)
    if values is None:
        raise IdentificationError(f"{_source(run)} has no {name}, which this identification needs.")
    bad = np.flatnonzero(~np.isfinite(values))
    if bad.size:
        raise IdentificationError(f"{_source(run)}: {name} is not a finite number in row {int(bad[0]) + 1}.")
    return np.ascontiguousarray(values, dtype=np.float64)


def check_excitation(run: Run, name: str) -> None:
    """Raise IdentificationError where an input does not move, or hardly ever leaves one value."""
    values = signal_of(run, name)
    if values.size < 2:
        raise IdentificationError(f"{_source(run)} has {values.size} samples; record a longer run.")
    unit = run.unit(name)
    if np.ptp(values) == 0.0:
        raise IdentificationError(
            f"{_source(run)}: {name} stays at {values[0]:g} {unit}, so the run says nothing about this path; excite it."
        )
    levels, counts = np.unique(values, return_counts=True)
    most = int(np.argmax(counts))
    if counts[most] > STUCK_SHARE * values.size:
        where = "its limit " if levels[most] in (levels[0], levels[-1]) else ""
        raise IdentificationError(
            f"{_source(run)}: {name} is stuck at {where}{levels[most]:g} {unit} in "
            f"{100 * counts[most] // values.size} % of the samples, too little to learn from; "
            "lower the amplitude or switch more often."
        )


def check_response(run: Run, channel: Channel) -> None:
    """Raise IdentificationError where the measured output does not move or its sensor is clipped."""
    values = signal_of(run, channel.signal)
    if np.ptp(values) == 0.0:
        raise IdentificationError(
            f"{_source(run)}: {channel.signal} stays at {values[0]:g} {run.unit(channel.signal)}; "
            "look at the sensor or excite the input."
        )
    share = float(np.mean((values == values.max()) | (values == values.min())))
    if share > 0.5 and np.unique(values).size > 2:
        raise IdentificationError(
            f"{_source(run)}: {channel.signal} is clipped in {100 * share:.0f} % of the samples; lower the amplitude."
        )


def check_not_limited(run: Run, channel: Channel) -> None:
    """Raise IdentificationError where a loop's voltage sits at its limits, so that the closed loop is not linear."""
    values = signal_of(run, channel.voltage_signal)
    share = float(np.mean((values == values.max()) | (values == values.min())))
    if share > LIMITED_SHARE:
        raise IdentificationError(
            f"{_source(run)}: {channel.voltage_signal} is saturated at {values.min():g} or {values.max():g} V in "
            f"{100 * share:.0f} % of the samples, so the closed loop is not linear; lower the set-point's amplitude."
        )


def _source(run: Run) -> str:
    return run.source or "The run"
