"""The demo's report: one self-contained page."""

import html
import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ..core.channels import Channel
from .demo_table import INDEX_FROM_S, INDEX_TO_S, DemoRun

_STYLE = """
:root { color-scheme: light dark; --line: #8884; --ours: #1769aa; }
body { font: 16px/1.5 system-ui, sans-serif; margin: 0 auto; max-width: 62rem; padding: 1.5rem; }
h1 { font-size: 1.6rem; } h2 { font-size: 1.15rem; margin-top: 2rem; }
table { border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums; }
td, th { border-bottom: 1px solid var(--line); padding: .3rem .6rem; text-align: left; }
td:nth-child(2), td:nth-child(3), th:nth-child(2), th:nth-child(3) { text-align: right; }
figure { margin: 1rem 0; background: #fff; border: 1px solid var(--line); border-radius: 6px; padding: .5rem; }
figure svg { width: 100%; height: auto; display: block; }
figcaption { color: #444; font-size: .9rem; padding: 0 .5rem .3rem; }
code { font-size: .9em; }
"""


def write_report(
    path: Path, runs: Mapping[str, DemoRun], rows: Sequence[Mapping[str, Any]], found: Mapping[str, Any] | None
) -> Path:
    """Write the page and return its path."""
    figures = [
        _figure(_pressure(runs["pid"]), "Load pressure: set-point, object and twin. The loop is the optimised PI."),
        _figure(_errors(runs), "Position error in mm; the grey span is the one of the paper's index (8)."),
        _figure(_voltages(runs), "Voltages of the servo valve and the relief valve."),
    ]
    body = [
        "<h1>Digital-twin station: the paper's experiment on the virtual rig</h1>",
        f"<p>{html.escape(_verdict(rows, runs))}</p>",
        _table(rows),
        *figures,
        _discovery(path, found),
        "<h2>How to repeat it</h2><p><code>dt-station demo</code> makes the same numbers again: the rig's noise is "
        "seeded and nothing depends on the clock. The bags beside this page hold every message, the models and the "
        "parameters; <code>dt-station verify BAG</code> recomputes them bit for bit.</p>",
    ]
    page = (
        '<!doctype html><html lang="en"><head><meta charset="utf-8"><title>dt-station demo</title>'
        f'<meta name="viewport" content="width=device-width"><style>{_STYLE}</style></head>'
        f"<body>{''.join(body)}</body></html>"
    )
    path.write_text(page, encoding="utf-8")
    return path


def _verdict(rows: Sequence[Mapping[str, Any]], runs: Mapping[str, DemoRun]) -> str:
    ours = {row["what"]: row["ours"] for row in rows}
    missed = sum(run.statistics.bridge["missed_samples"] for run in runs.values())
    return (
        f"Under a square load the position error index (8) is {ours['position error index (8), pid']:.4g} mm^2 by PID "
        f"and {ours['position error index (8), fuzzy']:.4g} mm^2 with fuzzy control, against 1.3031 and 1.8612 on the "
        f"paper's rig; {missed} samples were missed."
    )


def _table(rows: Sequence[Mapping[str, Any]]) -> str:
    cells = "".join(
        "<tr>"
        + "".join(f"<td>{html.escape(_text(row[key]))}</td>" for key in ("what", "paper", "ours", "unit"))
        + "</tr>"
        for row in rows
    )
    return f"<table><tr><th>what</th><th>paper</th><th>ours</th><th>unit</th></tr>{cells}</table>"


def _text(value: Any) -> str:
    if value is None:
        return "–"
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _discovery(path: Path, found: Mapping[str, Any] | None) -> str:
    if found is None:
        return ""
    link = found.get("report")
    anchor = ""
    if link is not None:
        target = Path(link).resolve()
        inside = path.resolve().parent
        relative = target.relative_to(inside) if target.is_relative_to(inside) else target
        anchor = f' <a href="{html.escape(str(relative))}">The evidence.</a>'
    return f"<h2>What the twin lacks</h2><p>{html.escape(str(found.get('sentence', '')))}{anchor}</p>"


def _figure(svg: str, caption: str) -> str:
    return f"<figure>{svg}<figcaption>{html.escape(caption)}</figcaption></figure>"


def _axes(count: int) -> tuple[Any, Any]:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.0, 1.2 + 1.9 * count), layout="constrained")
    axes = figure.subplots(count, 1, sharex=True, squeeze=False)[:, 0]
    for axis in axes:
        axis.grid(alpha=0.25)
        axis.spines[["top", "right"]].set_visible(False)
    axes[-1].set_xlabel("time in s")
    return figure, axes


def _svg(figure: Any) -> str:
    import matplotlib as mpl

    sink = io.StringIO()
    # a fixed salt and no date: the same run gives the same page
    with mpl.rc_context({"svg.hashsalt": "dt-station", "svg.fonttype": "path"}):
        figure.savefig(sink, format="svg", metadata={"Date": None})
    text = sink.getvalue()
    return text[text.index("<svg") :]


def _pressure(run: DemoRun) -> str:
    figure, (above, below) = _axes(2)
    time = run.run.time_s - run.run.start_s
    signals = run.run.signals
    twin = run.twin.signals[Channel.PRESSURE.signal]
    above.step(time, 1e-6 * signals["pressure_setpoint_pa"], where="post", color="#999999", label="set-point")
    above.plot(time, 1e-6 * signals["pressure_pa"], color="#1769aa", label="object", linewidth=1.2)
    above.plot(time, 1e-6 * twin, color="#d1495b", label="twin", linewidth=1.0)
    above.set_ylabel("pressure in MPa")
    above.legend(loc="upper right", ncols=3, frameon=False)
    below.plot(time, 1e-6 * (signals["pressure_pa"] - twin), color="#3b3b3b", linewidth=0.9)
    below.set_ylabel("object - twin in MPa")
    return _svg(figure)


def _errors(runs: Mapping[str, DemoRun]) -> str:
    figure, axes = _axes(2)
    for axis, name in zip(axes, ("pid", "fuzzy"), strict=True):
        signals, time = runs[name].run.signals, runs[name].run.time_s - runs[name].run.start_s
        error = 1000.0 * (signals["position_setpoint_m"] - signals["position_m"])
        span = (time >= INDEX_FROM_S) & (time < INDEX_TO_S)
        axis.axvspan(INDEX_FROM_S, INDEX_TO_S, color="#8888", alpha=0.15, linewidth=0)
        axis.plot(time, error, color="#1769aa", linewidth=0.9)
        largest = float(abs(error[span]).max()) or 1.0
        axis.set_ylim(-1.3 * largest, 1.3 * largest)
        axis.set_ylabel(f"{name}: error in mm")
    return _svg(figure)


def _voltages(runs: Mapping[str, DemoRun]) -> str:
    figure, axes = _axes(2)
    for name, colour in (("pid", "#1769aa"), ("fuzzy", "#e08e0b")):
        run = runs[name].run
        time = run.time_s - run.start_s
        axes[0].plot(time, run.signals["servo_voltage_v"], color=colour, label=name, linewidth=0.9)
        axes[1].plot(time, run.signals["load_voltage_v"], color=colour, label=name, linewidth=0.9)
    axes[0].set_ylabel("servo valve in V")
    axes[0].legend(loc="upper right", ncols=2, frameon=False)
    axes[1].set_ylabel("relief valve in V")
    return _svg(figure)
