"""Pictures of the report as SVG text: what was measured and simulated, what is left, where it sits, who explains it."""

import io
from collections.abc import Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ..core.channels import Channel
from .result import DiscoveryResult, GapShare, RankedCandidate, Trace

Array = NDArray[np.float64]

MEASURED, BEFORE, AFTER, NOISE = "#1f2933", "#d64545", "#2f7de1", "#9fb3c8"
_STYLE: dict[Any, Any] = {
    "svg.fonttype": "none",
    "svg.hashsalt": "dt_station",
    "font.family": "sans-serif",
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e4e7eb",
    "axes.edgecolor": "#9fb3c8",
    "legend.frameon": False,
}
# A screen shows no more, and the page stays small enough to mail.
_MOST_POINTS = 1500

# Engineering prefixes for the two SI units of the station; other units stay as they are.
_SHOWN = {"Pa": (1e-6, "MPa"), "m": (1e3, "mm")}


def shown(unit: str) -> tuple[float, str]:
    """Factor and unit in which a quantity is shown to a person."""
    return _SHOWN.get(unit, (1.0, unit))


def _thin(*arrays: Array) -> list[Array]:
    """Every n-th sample, so that no curve has more points than a screen shows."""
    every = max(1, -(-arrays[0].size // _MOST_POINTS))
    return [array[::every] for array in arrays]


def _svg(figure: Figure) -> str:
    text = io.StringIO()
    figure.savefig(text, format="svg", bbox_inches="tight", metadata={"Date": None, "Creator": None})
    svg = text.getvalue()
    return svg[svg.index("<svg") :]


def trace_figure(trace: Trace, floor_rms: float | None = None) -> str:
    """Measured and simulated before and after, and the two residuals over the noise floor's band."""
    factor, unit = shown(trace.unit)
    with mpl.rc_context(_STYLE):
        figure = Figure(figsize=(9.0, 4.6))
        axes: Sequence[Axes] = figure.subplots(2, 1, sharex=True, height_ratios=[3, 2])
        time, measured, before, after = _thin(trace.time_s, trace.measured, trace.before, trace.after)
        axes[0].plot(time, measured * factor, color=MEASURED, lw=1.6, label="measured")
        axes[0].plot(time, before * factor, color=BEFORE, lw=1.0, label="model as given")
        axes[0].plot(time, after * factor, color=AFTER, lw=1.0, ls="--", label="model as found")
        axes[0].set_ylabel(f"{trace.channel.value} [{unit}]")
        axes[0].legend(loc="upper right", ncols=3)
        axes[1].plot(time, (measured - before) * factor, color=BEFORE, lw=0.9, label="gap before")
        axes[1].plot(time, (measured - after) * factor, color=AFTER, lw=0.9, label="gap after")
        if floor_rms is not None:
            band = 2.0 * floor_rms * factor
            axes[1].axhspan(-band, band, color=NOISE, alpha=0.35, lw=0, label="noise floor (2 sigma)")
        axes[1].set_ylabel(f"residual [{unit}]")
        axes[1].set_xlabel("time [s]")
        axes[1].legend(loc="upper right", ncols=3)
        return _svg(figure)


def where_figure(shares: Sequence[GapShare]) -> str:
    """Share of the gap under each operating condition beside the share of time spent there."""
    with mpl.rc_context({**_STYLE, "axes.grid": False}):
        figure = Figure(figsize=(9.0, 0.8 + 0.36 * len(shares)))
        axes = figure.subplots()
        at = np.arange(len(shares))[::-1]
        axes.barh(at + 0.17, [100 * s.share_of_gap for s in shares], 0.34, color=BEFORE, label="share of the gap")
        axes.barh(at - 0.17, [100 * s.share_of_time for s in shares], 0.34, color=NOISE, label="share of the time")
        axes.set_yticks(at, [f"{s.channel.value}: {s.condition}" for s in shares])
        axes.set_xlabel("percent")
        axes.legend(loc="lower right")
        return _svg(figure)


def ranking_figure(candidates: Sequence[RankedCandidate]) -> str:
    """How much of the gap each candidate explains after its fit."""
    with mpl.rc_context({**_STYLE, "axes.grid": False}):
        figure = Figure(figsize=(9.0, 0.8 + 0.28 * len(candidates)))
        axes = figure.subplots()
        at = np.arange(len(candidates))[::-1]
        colours = [AFTER if i == 0 else NOISE for i in range(len(candidates))]
        axes.barh(at, [100 * max(c.explained, 0.0) for c in candidates], 0.6, color=colours)
        axes.set_yticks(at, [" + ".join(c.names) or "parameters alone" for c in candidates])
        axes.set_xlabel("percent of the gap explained")
        axes.set_xlim(0, 100)
        return _svg(figure)


def floors(result: DiscoveryResult) -> dict[Channel, float]:
    """Root mean square of the noise floor of each channel, SI."""
    return {channel: figures.rms for channel, figures in result.gap.noise_floor.items()}
