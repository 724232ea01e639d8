"""Stage 4: where the gap sits, by operating condition."""

import numpy as np
from numpy.typing import NDArray

from .problem import Problem
from .result import GapShare

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]


def conditions(problem: Problem) -> dict[str, Flags]:
    """Samples (n,) under each condition; conditions overlap."""
    voltage = problem.simulator.voltage_v
    measured = problem.measured
    n = len(voltage)
    step = problem.simulator.sample_time_s
    high = max(float(np.quantile(np.abs(voltage), 0.98)), 1e-12)
    width = max(3, round(0.06 / step))
    kernel = np.ones(width) / width
    velocity = np.gradient(np.convolve(np.pad(measured, width, mode="edge"), kernel, "same")[width:-width], step)
    fast = float(np.quantile(np.abs(velocity), 0.95)) or 1e-12
    moving = np.abs(velocity) > 0.1 * fast
    sign = np.sign(velocity) * moving
    reversal = np.zeros(n, dtype=np.bool_)
    last, reach = 0.0, max(1, round(0.3 / step))
    for k in np.flatnonzero(moving):
        if last != 0.0 and sign[k] != last:
            reversal[max(0, k - reach // 2) : k + reach] = True
        last = sign[k]
    jumps = np.abs(np.diff(voltage, prepend=voltage[0])) > 0.25 * high
    after = np.convolve(jumps.astype(float), np.ones(max(2, round(0.3 / step))))[:n] > 0.0
    level = (measured - measured.min()) / max(float(np.ptp(measured)), 1e-300)
    third = np.arange(n) * 3 // n
    found = {
        "voltage near zero": np.abs(voltage) < 0.1 * high,
        "voltage near its highest": np.abs(voltage) > 0.85 * high,
        "velocity reversal": reversal,
        "moving forward": sign > 0,
        "moving backward": sign < 0,
        "standing": ~moving,
        "just after a jump of the voltage": after,
        "output in its upper quarter": level > 0.75,
        "output in its lower quarter": level < 0.25,
        "first third of the run": third == 0,
        "last third of the run": third == 2,
    }
    load = problem.simulator.load_pa
    if len(load):
        found["load pressure high"] = load > np.quantile(load, 0.75)
    return found


def locate(problem: Problem, gap: Array, sigma: float) -> tuple[GapShare, ...]:
    """Share of the gap (beyond noise) under each condition, most concentrated first; empty without a gap."""
    power = gap**2
    total = float(power.sum()) - len(gap) * sigma**2
    if total <= 0.05 * len(gap) * sigma**2:
        return ()
    rows = []
    for name, flags in conditions(problem).items():
        part = float(flags.mean())
        if part == 0.0 or part > 0.97:
            continue
        share = (float(power[flags].sum()) - flags.sum() * sigma**2) / total
        rows.append(GapShare(problem.channel, name, float(np.clip(share, 0.0, 1.0)), part))
    rows.sort(
        key=lambda row: (
            -(row.share_of_gap * np.log((row.share_of_gap + 1e-3) / (row.share_of_time + 1e-3))),
            row.condition,
        )
    )
    return tuple(rows)


def spectrum_centre(gap: Array, sample_time_s: float) -> float:
    """Median frequency (Hz) of a gap's power."""
    power = np.abs(np.fft.rfft(gap - gap.mean())) ** 2
    total = np.cumsum(power)
    place = int(np.searchsorted(total, 0.5 * total[-1])) if total[-1] > 0 else 0
    return float(np.fft.rfftfreq(len(gap), sample_time_s)[place])
