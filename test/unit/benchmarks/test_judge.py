import json

import pytest

from benchmarks.discovery.confusion import page
from benchmarks.discovery.judge import Judged, Outcome, figures, outcome_of

FRICTION = ("friction", "position")
BIAS = ("bias", "pressure")


def said(verdict, *effects):
    return {
        "verdict": verdict,
        "effects": [{"name": n, "channel": c, "alternatives": list(a)} for n, c, *a in effects],
    }


@pytest.mark.parametrize(
    ("truth", "answer", "library", "outcome"),
    [
        ([FRICTION], said("named", FRICTION), True, Outcome.EXACT),
        ([FRICTION], said("named", ("friction", "pressure")), True, Outcome.WRONG),
        ([FRICTION], said("named", ("dead_zone", "position", "friction")), True, Outcome.IN_SET),
        ([FRICTION], said("named", ("dead_zone", "position")), True, Outcome.WRONG),
        ([FRICTION], said("named", FRICTION, BIAS), True, Outcome.EXTRA),
        ([FRICTION], said("unexplained"), True, Outcome.ABSTAINED),
        ([FRICTION, BIAS], said("named", BIAS, FRICTION), True, Outcome.EXACT),
        ([FRICTION, BIAS], said("named", BIAS), True, Outcome.PARTLY),
        ([], said("nothing_missing"), True, Outcome.SILENT),
        ([], said("parameters_only"), True, Outcome.SILENT),
        ([], said("named", BIAS), True, Outcome.WRONG),
        ([("memory", "position")], said("unexplained"), False, Outcome.SILENT),
        ([("memory", "position")], said("named", ("gain_drift", "position")), False, Outcome.WRONG),
    ],
)
def test_outcomes(truth, answer, library, outcome):
    assert outcome_of(truth, answer, library) is outcome


def judged(number, kind, truth, found, verdict, outcome, **more):
    return Judged(number, kind, tuple(truth), tuple(found), (), verdict, outcome, 0.9, 2.0, **more)


def test_figures_and_page():
    cases = [
        judged("0000", "single", [FRICTION], [FRICTION], "named", Outcome.EXACT, noise_db=40.0, ratio=1.1),
        judged("0001", "single", [FRICTION], [BIAS], "named", Outcome.WRONG, noise_db=40.0, ratio=3.0),
        judged("0002", "null", [], [], "nothing_missing", Outcome.SILENT),
        judged("0003", "outside", [("memory", "position")], [], "unexplained", Outcome.SILENT),
        judged("0004", "pair", [FRICTION, BIAS], [FRICTION], "named", Outcome.PARTLY),
    ]
    by_name = {f.what: f for f in figures(cases)}
    exact = by_name["single effects at 40 dB, exact name and channel"]
    assert (exact.value, exact.count, exact.met) == (50.0, 2, False)
    assert by_name["false names on nulls"].met
    assert by_name["gap on an unseen waveform over the noise floor, median at 40 dB"].value == pytest.approx(2.05)
    assert by_name["next experiment separates"].met is None
    assert [Judged.from_json(json.dumps(case.to_json())) for case in cases] == cases
    text = page(cases, figures(cases), "the command")
    assert "| friction/x | 2 | 1 | bias/p 1 |" in text
    assert "| (memory/x) | 1 | 1 | unexplained 1 |" in text
    assert "    the command" in text
