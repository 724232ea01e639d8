"""What a station would do: waveforms as set-points or voltages, on one channel or both."""

from dataclasses import dataclass

import numpy as np

from .plant import SAMPLE_S, Array, Drive

SHAPES = ("square", "sine", "triangle", "sawtooth")


def wave(shape: str, n: int, frequency_hz: float, phase: float = 0.0) -> Array:
    """Unit waveform, shape (n,); `phase` in periods."""
    p = (np.arange(n) * SAMPLE_S * frequency_hz + phase) % 1.0
    if shape == "square":
        return np.where(p < 0.5, 1.0, -1.0)
    if shape == "sine":
        return np.sin(2.0 * np.pi * p)
    if shape == "triangle":
        return 1.0 - 4.0 * np.abs((p + 0.25) % 1.0 - 0.5)
    if shape == "sawtooth":
        return 2.0 * p - 1.0
    raise ValueError(f"no waveform is called {shape}")


@dataclass(frozen=True, slots=True)
class Style:
    """How a run is made: which loops are closed, how long, whether position is held, the load voltage's sign."""

    load_closed: bool
    servo_closed: bool
    delay: int
    seconds: float
    held: bool = False
    bipolar_load: bool = False
    off_centre_cm: float = 0.0


def make_drive(style: Style, shape: str, rng: np.random.Generator) -> Drive:
    """Draw amplitudes and frequencies; the load goes down to rest, as a station's waveforms do."""
    n = round(style.seconds / SAMPLE_S)
    f_load = rng.uniform(0.15, 0.4)
    f_servo = rng.uniform(0.12, 0.35)
    size = rng.uniform(1.0, 1.8)
    if style.load_closed:
        middle = rng.uniform(size + 0.6, size + 1.3)
        load = middle + size * wave(shape, n, f_load, rng.uniform(0.0, 1.0))
    elif style.bipolar_load:
        load = 2.0 * size * wave(shape, n, f_load, rng.uniform(0.0, 1.0))
    else:
        load = np.clip(1.3 * size * (1.0 + wave(shape, n, f_load, rng.uniform(0.0, 1.0))) - 0.05, 0.0, 5.0)
    other = shape if rng.random() < 0.7 else SHAPES[int(rng.integers(4))]
    if style.held:
        servo = np.full(n, style.off_centre_cm)
    elif style.servo_closed:
        servo = style.off_centre_cm + rng.uniform(2.0, 5.0) * wave(other, n, f_servo)
    else:
        # A quarter period's lead keeps the integrated position about its start.
        servo = rng.uniform(0.4, 1.2) * wave(other, n, f_servo, 0.25)
    return Drive(
        load, servo, style.load_closed, style.servo_closed, style.delay,
        servo_gain=3.0 if style.delay else rng.choice([7.1545, 5.0]),
        start_cm=style.off_centre_cm, bipolar_load=style.bipolar_load,
    )  # fmt: skip


def styles(rng: np.random.Generator, channel: int, bipolar: bool) -> Style:
    """One way of running, drawn; open and closed loops about half each."""
    closed = bool(rng.random() < 0.6)
    return Style(
        load_closed=closed and not bipolar,
        servo_closed=closed,
        delay=int(rng.integers(2)),
        seconds=float(rng.choice([24.0, 32.0, 40.0, 60.0])),
        held=channel == 0 and closed and bool(rng.random() < 0.5),
        bipolar_load=bipolar,
        off_centre_cm=float(rng.choice([0.0, 0.0, 10.0, 27.0])),
    )
