"""Forms of an effect that no fit reaches from its plain one: each is a candidate of its own."""

import numpy as np

from ..core.channels import Channel
from ..core.models.effects import Attachment, Parameter
from .problem import Problem

# A valve's magnetisation whose relays lie dense as a bell about a middle: a small share of so steep a loop as looks
# like any other from elsewhere. So free that beside other effects it takes what is theirs.
BELL = ("spread", "depth", "open_at_v", "bend_per_v", "steepness")

BRISTLES = ("presliding",)
# Bristles that hold more at rest: what they do at a run's own speed alone, a wider or narrower loop does.
GRIPPING_BRISTLES = ("presliding", "static_excess_v", "spool_stribeck_velocity", "elastic")
# A spool with mass ends elsewhere after each jump: its stairs are no others.
HEAVY = ("swing_s", "swing_damping")
# A mode that only changes shake: from one that carries its share of the voltage no fit leads to it.
SHAKEN = ("share", "washout_s")
# A piston that does not creep at the rest pressure, as a valve set there sees to: nothing leads there from one that
# does beside another effect.
AT_REST = ("base",)
# A bore worn in one place: elsewhere the plain form's sag takes what differs along the stroke, and nothing leads on.
WORN = ("base", "lag_s", "worn", "worn_at", "worn_bend")
# A pump that delivers less from some pressure on: where all pressures count, nothing leads there.
KNEE = ("base", "above")
# A lag upwards or downwards alone, as of a volume behind a check valve: one both ways explains nothing of it.
ONE_WAY = ("unequal",)
# A gap that the pressure widens, behind the path: where an orifice is begun with, its bend goes the other way.
WIDENED = ("widening",)
# A slow relief valve that opens and, lower, shuts by what it leaves: from one that limits nothing leads there.
RESEATED = ("override", "opening_s", "reseat", "closing_s", "relieved")
# A disturbance with edges: its harmonics go beyond the samples' frequency and come back as others.
EDGED = ("rise_share", "high_share", "fall_share")
# Forms that need a load that moves.
BY_LOAD = (AT_REST, WORN)

FURTHER: tuple[tuple[str, Channel, tuple[str, ...]], ...] = (
    # A valve that works about a voltage bends from there, softly: sharp limits come nowhere near.
    ("saturation", Channel.PRESSURE, ("straight", "centre_v")),
    # A port that closes past an end holds no piston there: from a stop no fit leads to it.
    ("overflow", Channel.POSITION, ("lower_limit", "throttling")),
    ("overflow", Channel.PRESSURE, RESEATED),
    # A valve set at rest makes up for what leaks there: a large leak that is not made up for would bend all else first.
    ("leakage", Channel.PRESSURE, ("made_up",)),
    ("leakage", Channel.PRESSURE, WIDENED),
    ("leakage", Channel.POSITION, AT_REST),
    ("leakage", Channel.POSITION, WORN),
    ("load_dependent_gain", Channel.PRESSURE, KNEE),
    ("periodic_disturbance", Channel.PRESSURE, EDGED),
    # A spool on an oil film never sticks, nor does one held by bristles, so that no stairs lead to them.
    ("friction", Channel.PRESSURE, ("creep_velocity",)),
    ("friction", Channel.PRESSURE, BRISTLES),
    ("friction", Channel.PRESSURE, GRIPPING_BRISTLES),
    ("friction", Channel.PRESSURE, HEAVY),
    # What a saturating coil does to a piston's way parameters off bend to, all but its lag.
    ("extra_lag", Channel.POSITION, ("saturation",)),
    # What passes a lag by in part does so too, but for the run's own waveform.
    ("extra_lag", Channel.PRESSURE, ("straight",)),
    ("extra_lag", Channel.POSITION, ("straight",)),
    ("extra_lag", Channel.PRESSURE, ONE_WAY),
    # What acts as a gain leaves nothing of a voltage that is merely added.
    ("cross_coupling", Channel.POSITION, ("gain_per_v",)),
    ("resonance", Channel.PRESSURE, SHAKEN),
    ("resonance", Channel.POSITION, SHAKEN),
    ("hysteresis", Channel.PRESSURE, BELL),
    ("hysteresis", Channel.POSITION, BELL),
)

# Places of those that are not at their effect's usual one.
PLACES: dict[tuple[str, ...], Attachment] = {WIDENED: Attachment.OUTPUT, RESEATED: Attachment.OUTPUT}

# Times the run's range of what each is.
_BRISTLED = {
    "presliding": (0.003, 0.01, 0.03, 0.1),
    "static_excess_v": (0.03,),
    "spool_stribeck_velocity": (0.1, 0.5, 2.0),
    "elastic": (0.0, 0.5),
}
_STARTS: dict[tuple[str, ...], dict[str, tuple[float, ...]]] = {
    BRISTLES: _BRISTLED,
    GRIPPING_BRISTLES: _BRISTLED,
    SHAKEN: {"share": (0.1, 0.5), "washout_s": (0.03, 0.2)},
    HEAVY: {
        "coulomb_v": (0.005, 0.01, 0.02, 0.05, 0.15),
        "swing_s": (0.002, 0.006, 0.02),
        "swing_damping": (0.3, 0.8),
    },
    ONE_WAY: {"unequal": (-0.95, 0.95)},
    WIDENED: {"turbulence": (0.0,)},
    RESEATED: {
        "override": (0.15,),
        "opening_s": (0.01,),
        "reseat": (0.02, 0.06, 0.15),
        "closing_s": (0.04,),
        "relieved": (1.0,),
    },
    EDGED: {"rise_share": (0.03, 0.95), "high_share": (0.0, 0.1, 0.45), "fall_share": (0.03, 0.95)},
    KNEE: {"per_load": (0.05, 0.3), "direction": (0.0,), "above": (1.0,)},
    WORN: {
        "coefficient": (0.02, 0.2, -0.1),
        "turbulence": (0.0,),
        "sag_per_s": (0.0,),
        "base": (0.0, 1.0),
        "lag_s": (0.02,),
        "worn": (0.7,),
    },
}
_KNEES = (0.2, 0.4, 0.6, 0.8)  # quantiles of the pressure
_SPREADS = (0.0, 1.0)
_WIDTHS = (0.03, 0.07, 0.15, 0.3)  # times the voltage's largest way from its mean,
_BENDS = (0.5, 1.0, 2.0, 4.0)  # the inverse of it
_DEPTHS = (0.05, 0.15, 0.5, 0.9)
_STEEPNESSES = (1.0, 4.0)


def further_starts(problem: Problem, also: tuple[str, ...], parameter: Parameter, unit: float) -> list[float] | None:
    """Where a number of a further form begins, of a parameter with the run's `unit`; None: where it usually does."""
    if also == BELL:
        return _bell_starts(problem).get(parameter.name)
    if also == KNEE and parameter.name == "base":
        levels = np.quantile(problem.measured, _KNEES) / max(problem.simulator.rest_pa, 1.0)
        return [float(level) for level in levels]
    shares = _STARTS.get(also, {}).get(parameter.name)
    return None if shares is None else [share * unit for share in shares]


def _bell_starts(problem: Problem) -> dict[str, list[float]]:
    """Where a loop of relays dense as a bell begins: its middle may be where the valve works, or at 0 V."""
    voltage = problem.simulator.voltage_v
    mean = float(voltage.mean())
    way = float(abs(voltage - mean).max())
    middles = [0.0] if problem.channel is Channel.POSITION else [0.0, mean, 0.5 * float(voltage.min() + voltage.max())]
    return {
        "half_width_v": [share * way for share in _WIDTHS],
        "spread": list(_SPREADS),
        "depth": list(_DEPTHS),
        "open_at_v": middles,
        "bend_per_v": [bend / way for bend in _BENDS],
        "steepness": list(_STEEPNESSES),
    }
