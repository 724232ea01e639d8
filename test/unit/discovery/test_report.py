"""The report: one page, self-contained, says what the result says."""

import re

import numpy as np
import pytest

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import ModelSpec, PathSpec
from dt_station_nodes.discovery.report import render
from dt_station_nodes.discovery.result import (
    DiscoveryResult,
    Estimate,
    Gap,
    GapFigures,
    GapShare,
    NamedEffect,
    RankedCandidate,
    RunFacts,
    Trace,
    Verdict,
)
from dt_station_nodes.workers import ALONE, Workers

from .far_workers import FarWorkers


def result(verdict: Verdict, n: int = 5000) -> DiscoveryResult:
    time = np.arange(n) * 0.02
    wave = 1e6 * np.sin(time)
    figures = {Channel.PRESSURE: GapFigures(3e9, 5e4, 91.234)}
    effect = NamedEffect(
        "hysteresis",
        Channel.PRESSURE,
        0.97,
        {"half_width_v": Estimate(0.123456, 0.1, 0.2, "V")},
        ("backlash",),
        "a < b",
        "Try.",
    )
    return DiscoveryResult(
        verdict,
        (effect,) if verdict is Verdict.NAMED else (),
        (GapShare(Channel.PRESSURE, "falling voltage", 0.8, 0.5),),
        Gap(figures, figures, {Channel.PRESSURE: GapFigures(1e9, 2e4, 99.0)}),
        None,
        RunFacts("run <1>", "paper", "0.1.0", 3.2),
        ModelSpec(name="found", paths={Channel.PRESSURE: PathSpec(numerator=[1.0], denominator=[1.0, 1.0])}),
        "The relief valve shows hysteresis.",
        ("the voltage never saturates",),
        {"gain": Estimate(1.01, 1.0, 1.02, "1")},
        (RankedCandidate(Channel.PRESSURE, ("hysteresis",), 1e4, 0.93, 0.0),),
        (Trace(Channel.PRESSURE, "Pa", time, wave, wave, wave + 1e4, wave),),
    )


def page(verdict: Verdict, n: int = 5000, workers: Workers = ALONE) -> str:
    answer = result(verdict, n)
    return render(answer, [("numpy", "2.4.6")], ["dt-station discover run.csv"], answer.model.to_yaml(), workers)


@pytest.mark.parametrize("verdict", list(Verdict))
def test_the_page_says_what_the_result_says(verdict):
    text = page(verdict)
    assert text.index("The relief valve shows hysteresis.") < text.index("<table")
    assert "dt-station discover run.csv" in text
    assert ("0.1235" in text) == (verdict is Verdict.NAMED)
    assert "run &lt;1&gt;" in text
    assert "<1>" not in text


def test_the_page_needs_nothing_else_and_is_small():
    text = page(Verdict.NAMED, 200_000)
    outside = re.findall(r'(?:src|href)="(?!#)[^"]*"', text)
    assert [link for link in outside if "w3.org" not in link] == []
    assert len(text) < 3_000_000


def test_the_page_is_the_same_every_time():
    assert page(Verdict.NAMED) == page(Verdict.NAMED)


def test_workers_draw_the_same_page():
    workers = FarWorkers()
    text = page(Verdict.NAMED, workers=workers)
    assert text == page(Verdict.NAMED)
    assert workers.asked == [text.count("<svg")]
