"""The imperfections by name: textbook forms and others, three severities each, scaled to what the run excites."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from . import forms as f
from .plant import POSITION_GAIN, SAMPLE_S, Array, Slot

PRESSURE, POSITION = 0, 1
CHANNELS = ("pressure", "position")
# RNG in, level 0-2, Scale in; the form's code and numbers out.
Builder = Callable[[np.random.Generator, int, "Scale"], tuple[int, tuple[float, ...]]]


@dataclass(frozen=True, slots=True)
class Scale:
    """Typical sizes in a run of the perfect object, in V, V/s, cm/s, MPa, cm, cm, s."""

    voltage: float
    slew: float
    speed: float
    pressure: float
    travel: float
    middle: float
    seconds: float
    smooth: bool
    on_pressure: bool

    @classmethod
    def of(cls, rows: Array, channel: int, smooth: bool) -> "Scale":
        u = rows[channel]
        x = rows[3]
        return cls(
            voltage=float(np.sqrt(np.mean(np.square(u))) * 1.4 + 0.02),
            slew=float(np.percentile(np.abs(np.diff(u)), 99.5) / SAMPLE_S + 0.01),
            speed=float(POSITION_GAIN * np.sqrt(np.mean(np.square(rows[1]))) * 1.4 + 0.1),
            pressure=float(np.percentile(rows[2] - 1.0, 90)),
            travel=float(np.percentile(np.abs(x - np.mean(x)), 95) + 0.05),
            middle=float(np.mean(x)),
            seconds=len(u) * SAMPLE_S,
            smooth=smooth,
            on_pressure=channel == 0,
        )


def _sign(rng: np.random.Generator) -> float:
    return float(rng.choice([-1.0, 1.0]))


def _pick(level: int, *values: float) -> float:
    return values[level]


def _rate(rng: np.random.Generator, level: int, s: Scale) -> float:
    return s.slew * (_pick(level, 0.92, 0.75, 0.5) if s.smooth else _pick(level, 0.5, 0.2, 0.06))


def _mode(rng: np.random.Generator, level: int, s: Scale) -> tuple[float, float]:
    return rng.uniform(0.9, 1.1) * _pick(level, 45.0, 28.0, 15.0), rng.uniform(0.1, 0.25)


def _ripple(rng: np.random.Generator, level: int, s: Scale) -> tuple[float, float, float]:
    return s.voltage * _pick(level, 0.03, 0.1, 0.3), rng.uniform(0.7, 3.3), rng.uniform(0.0, 6.28)


def _stick(code: int, rng: np.random.Generator, level: int, s: Scale) -> tuple[int, tuple[float, ...]]:
    breakaway = s.voltage * _pick(level, 0.06, 0.15, 0.35)
    return code, (breakaway, breakaway * rng.uniform(0.2, 0.8), rng.uniform(0.004, 0.02))


TEXTBOOK: dict[str, Builder] = {
    "dead_zone": lambda r, i, s: (f.DEAD_SHARP, (s.voltage * _pick(i, 0.05, 0.14, 0.35),)),
    "saturation": lambda r, i, s: (f.SAT_SHARP, (s.voltage * _pick(i, 0.92, 0.75, 0.5),)),
    "hysteresis": lambda r, i, s: (f.PLAYS_IN, (s.voltage * _pick(i, 0.04, 0.12, 0.3), 1.0)),
    "backlash": lambda r, i, s: (f.PLAY_OUT, (s.travel * _pick(i, 0.03, 0.08, 0.25),)),
    "friction": lambda r, i, s: (f.COULOMB, (s.speed * _pick(i, 0.05, 0.15, 0.4),)),
    "delay": lambda r, i, s: (f.DELAY, (_pick(i, 0.012, 0.03, 0.08),)),
    "rate_limit": lambda r, i, s: (f.RATE_HARD, (_rate(r, i, s),)),
    "leakage": lambda r, i, s: (f.LEAK, (s.speed * _pick(i, 0.03, 0.1, 0.3) / max(s.pressure, 0.3),)),
    "load_dependent_gain": lambda r, i, s: (f.GAIN_LOAD, (_pick(i, 0.06, 0.18, 0.5) / max(s.pressure, 0.3),)),
    "asymmetric_gain": lambda r, i, s: (f.GAIN_SIDE, (1.0, 1.0 + _sign(r) * _pick(i, 0.06, 0.18, 0.5))),
    "bias": lambda r, i, s: (f.BIAS, (_sign(r) * s.voltage * _pick(i, 0.03, 0.08, 0.25),)),
    "extra_lag": lambda r, i, s: (f.LAG, (_pick(i, 0.012, 0.03, 0.1),)),
    "resonance": lambda r, i, s: (f.MODE_SERIES, _mode(r, i, s)),
    "gain_drift": lambda r, i, s: (f.DRIFT, (_sign(r) * _pick(i, 0.06, 0.15, 0.4), s.seconds)),
    "periodic_disturbance": lambda r, i, s: (f.RIPPLE, _ripple(r, i, s)),
    "cubic_stiffness": lambda r, i, s: (f.CUBIC, (s.speed * _pick(i, 0.06, 0.2, 0.6) / s.travel**3, s.middle)),
    "overflow": lambda r, i, s: (f.CLAMP, (s.middle + s.travel * _pick(i, 0.92, 0.75, 0.4), -1e9)),
}

OTHER: dict[str, Builder] = {
    "dead_zone": lambda r, i, s: (f.DEAD_ROUND, (s.voltage * _pick(i, 0.06, 0.15, 0.38), r.uniform(0.1, 0.35))),
    "saturation": lambda r, i, s: (f.SAT_SMOOTH, (s.voltage * _pick(i, 0.95, 0.75, 0.5), r.uniform(5.0, 10.0))),
    "hysteresis": lambda r, i, s: (
        f.BOUC_WEN, (s.voltage * _pick(i, 0.04, 0.11, 0.28), r.uniform(0.5, 0.7), r.uniform(1.0, 2.0))),
    "backlash": lambda r, i, s: (f.PLAY_OUT_SOFT, (s.travel * _pick(i, 0.03, 0.08, 0.25), r.uniform(0.002, 0.006))),
    "friction": lambda r, i, s: (
        f.LUGRE, (s.speed * _pick(i, 0.05, 0.15, 0.35), r.uniform(1.1, 1.5), 0.1 * s.speed, r.uniform(150.0, 300.0))),
    "delay": lambda r, i, s: (f.DELAY_FLOW, (_pick(i, 0.013, 0.035, 0.08), -0.15, s.voltage)),
    "rate_limit": lambda r, i, s: (f.RATE_SOFT, (_rate(r, i, s), 0.01)),
    "leakage": lambda r, i, s: (
        f.LEAK_ROOT, (s.speed * _pick(i, 0.04, 0.12, 0.3) / max(s.pressure, 0.3) ** 0.5,)),
    "load_dependent_gain": lambda r, i, s: (f.GAIN_LOAD_ROOT, (_pick(i, 0.1, 0.3, 0.75) / max(s.pressure, 0.3),)),
    "asymmetric_gain": lambda r, i, s: (
        f.GAIN_SIDE_SOFT, (_sign(r) * _pick(i, 0.04, 0.1, 0.25), 0.05 * s.voltage)),
    "bias": lambda r, i, s: (
        f.BIAS_WARM, (_sign(r) * s.voltage * _pick(i, 0.03, 0.08, 0.25), r.uniform(0.1, 0.3), 3.0)),
    "extra_lag": lambda r, i, s: (f.LAG_TWO, (_pick(i, 0.014, 0.04, 0.12),)),
    "resonance": lambda r, i, s: (f.MODE_PARALLEL, (*_mode(r, i, s), r.uniform(0.4, 0.8))),
    "gain_drift": lambda r, i, s: (
        f.DRIFT_WARM, (_sign(r) * _pick(i, 0.07, 0.18, 0.45), s.seconds * r.uniform(0.3, 0.6)),
    ),
    "periodic_disturbance": lambda r, i, s: (f.RIPPLE_RICH, _ripple(r, i, s)),
    "cubic_stiffness": lambda r, i, s: (
        f.HARDENING, (s.speed * _pick(i, 0.05, 0.15, 0.45) / 0.62, s.middle, s.travel / 1.5)),
    "overflow": lambda r, i, s: (
        f.CLAMP_SOFT, (s.middle + s.travel * _pick(i, 0.95, 0.75, 0.4), 0.0, 0.03 * s.travel)),
}  # fmt: skip

# Further forms of some, where the trade disagrees on what the word means.
THIRD: dict[str, Builder] = {
    "hysteresis": lambda r, i, s: (f.PLAY_IN, (s.voltage * _pick(i, 0.04, 0.1, 0.25),)),
    "hysteresis_mixed": lambda r, i, s: (f.PLAYS_IN, (s.voltage * _pick(i, 0.06, 0.18, 0.45), r.uniform(0.5, 0.8))),
    "stiction": lambda r, i, s: _stick(f.STICK_SLIP, r, i, s),
    "stiction_spool": lambda r, i, s: _stick(f.SPOOL, r, i, s),
    "dead_zone": lambda r, i, s: (f.DEAD_JUMP, (s.voltage * _pick(i, 0.1, 0.25, 0.5),)),
    "leakage": lambda r, i, s: (f.LEAK_SAG, (s.speed * _pick(i, 0.04, 0.12, 0.35) / s.travel, 0.0)),
    "cubic_stiffness": lambda r, i, s: (
        f.CUBIC, (s.speed * _pick(i, 0.06, 0.2, 0.6) / (s.travel + abs(s.middle)) ** 3, 0.0)),
    "periodic_disturbance": lambda r, i, s: (
        f.RIPPLE_OUT,
        ((s.pressure if s.on_pressure else s.travel) * _pick(i, 0.015, 0.04, 0.12), *_ripple(r, i, s)[1:])),
}  # fmt: skip

OUTSIDE: dict[str, Builder] = {
    "memory": lambda r, i, s: (f.MEMORY, (_pick(i, 0.1, 0.25, 0.45), r.uniform(1.5, 4.0), s.voltage)),
    "cross_coupling": lambda r, i, s: (f.CROSS, (_pick(i, 0.04, 0.12, 0.4) * _sign(r), r.uniform(0.3, 0.8))),
    "stroke_dependent_gain": lambda r, i, s: (
        f.STROKE,
        (_pick(i, 0.08, 0.2, 0.5) * _sign(r), 0.8 * s.travel + abs(s.middle)),
    ),
    "trapped_air": lambda r, i, s: (f.AIR, (_pick(i, 0.02, 0.05, 0.12), 2.0)),
    "frozen_sensor": lambda r, i, s: (f.FROZEN, (_pick(i, 0.25, 0.6, 1.2), s.seconds / 4.0)),
    "command_dropout": lambda r, i, s: (f.DROPOUT, (_pick(i, 0.06, 0.15, 0.3), s.seconds / 6.0)),
    "quadratic_damping": lambda r, i, s: (f.QUADRATIC, (_pick(i, 0.08, 0.25, 0.7) / s.speed,)),
}

# What a form is called by those who judge it, where its own name says more.
WORD = {"hysteresis_mixed": "hysteresis", "stiction": "friction", "stiction_spool": "friction"}
BOTH = ("dead_zone", "saturation", "hysteresis", "delay", "rate_limit", "asymmetric_gain", "bias", "extra_lag",
        "resonance", "gain_drift", "periodic_disturbance")  # fmt: skip
POSITION_ONLY = ("backlash", "friction", "leakage", "load_dependent_gain", "cubic_stiffness")
SINGLES: tuple[tuple[str, int], ...] = (
    *((name, channel) for name in BOTH for channel in (PRESSURE, POSITION)),
    *((name, POSITION) for name in POSITION_ONLY),
)
ANYWHERE = ("hysteresis", "hysteresis_mixed", "dead_zone", "periodic_disturbance")
THIRD_ON: tuple[tuple[str, int], ...] = (
    *((name, channel) for name in ANYWHERE for channel in (PRESSURE, POSITION)),
    ("leakage", POSITION),
    ("cubic_stiffness", POSITION),
    ("stiction", PRESSURE),
    ("stiction_spool", PRESSURE),
)  # fmt: skip
OUTSIDE_ON: tuple[tuple[str, int], ...] = (
    ("memory", PRESSURE), ("memory", POSITION), ("cross_coupling", PRESSURE), ("stroke_dependent_gain", POSITION),
    ("trapped_air", PRESSURE), ("frozen_sensor", PRESSURE), ("frozen_sensor", POSITION),
    ("command_dropout", PRESSURE), ("command_dropout", POSITION), ("quadratic_damping", POSITION),
)  # fmt: skip


def slot(name: str, family: str, channel: int, level: int, scale: Scale, rng: np.random.Generator) -> Slot:
    """The imperfection `name` on `channel` at severity `level` (0 just visible, 2 dominating)."""
    table = {"textbook": TEXTBOOK, "other": OTHER, "third": THIRD, "outside": OUTSIDE}[family]
    code, numbers = table[name](rng, level, scale)
    padded = (*(float(v) for v in numbers), 0.0, 0.0, 0.0, 0.0)[:4]
    return Slot(channel, code, (padded[0], padded[1], padded[2], padded[3]))
