"""The report: one self-contained page that a control engineer would send to a colleague."""

from collections.abc import Mapping

from jinja2 import Environment

from ..core.channels import Channel
from .report_figures import floors, ranking_figure, shown, trace_figure, where_figure
from .report_page import PAGE
from .result import DiscoveryResult, Estimate, Figures, RankedCandidate, Verdict

_HEADLINE = {
    Verdict.NAMED: "Effect found",
    Verdict.PARAMETERS_ONLY: "Only parameters are off",
    Verdict.NOTHING_MISSING: "Nothing is missing",
    Verdict.UNEXPLAINED: "Something is missing that we cannot name",
}
_MOST_CANDIDATES = 10


def render_report(result: DiscoveryResult, reproduce: Mapping[str, str] | None = None) -> str:
    """The page as text. `reproduce` holds what it takes to get it again: commands, versions, hashes by their label."""
    floor = floors(result)
    channels = [trace.channel for trace in result.traces]
    environment = Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True)
    environment.filters["si"] = significant
    return environment.from_string(PAGE).render(
        result=result,
        headline=_HEADLINE[result.verdict],
        named=result.verdict is Verdict.NAMED,
        gap_rows=[row for channel in channels for row in _gap_rows(result, channel)],
        traces=[(t.channel.value, trace_figure(t, floor.get(t.channel))) for t in result.traces],
        validation=[(t.channel.value, trace_figure(t, floor.get(t.channel))) for t in result.validation_traces],
        where=where_figure(result.where) if result.where else "",
        rankings=[(c.value, rows, ranking_figure(rows)) for c in channels if (rows := _ranking(result, c))],
        effects=[(e, [(n, interval(p)) for n, p in e.parameters.items()]) for e in result.effects],
        nominal=[(name, interval(estimate)) for name, estimate in result.nominal.items()],
        model=result.model.to_yaml(),
        reproduce=dict(reproduce or {}),
    )


def significant(value: float) -> str:
    """Four significant digits."""
    return f"{value:.4g}"


def interval(estimate: Estimate) -> str:
    """A value with its unit and 95 % interval."""
    unit = "" if estimate.unit == "1" else f" {estimate.unit}"
    return f"{estimate.value:.4g}{unit}  (95 %: {estimate.low:.4g} to {estimate.high:.4g})"


def _ranking(result: DiscoveryResult, channel: Channel) -> list[RankedCandidate]:
    return [c for c in result.ranking if c.channel is channel][:_MOST_CANDIDATES]


def _gap_rows(result: DiscoveryResult, channel: Channel) -> list[dict[str, str]]:
    """Rows of the table of figures: this run and the validation run, before and after."""
    unit = next((t.unit for t in result.traces if t.channel is channel), channel.unit)
    factor, name = shown(unit)
    rows = []
    floor = result.gap.noise_floor.get(channel)

    def add(run: str, model: str, table: Figures) -> None:
        if channel in table:
            one = table[channel]
            over = f"{one.rms / floor.rms:.2f}" if floor and floor.rms > 0.0 and run == "this run" else ""
            rows.append(
                {
                    "channel": channel.value,
                    "run": run,
                    "model": model,
                    "rms": f"{one.rms * factor:.4g} {name}",
                    "ise": f"{one.ise * factor**2:.4g} {name}² s",
                    "fit": f"{one.fit_percent:.2f} %",
                    "over": over,
                }
            )

    add("this run", "as given", result.gap.before)
    add("this run", "as found", result.gap.after)
    add("validation", "as given", result.gap.validation_before)
    add("validation", "as found", result.gap.validation_after)
    if floor is not None:
        noise = {"rms": f"{floor.rms * factor:.4g} {name}", "ise": f"{floor.ise * factor**2:.4g} {name}² s"}
        rows.append(
            {"channel": channel.value, "run": "this run", "model": "noise floor", "fit": "", "over": "", **noise}
        )
    return rows
