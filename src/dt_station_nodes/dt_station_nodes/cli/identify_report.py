"""What `dt-station identify` shows and leaves."""

import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from rich.console import Console
from rich.table import Table

from ..core.channels import Channel
from ..core.models import ModelSpec
from ..core.run import Run
from ..identification import IdentifiedPath, Interval, Method, fit_percent
from ..identification.inverse_dynamics import FrictionModel, fit_axis, force_error_percent, regression
from ..identification.modelfile import axis_model, commented, model_of, with_characteristic
from ..identification.pictures import bode_figure, characteristic_figure, fit_figure
from ..identification.static_characteristic import static_characteristic
from ..identification.station import direct_data, output_scale
from ..identification.summary import axis_summary, characteristic_summary, named_intervals, path_summary
from ..identification.validation import model_fit, path_lag_s
from .common import jsonable


@dataclass
class Outcome:
    """A finished identification: its summary, its model, its pictures, and how to print it."""

    summary: dict[str, Any]
    model: str | None
    figures: dict[str, Figure] = field(default_factory=dict)
    tables: list[Table | str] = field(default_factory=list)

    def write(self, folder: Path) -> None:
        """Leave model.yaml, identification.json and the pictures."""
        if self.model is not None:
            (folder / "model.yaml").write_text(self.model, encoding="utf-8")
        text = json.dumps(jsonable(self.summary), indent=2, allow_nan=False)
        (folder / "identification.json").write_text(text + "\n", encoding="utf-8")
        for name, figure in self.figures.items():
            figure.savefig(folder / f"{name}.png", dpi=110)

    def show(self) -> None:
        """Print the tables on standard output."""
        out = Console(highlight=False)
        for table in self.tables:
            out.print(table)


def paths(run: Run, found: Sequence[IdentifiedPath], check: Run | None, base: ModelSpec | None, name: str) -> Outcome:
    """Transfer functions of one or more channels; of one identified twice the first goes into the model."""
    chosen = {path.channel: path for path in reversed(found)}
    spec = model_of([chosen[c] for c in Channel if c in chosen], name, f"identified from {run.source}", base)
    intervals: dict[str, Interval] = {}
    figures, tables, summaries = {}, [], []
    for path in found:
        summary = path_summary(path)
        if check is not None and path.method is Method.DIRECT:
            summary["validation"] = _validation(path, check, base)
        summaries.append(summary)
        tag = f"{path.channel.value}-{path.method.value}"
        figures[f"{tag}-fit"] = fit_figure(path)
        figures[f"{tag}-bode"] = bode_figure(path)
        tables += [_candidates(path), _parameters(named_intervals(path), path), *_remarks(path, summary)]
        if chosen[path.channel] is path:
            intervals.update(named_intervals(path))
    summary = {"run": run.source, "sample_time_s": run.sample_time_s, "paths": summaries, "model": json_model(spec)}
    return Outcome(summary, commented(spec, intervals), figures, tables)


def static(run: Run, channels: Sequence[Channel], lag_s: float | None, base: ModelSpec | None, name: str) -> Outcome:
    """Static characteristics; with a base model also that model with the effects found."""
    shapes: list[dict[str, Any]] = []
    figures: dict[str, Figure] = {}
    tables: list[Table | str] = []
    spec = base
    for channel in channels:
        lag = lag_s if lag_s is not None else path_lag_s(base, channel)
        shape = static_characteristic(run, channel, lag)
        shapes.append({**characteristic_summary(shape), "lag_s": lag})
        figures[f"{channel.value}-static"] = characteristic_figure(shape, run)
        table = Table("quantity", "value", "95 % interval", title=f"Static characteristic, {channel.value}")
        for key in ("rest", "gain", "hysteresis_half_width", "hysteresis_spread", "dead_zone_half_width", "null"):
            _row(table, key, shapes[-1][key])
        for key in ("saturation_upper", "saturation_lower"):
            _row(table, key, shapes[-1][key])
        tables.append(table)
        if spec is not None and channel in spec.paths:
            spec = with_characteristic(spec, shape).renamed(name, f"static characteristic from {run.source}")
    summary = {"run": run.source, "characteristics": shapes, "model": None if spec is None else json_model(spec)}
    return Outcome(summary, None if spec is None else commented(spec, {}), figures, tables)


def axis(run: Run, check: Run | None, force_per_volt: float, name: str) -> Outcome:
    """A mechanical axis with friction; the Coulomb model goes into the model file."""
    data = regression(run, force_per_volt)
    other = regression(check, force_per_volt) if check is not None else None
    models, tables = [], []
    for friction in FrictionModel:
        fitted = fit_axis(data, friction)
        elsewhere = None if other is None else force_error_percent(other, friction, fitted.values)
        models.append(axis_summary(fitted, elsewhere))
        title = f"{friction.value} friction: force error {fitted.force_error_percent:.2f} %"
        table = Table("parameter", "value", "95 % interval", title=title)
        if elsewhere is not None:
            table.caption = f"on the other run {elsewhere:.2f} %"
        for key, value in models[-1]["parameters"].items():
            _row(table, key, value)
        tables.append(table)
    coulomb = fit_axis(data, FrictionModel.COULOMB)
    scale = output_scale(run, Channel.POSITION)
    spec = axis_model(coulomb, force_per_volt, scale, name, f"inverse dynamics of {run.source}")
    summary = {"run": run.source, "force_per_volt": force_per_volt, "axis": models, "model": json_model(spec)}
    return Outcome(summary, commented(spec, coulomb.values), {}, list(tables))


def json_model(spec: ModelSpec) -> dict[str, Any]:
    """The model as plain values."""
    return spec.model_dump(mode="json", exclude_none=True)


def _validation(path: IdentifiedPath, check: Run, base: ModelSpec | None) -> dict[str, Any]:
    """Free-run fit on another run, of the identified path and of the given model's."""
    rest = None
    if len(path.estimate.structure.paths) > 1:
        rest = float(np.quantile(check.signals[Channel.PRESSURE.signal], 0.01))
    data = direct_data(check, path.channel, rest)
    result: dict[str, Any] = {
        "run": check.source,
        "fit_percent": fit_percent(data.output, path.estimate.predict(data)),
    }
    if base is not None and path.channel in base.paths:
        result["given_model_fit_percent"] = model_fit(base, check, path.channel)
    return result


def _candidates(path: IdentifiedPath) -> Table:
    table = Table(title=f"{path.channel.value}, {path.method.value}")
    for heading in ("poles", "zeros", "delay ms", "fit %", "held out %", "AIC", "BIC", ""):
        table.add_column(heading, justify="right")
    for candidate in path.selection.candidates:
        fitted = candidate.estimate
        chosen = candidate is path.selection.chosen
        held_out = candidate.validation_fit_percent
        cells = [
            str(candidate.poles),
            str(candidate.zeros),
            f"{1e3 * fitted.delay(candidate.path).value:.1f}",
            f"{fitted.fit_percent:.2f}",
            f"{held_out:.2f}" if held_out > -999.0 else "-",
            f"{fitted.aic:.0f}",
            f"{fitted.bic:.0f}",
            "chosen" if chosen else candidate.doubt,
        ]
        table.add_row(*cells, style="bold" if chosen else None)
    return table


def _parameters(intervals: dict[str, Interval], path: IdentifiedPath) -> Table:
    table = Table(
        "parameter", "value", "95 % interval", title=f"{path.channel.value}, {path.method.value}: {path.selection.why}"
    )
    for name, interval in intervals.items():
        table.add_row(name, f"{interval.value:.5g}", f"{interval.low:.5g} to {interval.high:.5g}")
    return table


def _remarks(path: IdentifiedPath, summary: dict[str, Any]) -> list[Table | str]:
    lines = [f"note: {note}" for note in path.notes]
    for check in path.estimate.checks:
        verdict = "passed" if check.passed else "FAILED"
        lines.append(f"{check.name}: {verdict} ({check.statistic:.1f}, limit {check.limit:.1f})")
    if "validation" in summary:
        validation = summary["validation"]
        line = f"fit on {validation['run']}: {validation['fit_percent']:.2f} %"
        if "given_model_fit_percent" in validation:
            line += f"; the given model {validation['given_model_fit_percent']:.2f} %"
        lines.append(line)
    return list(lines)


def _row(table: Table, name: str, value: dict[str, Any] | None) -> None:
    if value is None:
        table.add_row(name.replace("_", " "), "none seen", "")
        return
    low, high = value["ci95"]
    unit = f" {value['unit']}" if value["unit"] else ""
    table.add_row(name.replace("_", " "), f"{value['value']:.5g}{unit}", f"{low:.5g} to {high:.5g}")
