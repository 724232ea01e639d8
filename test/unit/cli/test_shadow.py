"""What `shadow` refuses before anything starts, and how published figures stand beside ours."""

import numpy as np
import pytest
import scipy.io

from dt_station_nodes.cli.app import main
from dt_station_nodes.cli.published import Figure, figures_for
from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.errors import StationError

HEADER = "time_s,servo_voltage_v,position_m\n"


def refused(capsys, *arguments):
    assert main(["shadow", *map(str, arguments)]) == 2
    written = capsys.readouterr()
    assert written.out == ""
    assert written.err.count("\n") == 1
    return written.err


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "empty"),
        ("time_s,voltage\n0,1\n0.02,1\n", "columns"),
        (HEADER + "0,1,0\n0.02,nan,0\n0.04,1,0\n", "servo_voltage_v"),
        (HEADER + "0,1,0\n0.02,1,0\n0.01,1,0\n", "time_s"),
        (HEADER + "0,1,0\n0.02,1,0\n0.05,1,0\n0.06,1,0\n", "time_s"),
    ],
    ids=["empty", "missing column", "NaN", "time goes back", "jitter"],
)
def test_a_bad_table_gets_one_sentence_and_no_files(tmp_path, capsys, text, says):
    path = tmp_path / "run.csv"
    path.write_text(text)
    error = refused(capsys, path, "--model", "emps", "--out", tmp_path / "out")
    assert str(path) in error
    assert says in error
    assert not (tmp_path / "out").exists()


def test_a_truncated_mat_file_gets_one_sentence(tmp_path, capsys):
    whole, cut = tmp_path / "whole.mat", tmp_path / "cut.mat"
    scipy.io.savemat(whole, {"u": np.zeros(2000), "p": np.random.default_rng(1).normal(size=2000)})
    cut.write_bytes(whole.read_bytes()[: whole.stat().st_size // 2])
    error = refused(capsys, cut, "--map", "crane", "--model", "crane", "--out", tmp_path / "out")
    assert str(cut) in error
    assert not (tmp_path / "out").exists()


def test_a_model_of_another_channel_is_refused(tmp_path, capsys):
    path = tmp_path / "run.csv"
    path.write_text(HEADER + "0,1,0\n0.02,1,0\n0.04,1,0\n")
    error = refused(capsys, path, "--model", "crane", "--out", tmp_path / "out")
    assert "measured position, but model crane describes pressure" in error
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("arguments", [["--map", "nosuch"], ["--model", "nosuch"]])
def test_unknown_names_are_refused(tmp_path, capsys, arguments):
    path = tmp_path / "run.csv"
    path.write_text(HEADER + "0,1,0\n0.02,1,0\n")
    assert "nosuch" in refused(capsys, path, *arguments)


@pytest.mark.parametrize("name", ["emps", "emps_pulses", "crane", "crane_validation", "tanks_validation"])
def test_shipped_figures_are_readable(name):
    figures = figures_for(name)
    assert figures
    assert all(figure.source and figure.low <= figure.high for figure in figures)


def test_no_figures_for_data_that_nobody_published():
    assert figures_for("nosuch") == ()


def test_a_bad_figures_file_is_named(tmp_path, monkeypatch):
    (tmp_path / "published").mkdir()
    (tmp_path / "published" / "mine.yaml").write_text("figures: [{channel: heat}]")
    monkeypatch.setenv("DT_STATION_CONFIG", str(tmp_path))
    with pytest.raises(StationError, match=r"mine\.yaml: figures"):
        figures_for("mine")


@pytest.mark.parametrize(
    ("figure", "ours", "status"),
    [
        ("rms", 1.0, "better"),
        ("rms", 5.5, "like it"),
        ("rms", 9.0, "worse"),
        ("fit_percent", 1.0, "worse"),
        ("fit_percent", 7.0, "like it"),
        ("fit_percent", 9.0, "better"),
    ],
)
def test_less_error_and_more_fit_are_better(figure, ours, status):
    published = Figure(channel=Channel.POSITION, figure=figure, low=5.0, high=7.0, what="theirs")
    assert published.judged(ours) == status
