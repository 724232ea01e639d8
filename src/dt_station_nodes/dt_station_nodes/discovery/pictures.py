"""The report's pictures, as SVG text."""

import io
from collections.abc import Mapping, Sequence

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ..core.channels import Channel
from .result import GapShare, RankedCandidate, Trace

Array = NDArray[np.float64]

_MOST_POINTS = 1600
_SCALE = {Channel.PRESSURE: (1e-6, "MPa"), Channel.POSITION: (1e2, "cm")}
_GREY, _RED, _GREEN, _BLUE = "#444444", "#c23b22", "#1b8a3f", "#2b5f9e"


def svg(figure: Figure) -> str:
    """The figure as inline SVG without the file header; the same figure gives the same text."""
    buffer = io.StringIO()
    with mpl.rc_context({"svg.hashsalt": "dt_station", "svg.fonttype": "none", "path.simplify": True}):
        figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None}, bbox_inches="tight")
    text = buffer.getvalue()
    return text[text.index("<svg") :]


def _scaled(channel: Channel, unit: str) -> tuple[float, str]:
    return _SCALE[channel] if unit in ("Pa", "m") else (1.0, unit)


def _thin(n: int) -> slice:
    return slice(0, n, max(1, n // _MOST_POINTS))


def traces_picture(trace: Trace, floor: float) -> Figure:
    """Measured against simulated, and the gap, before and after; with the voltage below."""
    factor, unit = _scaled(trace.channel, trace.unit)
    part = _thin(len(trace.time_s))
    time = trace.time_s[part]
    figure = Figure(figsize=(9.5, 6.2))
    top, middle, low = figure.subplots(3, 1, sharex=True, height_ratios=(3, 2, 1))
    top.plot(time, factor * trace.measured[part], color=_GREY, lw=1.6, label="measured")
    top.plot(time, factor * trace.before[part], color=_RED, lw=0.9, label="given model")
    top.plot(time, factor * trace.after[part], color=_GREEN, lw=0.9, ls="--", label="model found")
    top.set_ylabel(f"{trace.channel.value} / {unit}")
    top.legend(loc="upper right", fontsize=8, ncols=3)
    middle.axhspan(-2 * factor * floor, 2 * factor * floor, color="#dddddd", label="noise (2 sigma)")
    middle.plot(time, factor * (trace.measured - trace.before)[part], color=_RED, lw=0.8, label="gap before")
    middle.plot(time, factor * (trace.measured - trace.after)[part], color=_GREEN, lw=0.8, label="gap after")
    middle.set_ylabel(f"gap / {unit}")
    middle.legend(loc="upper right", fontsize=8, ncols=3)
    low.plot(time, trace.voltage_v[part], color=_BLUE, lw=0.8)
    low.set_ylabel("voltage / V")
    low.set_xlabel("time / s")
    for axis in (top, middle, low):
        axis.grid(alpha=0.25)
    return figure


def where_picture(rows: Sequence[GapShare]) -> Figure:
    """Share of the gap beside share of the time, per condition."""
    figure = Figure(figsize=(9.5, 0.5 + 0.34 * len(rows)))
    axis = figure.subplots()
    places = np.arange(len(rows))[::-1]
    axis.barh(places + 0.18, [100 * r.share_of_gap for r in rows], 0.36, color=_RED, label="of the gap")
    axis.barh(places - 0.18, [100 * r.share_of_time for r in rows], 0.36, color="#bbbbbb", label="of the time")
    axis.set_yticks(places, [f"{r.channel.value}: {r.condition}" for r in rows])
    axis.set_xlabel("share / %")
    axis.legend(loc="lower right", fontsize=8)
    return figure


def ranking_picture(rows: Sequence[RankedCandidate], floors: Mapping[Channel, float]) -> Figure:
    """What each candidate leaves, in multiples of the noise floor; the scale is logarithmic."""
    figure = Figure(figsize=(9.5, 0.7 + 0.28 * len(rows)))
    axis = figure.subplots()
    places = np.arange(len(rows))[::-1]
    colours = [_BLUE if r.inside_vocabulary else "#bbbbbb" for r in rows]
    left = [max(r.rms / max(floors[r.channel], 1e-300), 1.0) for r in rows]
    axis.barh(places, left, 0.6, color=colours)
    labels = [f"{r.channel.value}: {' + '.join(r.names).replace('_', ' ') or 'nominal parameters alone'}" for r in rows]
    axis.set_yticks(places, labels)
    axis.set_xscale("log")
    axis.set_xlim(0.8, 1.3 * max(left, default=10.0))
    axis.axvline(1.0, color=_GREEN, lw=1.2)
    axis.set_xlabel("RMS left, times the noise floor (green line); grey: outside the vocabulary")
    return figure
