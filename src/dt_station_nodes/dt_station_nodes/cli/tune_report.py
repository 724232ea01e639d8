"""What `dt-station tune` prints and leaves."""

import json
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from ..core.channels import Channel
from ..core.control import LoopConfig
from ..identification.tuning import Trial, UltimatePoint, texts
from .common import console, jsonable

SETTINGS = {
    "pi": ("gain", "integral_time_s"),
    "pid": ("p", "i", "d", "derivative_filter_s"),
    "fuzzy": ("error_gain", "load_gain", "output_gain", "error_lead_s", "integral_gain"),
}


def result(
    model: str,
    channel: Channel,
    sample_time_s: float,
    method: str,
    before: Trial,
    after: Trial,
    point: UltimatePoint | None,
    notes: list[str],
    tuned: LoopConfig,
) -> dict[str, Any]:
    """The tuning as plain data."""
    return {
        "controller": tuned.name,
        "channel": channel.value,
        "model": model,
        "method": method,
        "sample_time_s": sample_time_s,
        "ultimate": None if point is None else {"gain": point.gain, "period_s": point.period_s},
        "before": _trial(before, sample_time_s),
        "after": _trial(after, sample_time_s),
        "notes": notes,
    }


def _trial(trial: Trial, sample_time_s: float) -> dict[str, Any]:
    section = trial.config.mode.name.lower()
    continuous, discrete = texts(trial.config, sample_time_s)
    margins = trial.stability
    return {
        "mode": section,
        "settings": {name: getattr(getattr(trial.config, section), name) for name in SETTINGS[section]},
        "continuous": continuous,
        "discrete": discrete,
        "step": jsonable(trial.step),
        "index_under_load": trial.hold_index,
        "stable": margins.stable,
        "gain_margin": margins.gain_margin,
        "gain_margin_db": margins.gain_margin_db,
        "phase_margin_deg": margins.phase_margin_deg,
        "delay_margin_s": margins.delay_margin_s,
        "largest_pole": abs(margins.poles[0]) if margins.poles else 0.0,
        "slow_unstable_poles": [jsonable(pole) for pole in margins.slow_poles],
        "findings": list(margins.findings),
    }


def write(folder: Path, tuned: LoopConfig, data: dict[str, Any]) -> dict[str, Path]:
    """Leave the controller and the figures; returns the paths by name."""
    files = {"controller": folder / "controller.yaml", "tuning": folder / "tuning.json"}
    files["controller"].write_text(tuned.to_yaml(), encoding="utf-8")
    files["tuning"].write_text(json.dumps(jsonable(data), indent=2) + "\n", encoding="utf-8")
    return files


def show(data: dict[str, Any], files: dict[str, Path]) -> None:
    """Print it for a person."""
    before, after = data["before"], data["after"]
    unit = "MPa" if data["channel"] == Channel.PRESSURE.value else "cm"
    table = Table("", "before", "after", title=f"{data['controller']}, {data['method']} on model {data['model']}")
    for name in dict.fromkeys((*before["settings"], *after["settings"])):
        table.add_row(name, _number(before["settings"].get(name)), _number(after["settings"].get(name)))
    rows: list[tuple[str, str]] = [("continuous", "continuous"), ("discrete", "discrete")]
    for text, key in rows:
        table.add_row(text, before[key], after[key])
    steps = {
        "settling_s": "settling (2 %), s",
        "overshoot_percent": "overshoot, %",
        "static_error": f"static error, {unit}",
        "ise": f"ISE, {unit}² s",
        "itae": f"ITAE, {unit} s²",
        "peak_v": "peak voltage, V",
        "travel_v": "voltage use (sum of changes), V",
    }
    for key, text in steps.items():
        table.add_row(text, _number(before["step"][key]), _number(after["step"][key]))
    if before["index_under_load"] is not None:
        table.add_row(
            "index (8) under load, mm²", _number(before["index_under_load"]), _number(after["index_under_load"])
        )
    for key, text in (
        ("gain_margin_db", "gain margin, dB"),
        ("phase_margin_deg", "phase margin, degrees"),
        ("delay_margin_s", "delay margin, s"),
        ("largest_pole", "largest |z|"),
    ):
        table.add_row(text, _number(before[key], 7), _number(after[key], 7))
    table.add_row("stable", "yes" if before["stable"] else "no", "yes" if after["stable"] else "no")
    printer = Console()
    printer.print(table)
    if data["ultimate"]:
        printer.print(
            f"ultimate gain {data['ultimate']['gain']:.4g} V/{unit}, period {data['ultimate']['period_s']:.4g} s"
        )
    for label, trial in (("before", before), ("after", after)):
        for finding in trial["findings"]:
            printer.print(f"{label}: {finding}", soft_wrap=True)
    for note in data["notes"]:
        printer.print(note, soft_wrap=True)
    for name, path in files.items():
        console.print(f"{name}: {path}", soft_wrap=True)


def _number(value: float | None, digits: int = 4) -> str:
    return "-" if value is None else f"{value:.{digits}g}"
