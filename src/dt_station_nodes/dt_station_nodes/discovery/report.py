"""The report a control engineer sends to a colleague: one self-contained HTML text."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from jinja2 import Environment
from matplotlib.figure import Figure

from ..core.channels import Channel
from ..core.models.effects import registry
from ..workers import ALONE, Workers
from .pictures import ranking_picture, svg, traces_picture, where_picture
from .report_template import TEMPLATE
from .result import DiscoveryResult, Figures, RankedCandidate


def _number(value: float) -> str:
    return f"{value:.4g}"


def _rows(result: DiscoveryResult) -> list[dict[str, str]]:
    def one(label: str, figures: Figures, channel: Channel) -> dict[str, str]:
        figure = figures[channel]
        fit = "" if label.endswith("floor") else f"{figure.fit_percent:.2f}"
        return {
            "channel": channel.value,
            "what": label,
            "ise": _number(figure.ise),
            "rms": f"{_number(figure.rms)} {result.unit(channel)}",
            "fit": fit,
        }

    gap = result.gap
    tables = (
        ("given model", gap.before),
        ("model found", gap.after),
        ("noise floor", gap.noise_floor),
        ("validation run, given model", gap.validation_before),
        ("validation run, model found", gap.validation_after),
    )
    return [one(label, figures, channel) for channel in gap.before for label, figures in tables if channel in figures]


def _pictured(result: DiscoveryResult) -> list[RankedCandidate]:
    """The best of each channel, and what the nominal parameters alone leave."""
    shown: list[RankedCandidate] = []
    for channel in result.gap.before:
        rows = [row for row in result.ranking if row.channel is channel]
        shown += rows[:10] + [row for row in rows[10:] if not row.names]
    return shown


def _effects(result: DiscoveryResult) -> list[dict[str, Any]]:
    library = registry()
    found = []
    for effect in result.effects:
        entry = library.get(effect.name)
        found.append(
            {
                "title": f"{effect.name.replace('_', ' ')} in the {effect.channel.value} path",
                "sentence": entry.sentence if entry else "The nominal parameters differ from those given.",
                "confidence": f"{100 * effect.confidence:.0f}",
                "alternatives": ", ".join(a.replace("_", " ") for a in effect.alternatives),
                "why": effect.why,
                "check": effect.check,
                "source": entry.source if entry else "",
                "parameters": [
                    {
                        "name": name.replace("_", " "),
                        "value": _number(p.value),
                        "low": _number(p.low),
                        "high": _number(p.high),
                        "unit": p.unit,
                        "meaning": entry.parameter(name).meaning if entry else "",
                    }
                    for name, p in effect.parameters.items()
                ],
            }
        )
    return found


def _drawn(picture: Callable[[], Figure]) -> str:
    return svg(picture())


def _pictures(result: DiscoveryResult, workers: Workers) -> dict[str, list[str]]:
    floors = {channel: figures.rms for channel, figures in result.gap.noise_floor.items()}
    wanted: dict[str, list[Callable[[], Figure]]] = {
        "run": [partial(traces_picture, trace, floors[trace.channel]) for trace in result.traces],
        "validation": [partial(traces_picture, trace, floors[trace.channel]) for trace in result.validation_traces],
        "where": [partial(where_picture, result.where)] if result.where else [],
        "ranking": [partial(ranking_picture, _pictured(result), floors)] if result.ranking else [],
    }
    drawn = workers.results(_drawn, [picture for pictures in wanted.values() for picture in pictures])
    return {place: [next(drawn) for _ in pictures] for place, pictures in wanted.items()}


def render(
    result: DiscoveryResult,
    facts: Sequence[tuple[str, str]],
    commands: Sequence[str],
    model_yaml: str,
    workers: Workers = ALONE,
) -> str:
    """The HTML text; `facts` are what was examined with what (versions, hashes), `commands` reproduce it."""
    ranking = [
        {
            "channel": row.channel.value,
            "names": " + ".join(row.names).replace("_", " ") or "nominal parameters alone",
            "explained": f"{100 * row.explained:.1f}",
            "rms": f"{_number(row.rms)} {result.unit(row.channel)}",
            "behind": f"{row.behind_best:.0f}",
            "outside": not row.inside_vocabulary,
        }
        for row in result.ranking
    ]
    nominal = [
        {"name": n.replace("_", " "), "value": _number(p.value), "low": _number(p.low), "high": _number(p.high)}
        for n, p in result.nominal.items()
    ]
    return (
        Environment(autoescape=True)
        .from_string(TEMPLATE)
        .render(
            sentence=result.sentence,
            verdict=result.verdict.value.replace("_", " "),
            interrupted=result.interrupted,
            notes=result.data_notes,
            effects=_effects(result),
            nominal=nominal,
            rows=_rows(result),
            where=result.where,
            ranking=ranking,
            experiment=result.next_experiment,
            pictures=_pictures(result, workers),
            facts=facts,
            commands=commands,
            model_yaml=model_yaml,
            run=result.run,
        )
    )
