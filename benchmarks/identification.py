"""How well known systems come back from noisy runs: the paper's (1), (5) and (6) at 40 dB, 100 seeds each.

    python benchmarks/identification.py [--seeds 100] [--json]

The runs are made by scipy.signal.lsim, not by our own simulation. Prints for each system the worst errors of gain and
dominant poles, the least validation fit, and in how many runs each true value lies inside its 95 % interval.
"""

import argparse
import json
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.signal import cont2discrete, lsim, tf2ss

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "src" / "dt_station_nodes"))

from dt_station_nodes.identification import (
    Data,
    Hold,
    PathStructure,
    Structure,
    TransferFunction,
    estimate,
    fit_percent,
)

NOISE = 0.01  # 40 dB below the output's spread
SAMPLE_TIME_S = 0.02
PRESSURE = TransferFunction(
    (295.1, -2.944e4, 7.457e6, -1.267e8, 3.217e10),
    (1.0, 159.3, 1.962e4, 1.479e6, 7.247e7, 2.244e9, 3.242e10),
)
POSITION = TransferFunction((206.4,), (1.0, 23.34, 0.0))
DISTURBANCE = TransferFunction((64.72, -16.45), (1.0, 76.54, 2009.0, 0.0))


def switching(samples: int, dwell: int, low: float, high: float, seed: int) -> np.ndarray:
    """A random two-level signal that may change every `dwell` samples."""
    bits = np.random.default_rng(seed).integers(0, 2, samples // dwell + 1)
    return (low + (high - low) * bits.astype(float)).repeat(dwell)[:samples]


def response(transfer: TransferFunction, signal: np.ndarray, smooth: bool) -> np.ndarray:
    """Output at the samples of a signal held, or straight between them."""
    time_s = SAMPLE_TIME_S * np.arange(signal.size)
    return np.asarray(lsim((transfer.numerator, transfer.denominator), signal, time_s, interp=smooth)[1])


def pressure_run(samples: int, seed: int) -> Data:
    """Open loop, 0 or 5 V on the relief valve."""
    rng = np.random.default_rng(seed)
    voltage = switching(samples, 3, 0.0, 5.0, 1000 + seed)
    clean = response(PRESSURE, voltage, smooth=False)
    output = 1.0 + clean + NOISE * clean.std() * rng.normal(size=samples)
    return Data(SAMPLE_TIME_S, (voltage,), output)


def position_run(samples: int, seed: int, gain: float = 3.0) -> Data:
    """Proportional loop on a switching set-point; the noisy measurement is fed back."""
    rng = np.random.default_rng(seed)
    setpoint = switching(samples, 20, -2.0, 2.0, 2000 + seed)
    a, b, c, d = tf2ss(POSITION.numerator, POSITION.denominator)
    a, b, c, _, _ = cont2discrete((a, b, c, d), SAMPLE_TIME_S)
    noise = NOISE * 2.0 * rng.normal(size=samples)
    state = np.zeros(2)
    voltage, output = np.empty(samples), np.empty(samples)
    for k in range(samples):
        output[k] = c[0] @ state + noise[k]
        voltage[k] = gain * (setpoint[k] - output[k])
        state = a @ state + b[:, 0] * voltage[k]
    return Data(SAMPLE_TIME_S, (voltage,), output)


def disturbance_run(samples: int, seed: int) -> Data:
    """Servo valve closed, the load pressure switched between rest and 5 MPa above it through path (1)."""
    rng = np.random.default_rng(seed)
    pressure = response(PRESSURE, switching(samples, 10, 0.0, 5.0, 3000 + seed), smooth=False)
    clean = response(DISTURBANCE, pressure, smooth=True)
    return Data(SAMPLE_TIME_S, (pressure,), clean + NOISE * clean.std() * rng.normal(size=samples))


@dataclass(frozen=True)
class Case:
    """One known system, the run that shows it, and how many slow poles count as dominant."""

    name: str
    truth: TransferFunction
    path: PathStructure
    make: Callable[[int, int], Data]
    samples: int
    dominant: int


CASES = (
    Case("pressure (1)", PRESSURE, PathStructure(6, 4), pressure_run, 6000, 2),
    Case("position (5)", POSITION, PathStructure(2, 0, integrators=1), position_run, 1500, 1),
    Case(
        "disturbance (6)", DISTURBANCE, PathStructure(3, 1, integrators=1, hold=Hold.SMOOTH), disturbance_run, 3000, 2
    ),
)


def study(case: Case, seeds: int) -> dict[str, object]:
    """Errors, fits and coverage over seeds."""
    true_poles = np.abs(case.truth.poles())
    true_poles = true_poles[true_poles > 0.0]
    gain_errors, pole_errors, fits, seconds = [], [], [], []
    covered: dict[str, int] = {}
    for seed in range(seeds):
        data = case.make(case.samples, seed)
        other = case.make(case.samples // 2, 5000 + seed)
        begin = time.perf_counter()
        found = estimate(Structure((case.path,)), data)
        seconds.append(time.perf_counter() - begin)
        gain = found.gain()
        sizes = found.pole_sizes()
        gain_errors.append(abs(gain.value / case.truth.gain() - 1.0))
        pole_errors.append(max(abs(sizes[i].value / true_poles[i] - 1.0) for i in range(case.dominant)))
        fits.append(fit_percent(other.output, found.predict(other)))
        numerator, denominator = found.coefficients()
        pairs = [("gain", gain, case.truth.gain())]
        pairs += [(f"|pole {i + 1}|", sizes[i], true_poles[i]) for i in range(len(sizes))]
        pairs += [
            (f"b{len(numerator) - 1 - i}", v, t)
            for i, (v, t) in enumerate(zip(numerator, case.truth.numerator, strict=True))
        ]
        free = case.truth.denominator[1 : 1 + len(denominator)]
        pairs += [(f"a{case.path.poles - 1 - i}", v, t) for i, (v, t) in enumerate(zip(denominator, free, strict=True))]
        for name, interval, truth in pairs:
            covered[name] = covered.get(name, 0) + int(interval.holds(truth))
    return {
        "system": case.name,
        "seeds": seeds,
        "worst_gain_error_percent": 100.0 * max(gain_errors),
        "worst_dominant_pole_error_percent": 100.0 * max(pole_errors),
        "least_validation_fit_percent": min(fits),
        "inside_95_percent_interval": covered,
        "median_seconds": float(np.median(seconds)),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=100)
    parser.add_argument("--json", action="store_true")
    given = parser.parse_args()
    results = []
    for case in CASES:
        result = study(case, given.seeds)
        results.append(result)
        if given.json:
            continue
        print(f"{result['system']}: {case.samples * SAMPLE_TIME_S:g} s at 20 ms, 40 dB, {given.seeds} seeds")
        print(f"  worst gain error           {result['worst_gain_error_percent']:.3f} %   (aim 1)")
        print(f"  worst dominant pole error  {result['worst_dominant_pole_error_percent']:.2f} %    (aim 3)")
        print(f"  least validation fit       {result['least_validation_fit_percent']:.2f} %   (aim 97)")
        inside = ", ".join(f"{name} {count}" for name, count in result["inside_95_percent_interval"].items())
        print(f"  inside 95 % interval, of {given.seeds}: {inside}   (aim 90 to 99 of 100)")
        print(f"  {result['median_seconds']:.2f} s an estimate")
    if given.json:
        print(json.dumps({"systems": results}, indent=2))


if __name__ == "__main__":
    main()
