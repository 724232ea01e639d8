import ast
import csv
from pathlib import Path

import numpy as np
import pytest
from scipy import signal

from benchmarks.discovery.cases import Case, case_list, make, truth_of
from benchmarks.discovery.forms import SPOOL, STATES, STICK_SLIP, at_voltage
from benchmarks.discovery.generate import FILES, HEADER, write
from benchmarks.discovery.library import OUTSIDE, POSITION, PRESSURE, SINGLES, THIRD_ON
from benchmarks.discovery.plant import (
    DISTURBANCE_DEN,
    DISTURBANCE_NUM,
    PRESSURE_DEN,
    PRESSURE_NUM,
    Drive,
    Nominals,
    simulate,
)

HERE = Path(__file__).resolve().parents[3] / "benchmarks" / "discovery"
HIDDEN_SIDE = ("forms", "plant", "library", "experiments", "cases", "generate")


@pytest.mark.parametrize("module", HIDDEN_SIDE)
def test_generator_shares_nothing_with_the_station(module):
    tree = ast.parse((HERE / f"{module}.py").read_text())
    names = [a.name for node in ast.walk(tree) if isinstance(node, ast.Import) for a in node.names]
    names += [node.module or "" for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
    assert not [name for name in names if "dt_station" in name]


def test_perfect_object_is_the_papers_models():
    n = 400
    t = np.arange(n) * 0.02
    load, servo = 2.0 + np.sin(t), 0.5 * np.cos(2.0 * t)
    rows = simulate(Drive(load, servo, False, False, 0), (), Nominals(), np.zeros(n), np.zeros(n))
    fine = np.arange(n * 40) * 0.0005
    pressure = signal.lsim((PRESSURE_NUM, PRESSURE_DEN), np.repeat(load, 40), fine, interp=False)[1]
    moved = signal.lsim(([206.4], [1, 23.34, 0]), np.repeat(servo, 40), fine, interp=False)[1]
    pushed = signal.lsim((DISTURBANCE_NUM, DISTURBANCE_DEN), pressure, fine, interp=False)[1]
    np.testing.assert_allclose(rows[2], 1.0 + pressure[::40], atol=2e-6)
    np.testing.assert_allclose(rows[3], (moved + pushed)[::40], atol=2e-3)


def test_every_effect_and_outsider_can_be_made_and_shows():
    for name, channel in SINGLES:
        for family in ("textbook", "other"):
            made = make(Case("single", "sine", 40.0, 5, ((name, channel, family, 2),)))
            assert made.visibility[channel] >= 1.0
    for name, channel in THIRD_ON:
        assert make(Case("single", "sine", 40.0, 5, ((name, channel, "third", 2),))).visibility[channel] >= 1.0
    for name in OUTSIDE:
        channel = PRESSURE if name in ("trapped_air", "cross_coupling") else POSITION
        assert make(Case("outside", "triangle", 40.0, 5, ((name, channel, "outside", 2),))).visibility[channel] >= 1.0


@pytest.mark.parametrize("code", [STICK_SLIP, SPOOL])
def test_spool_that_sticks_follows_in_stairs_and_stays_behind_by_no_more_than_its_breakaway(code):
    breakaway_v, state = 0.3, np.zeros(STATES)
    given = 2.0 * np.sin(np.arange(8000) * 0.001)
    spool = np.array([at_voltage(code, breakaway_v, 0.1, 0.003, 0.0, u, 0.0, 0.001, np.zeros(4), state) for u in given])
    behind = np.abs(given - spool)
    assert 0.95 * breakaway_v < behind.max() < breakaway_v + 0.01
    assert np.mean(np.diff(spool) == 0.0) > 0.15
    assert np.abs(given - spool)[np.flatnonzero(np.diff(spool)) + 1].min() < 0.2


def test_same_seed_same_runs_and_noise_of_the_stated_size():
    case = Case("null", "square", 30.0, 3)
    a, b = make(case), make(case)
    for x, y in zip(a.runs, b.runs, strict=True):
        np.testing.assert_array_equal(x, y)
    quiet = make(Case("null", "square", None, 3))
    assert quiet.noise == ((0.0, 0.0),) * 3
    assert a.noise[0][0] == pytest.approx(np.std(a.runs[0][2]) * 10**-1.5, rel=0.1)


def test_run_files_carry_no_hint(tmp_path):
    effect = make(Case("single", "sine", 40.0, 5, (("friction", POSITION, "other", 2),)))
    null = make(Case("null", "sine", 40.0, 5))
    for folder, made in (("0000", effect), ("0001", null)):
        write(made, tmp_path / "runs" / folder)
    words = {name for name, _ in SINGLES} | set(OUTSIDE) | {"null", "pair", "textbook", "single", "severity", "seed"}
    for path in sorted((tmp_path / "runs").rglob("*")):
        if path.is_dir():
            assert path.name.isdigit()
            continue
        assert path.stem in FILES
        header, *rows = list(csv.reader(path.open()))
        assert ",".join(header) == HEADER
        assert all(len(row) == 7 for row in rows)
        np.testing.assert_allclose(np.diff([float(row[0]) for row in rows]), 0.02, atol=1e-9)
        text = path.read_text().lower()
        assert not [word for word in words if word in text]
    assert truth_of(effect)["effects"][0]["name"] == "friction"


def test_sets_grow_and_are_shuffled():
    smoke, standard = case_list("smoke", 1), case_list("standard", 1)
    assert len(smoke) < len(standard) < len(case_list("full", 1))
    kinds = [case.kind for case in smoke]
    assert kinds != sorted(kinds)
    assert {name for case in standard for name, *_ in case.effects} >= {name for name, _ in SINGLES} | set(OUTSIDE)
