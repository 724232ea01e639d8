"""Which hidden cases a set holds, and how one is made."""

import zlib
from dataclasses import asdict, dataclass, replace

import numpy as np

from .experiments import SHAPES, make_drive, styles
from .library import CHANNELS, OUTSIDE_ON, POSITION, PRESSURE, SINGLES, THIRD_ON, WORD, Scale, slot
from .plant import Array, Drive, Nominals, Slot, simulate

SENSOR_FLOOR = (0.0005, 0.0005)  # MPa and cm: what a held quantity still shows
WINDOW = 200
VISIBLE = 1.0  # gap over 1 % of the signal
FAMILIES = ("textbook", "other")
PAIRS = (
    (("friction", POSITION), ("hysteresis", PRESSURE)), (("dead_zone", POSITION), ("delay", POSITION)),
    (("backlash", POSITION), ("gain_drift", PRESSURE)), (("hysteresis", PRESSURE), ("extra_lag", PRESSURE)),
    (("saturation", POSITION), ("bias", POSITION)), (("leakage", POSITION), ("periodic_disturbance", POSITION)),
    (("asymmetric_gain", POSITION), ("friction", POSITION)), (("delay", PRESSURE), ("dead_zone", POSITION)),
    (("resonance", POSITION), ("gain_drift", POSITION)), (("bias", PRESSURE), ("rate_limit", POSITION)),
    (("load_dependent_gain", POSITION), ("extra_lag", POSITION)),
    (("periodic_disturbance", PRESSURE), ("saturation", PRESSURE)),
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Case:
    """One hidden object and how it is run; effects are (name, channel, family, level)."""

    kind: str
    shape: str
    noise_db: float | None
    seed: int
    effects: tuple[tuple[str, int, str, int], ...] = ()
    mismatch: tuple[float, float] = (0.0, 0.0)
    seconds: float | None = None


@dataclass(frozen=True, slots=True)
class Made:
    """A made case: rows of the three runs and what is known of each."""

    case: Case
    runs: tuple[Array, ...]
    references: tuple[Drive, ...]
    noise: tuple[tuple[float, float], ...]
    visibility: tuple[float, float]
    slots: tuple[Slot, ...]
    nominals: Nominals


def detrended(error: Array) -> Array:
    """The error less its mean in each window: an integrating path is compared so."""
    cut = error[: len(error) // WINDOW * WINDOW].reshape(-1, WINDOW)
    return (cut - cut.mean(axis=1, keepdims=True)).ravel()


def _deviations(rows: Array, noise_db: float | None) -> tuple[float, float]:
    if noise_db is None:
        return 0.0, 0.0
    sizes = [max(float(np.std(rows[2 + c])) * 10 ** (-noise_db / 20), SENSOR_FLOOR[c]) for c in (0, 1)]
    return sizes[0], sizes[1]


def make(case: Case) -> Made:
    """A case whose every effect shows at 40 dB; an invisible one is made a level severer, at last run otherwise."""
    for attempt in range(12):
        made = _attempt(case, attempt)
        channels = {c for _, c, _, _ in case.effects}
        if all(np.isfinite(rows).all() for rows in made.runs) and all(made.visibility[c] >= VISIBLE for c in channels):
            return made
        if len(case.effects) == 1 and case.effects[0][3] < 2:
            n, c, f, k = case.effects[0]
            case = replace(case, effects=((n, c, f, k + 1),))
    raise RuntimeError(f"no visible form of {case}")


def _attempt(case: Case, attempt: int) -> Made:
    """Simulate a case: the run, the validation run and an unseen one, each with another waveform."""
    tag = "|".join(f"{n}{c}{f}" for n, c, f, _ in case.effects) + case.kind + case.shape + str(case.noise_db)
    rng = np.random.default_rng([case.seed, zlib.crc32(tag.encode()), attempt])
    first = case.effects[0] if case.effects else ("", int(rng.integers(2)), "", 0)
    bipolar = any(n == "asymmetric_gain" and c == PRESSURE for n, c, _, _ in case.effects) or rng.random() < 0.1
    style = styles(rng, first[1], bipolar)
    if any(c == POSITION for _, c, _, _ in case.effects) and style.held:
        style = replace(style, held=False)
    if case.seconds is not None:
        style = replace(style, seconds=case.seconds)
    at = SHAPES.index(case.shape)
    drives = tuple(make_drive(style, SHAPES[(at + k) % 4], rng) for k in range(3))
    quiet = np.zeros(len(drives[0].load))
    perfect = simulate(drives[0], (), Nominals(), quiet, quiet)
    gain, time = case.mismatch
    sign = rng.choice([-1.0, 1.0], size=4)
    nominals = Nominals(1 + sign[0] * gain, 1 + sign[1] * time, 1 + sign[2] * gain, 1 + sign[3] * time)
    slots: list[Slot] = []
    for name, channel, family, level in case.effects:
        scale = Scale.of(perfect, channel, case.shape in ("sine", "triangle"))
        slots.append(slot(name, family, channel, level, scale, rng))
    runs, noise = [], []
    for d in drives:
        clean = simulate(d, tuple(slots), nominals, quiet, quiet)
        sp, sx = _deviations(clean, case.noise_db)
        hiss = sp * rng.standard_normal(len(quiet)), sx * rng.standard_normal(len(quiet))
        runs.append(simulate(d, tuple(slots), nominals, *hiss))
        noise.append((sp, sx))
    seen = _visibility(drives[0], runs[0], tuple(slots), nominals)
    return Made(case, tuple(runs), drives, tuple(noise), seen, tuple(slots), nominals)


def _visibility(drive: Drive, rows: Array, slots: tuple[Slot, ...], nominals: Nominals) -> tuple[float, float]:
    """Gap by channel in units of 1 % (40 dB) of the signal, with the voltages really applied."""
    quiet = np.zeros(rows.shape[1])
    again = Drive(rows[0], rows[1], False, False, 0, start_cm=drive.start_cm)
    gap = simulate(again, slots, nominals, quiet, quiet) - simulate(again, (), Nominals(), quiet, quiet)
    sizes = _deviations(rows, 40.0)
    rms = [float(np.sqrt(np.mean(np.square(g)))) for g in (gap[2], detrended(gap[3]))]
    return rms[0] / sizes[0], rms[1] / sizes[1]


def case_list(which: str, seed: int) -> list[Case]:
    """Cases of a set: smoke (about 170), standard (about 800), full (the product, about 5000), nulls (200 and 40)."""
    rng = np.random.default_rng(seed)

    def shape() -> str:
        return SHAPES[int(rng.integers(4))]

    def number() -> int:
        return int(rng.integers(1 << 31))

    levels_db = (40.0, 30.0, None)
    off = ((0.02, 0.04), (0.08, 0.15))
    if which == "nulls":
        out = [Case("null", SHAPES[i % 4], levels_db[i % 3], number()) for i in range(200)]
        return out + [Case("mismatch", SHAPES[i % 4], levels_db[i % 3], number(), (), off[i % 2]) for i in range(40)]
    out: list[Case] = []
    forms = [(n, c, fam) for n, c in SINGLES for fam in FAMILIES]
    forms += [(n, c, "third") for n, c in THIRD_ON]
    if which == "full":
        levels, noises, shapes, seeds = (0, 1, 2), (None, 40.0, 30.0), SHAPES, 2
    elif which == "standard":
        levels, noises, shapes, seeds = (0, 1, 2), (40.0,), (None,), 2
    elif which == "smoke":
        levels, noises, shapes, seeds = (None,), (40.0,), (None,), 1
    else:
        raise ValueError(f"no set is called {which}; there are smoke, standard and full")
    for n, c, fam in forms:
        for level in levels:
            for noise in noises:
                for s in shapes:
                    for _ in range(seeds):
                        k = int(rng.integers(3)) if level is None else level
                        out.append(Case("single", s or shape(), noise, number(), ((n, c, fam, k),)))
    size = {"smoke": 1, "standard": 5, "full": 16}[which]
    if which == "standard":
        out += [Case("single", shape(), None, number(), ((n, c, fam, int(rng.integers(3))),)) for n, c, fam in forms]
        out += [Case("single", shape(), 30.0, number(), ((n, c, fam, int(rng.integers(3))),)) for n, c, fam in forms]
    if which != "smoke":
        out += [
            Case("single_mismatch", shape(), 40.0, number(), ((n, c, fam, int(rng.integers(3))),), (0.02, 0.04))
            for n, c, fam in forms
        ]
    out += [Case("null", shape(), levels_db[i % 3], number()) for i in range(12 * size + 8 * (size == 16))]
    out += [Case("mismatch", shape(), levels_db[i % 2], number(), (), off[i // 2 % 2]) for i in range(4 * size)]
    out += [
        Case("outside", shape(), levels_db[i % 2], number(), ((n, c, "outside", int(rng.integers(3))),))
        for i in range(size)
        for n, c in OUTSIDE_ON
    ]
    for i in range(size):
        for a, b in PAIRS:
            kinds = [(*e, FAMILIES[int(rng.integers(2))], int(rng.integers(1, 3))) for e in (a, b)]
            out.append(Case("pair", shape(), levels_db[i % 2], number(), (kinds[0], kinds[1])))
    out += [
        Case("single", shape(), 40.0, number(), (("overflow", POSITION, FAMILIES[i % 2], int(rng.integers(3))),))
        for i in range(2 * size)
    ]
    if which == "smoke":
        harder = (("single", None, (0.0, 0.0)), ("single", 30.0, (0.0, 0.0)), ("single_mismatch", 40.0, (0.02, 0.04)))
        for i, (n, c, fam) in enumerate(forms):
            kind, noise, mismatch = harder[i % 3]
            out.append(Case(kind, shape(), noise, number(), ((n, c, fam, int(rng.integers(3))),), mismatch))
    return [out[i] for i in rng.permutation(len(out))]


def truth_of(made: Made) -> dict[str, object]:
    """What the judge may know."""
    case = made.case
    return {
        "kind": case.kind,
        "effects": [
            {"name": WORD.get(n, n), "channel": CHANNELS[c], "family": f, "form": n, "severity": k}
            for n, c, f, k in case.effects
        ],
        "shape": case.shape,
        "noise_db": case.noise_db,
        "mismatch": list(case.mismatch),
        "seed": case.seed,
        "noise": [{"pressure_pa": 1e6 * p, "position_m": 0.01 * x} for p, x in made.noise],
        "object": {"slots": [asdict(one) for one in made.slots], "nominals": asdict(made.nominals)},
        "visibility": dict(zip(CHANNELS, made.visibility, strict=True)),
    }
