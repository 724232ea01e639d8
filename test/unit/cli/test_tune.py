"""`tune` and `paper` as a user calls them."""

import json

import pytest

from dt_station_nodes.cli.app import main
from dt_station_nodes.core.control import LoopConfig


def called(capsys, *arguments):
    assert main([*map(str, arguments), "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def refused(capsys, *arguments):
    assert main([str(a) for a in arguments]) == 2
    written = capsys.readouterr()
    assert written.out == ""
    assert written.err.count("\n") == 1
    return written.err


def test_check_prints_the_forms_of_table_1_and_names_the_slow_pole(tmp_path, capsys):
    pi = called(capsys, "tune", "pressure", "--method", "check", "--out", tmp_path / "pi")
    assert pi["after"]["continuous"] == "(0.2861 s + 6.33)/s"
    assert pi["after"]["discrete"] == "(0.2861 z - 0.1595)/(z - 1)"
    pid = called(capsys, "tune", "position", "--method", "check", "--out", tmp_path / "pid")
    assert not pid["after"]["stable"]
    assert "|z| = 1.000013" in pid["after"]["findings"][0]


def test_optimised_settings_come_as_a_controller_file_that_loads(tmp_path, capsys):
    data = called(
        capsys, "tune", "pressure", "--evaluations", 80, "--phase-margin", 60, "--name", "mine", "--out", tmp_path / "a"
    )
    config = LoopConfig.from_yaml((tmp_path / "a" / "controller.yaml").read_text(encoding="utf-8"))
    assert config.name == "mine"
    assert config.pi.gain == data["after"]["settings"]["gain"]
    assert data["after"]["step"]["ise"] < data["before"]["step"]["ise"]
    assert data["after"]["phase_margin_deg"] >= 60.0
    again = called(capsys, "tune", "pressure", "--method", "check", "--controller", tmp_path / "a" / "controller.yaml",
                   "--out", tmp_path / "b")  # fmt: skip
    assert again["before"]["settings"] == data["after"]["settings"]


def test_ziegler_nichols_and_relay_tell_the_ultimate_point(tmp_path, capsys):
    model = called(capsys, "tune", "pressure", "--method", "ziegler-nichols", "--out", tmp_path / "zn")
    relay = called(capsys, "tune", "pressure", "--method", "relay", "--out", tmp_path / "relay")
    assert relay["ultimate"]["gain"] == pytest.approx(model["ultimate"]["gain"], rel=0.15)
    assert model["after"]["settings"]["gain"] == pytest.approx(0.45 * model["ultimate"]["gain"], rel=1e-3)


def test_a_person_gets_a_table(tmp_path, capsys):
    assert main(["tune", "position", "--method", "check", "--out", str(tmp_path / "x")]) == 0
    text = capsys.readouterr().out
    assert "phase margin" in text
    assert "slow unstable pole" in text


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--controller", "nonsense"], "nonsense"),
        (["--mode", "turbo"], "choose one of pi, pid, fuzzy"),
        (["--mode", "fuzzy"], "no section fuzzy"),
        (["--sample-time", "0"], "--sample-time"),
        (["--phase-margin", "200"], "phase_margin_deg"),
        (["--method", "relay", "--lowest", "5e6"], "between lowest and highest"),
    ],
)
def test_mistakes_get_one_sentence_and_leave_nothing(arguments, says, tmp_path, capsys):
    assert says in refused(capsys, "tune", "pressure", *arguments, "--out", tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_relay_out_of_its_limits_fails_and_leaves_nothing(tmp_path, capsys):
    arguments = ["tune", "pressure", "--method", "relay", "--highest", "2.6e6", "--amplitude", "2"]
    assert main([*arguments, "--out", str(tmp_path / "out")]) == 1
    assert "left the limits" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_paper_says_it_all_in_json_and_draws_its_figures(tmp_path, capsys):
    data = called(capsys, "paper", "--out", tmp_path / "out")
    assert {row["status"] for row in data["rows"]} <= {"reproduced", "better", "worse", "not comparable"}
    assert all(set(row) == {"what", "paper", "ours", "unit", "status", "why"} for row in data["rows"])
    assert list(data["files"]["figures"]) == ["6", "7", "9", "10", "12", "13", "14", "16", "17", "18"]
    for path in [*data["files"]["figures"].values(), *data["files"]["runs"], data["files"]["rows"]]:
        assert (tmp_path / "out" / path).stat().st_size > 1000


def test_paper_needs_both_paths(tmp_path, capsys):
    model = tmp_path / "m.yaml"
    model.write_text("name: m\npaths:\n  pressure: {numerator: [1], denominator: [1, 1]}\n", encoding="utf-8")
    assert "lacks a position path" in refused(capsys, "paper", "--model", model, "--out", tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_the_mode_chooses_the_controller_to_start_from(tmp_path, capsys):
    data = called(capsys, "tune", "position", "--mode", "fuzzy", "--method", "check", "--out", tmp_path / "out")
    config = LoopConfig.from_yaml((tmp_path / "out" / "controller.yaml").read_text(encoding="utf-8"))
    assert config.mode.name == "FUZZY"
    assert data["after"]["stable"]


def test_an_unstable_model_is_refused(tmp_path, capsys):
    model = tmp_path / "model.yaml"
    model.write_text("name: m\npaths:\n  pressure: {numerator: [1.0], denominator: [1.0, -2.0], scale: 1.0e6}\n")
    assert "pressure path is unstable" in refused(capsys, "tune", "pressure", "--model", model, "--out", tmp_path / "x")
    assert not (tmp_path / "x").exists()
