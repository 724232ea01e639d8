"""`identify`, `experiment --in-process` and `simulate` as a user calls them."""

import json

import numpy as np
import pytest

from dt_station_nodes.cli.app import main
from dt_station_nodes.core.models import ModelSpec
from dt_station_nodes.core.run import Run
from dt_station_nodes.records import write_csv
from support.known_systems import noisy, response, switching


@pytest.fixture(scope="module")
def table(tmp_path_factory):
    from dt_station_nodes.identification import TransferFunction

    voltage = switching(1200, 6, 0.0, 5.0, 0)
    pressure = 1e6 * (1.0 + noisy(response(TransferFunction((1600.0,), (1.0, 60.0, 1600.0)), voltage), 0))
    path = tmp_path_factory.mktemp("runs") / "run.csv"
    write_csv(Run(0.02, {"load_voltage_v": voltage, "pressure_pa": pressure}), path)
    return path


def refused(capsys, *arguments):
    assert main([str(a) for a in arguments]) == 2
    written = capsys.readouterr()
    assert written.out == ""
    assert written.err.count("\n") == 1
    return written.err


def test_identify_leaves_a_model_the_twin_loads_and_says_so_in_json(table, tmp_path, capsys):
    out = tmp_path / "out"
    arguments = [
        "identify",
        str(table),
        "--poles",
        "1-2",
        "--delay",
        "none",
        "--validate",
        str(table),
        "--model",
        "paper",
    ]
    assert main([*arguments, "--out", str(out), "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    (path,) = result["paths"]
    assert path["chosen"]["transfer"]["denominator"] == pytest.approx([1.0, 60.0, 1600.0], rel=0.05)
    assert [c["chosen"] for c in path["candidates"]].count(True) == 1
    assert path["validation"]["fit_percent"] > path["validation"]["given_model_fit_percent"]
    low, high = path["parameters"]["pressure DC gain"]["ci95"]
    assert low < 1.0 < high
    text = (out / "model.yaml").read_text()
    assert "95 %" in text.splitlines()[0]
    assert set(ModelSpec.from_yaml(text).paths) == {"pressure", "position"}
    assert {p.name for p in out.glob("*.png")} == {"pressure-direct-fit.png", "pressure-direct-bode.png"}
    assert json.loads((out / "identification.json").read_text())["paths"] == result["paths"]


def test_identify_prints_the_candidates(table, tmp_path, capsys):
    assert (
        main(["identify", str(table), "--poles", "2", "--zeros", "0", "--delay", "none", "--out", str(tmp_path / "o")])
        == 0
    )
    printed = capsys.readouterr().out
    assert "chosen" in printed
    assert "residual is white: passed" in printed


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (["--poles", "2", "--zeros", "2"], "improper"),
        (["--poles", "two"], "write numbers as"),
        (["--poles", "99"], "between 0 and 12"),
        (["--delay", "soon"], "auto, none or seconds"),
        (["--channel", "position"], "has no"),
        (["--model", "nowhere"], "nowhere"),
        (["--method", "static"], "up and down"),
        (["--delay", "-1"], "number of seconds"),
        (["--method", "static", "--lag", "1e9"], "quarter of the run"),
        (["--method", "closed-loop", "--channel", "pressure"], "pressure_setpoint_pa"),
        (["--method", "inverse-dynamics"], "has no servo_voltage_v"),
        (["--method", "inverse-dynamics", "--force-per-volt", "0"], "force per volt"),
        (["--rest-pressure", "nan"], "--rest-pressure"),
    ],
)
def test_bad_requests_get_one_sentence_and_no_files(table, tmp_path, capsys, options, says):
    rising = tmp_path / "rising.csv"
    ramp = np.linspace(0.0, 5.0, 200)
    write_csv(Run(0.02, {"load_voltage_v": ramp, "pressure_pa": 1e6 * ramp}), rising)
    run = rising if "static" in options else table
    assert says in refused(capsys, "identify", run, *options, "--out", tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_run_without_excitation_gets_one_sentence(tmp_path, capsys):
    path = tmp_path / "still.csv"
    write_csv(Run(0.02, {"load_voltage_v": np.zeros(50), "pressure_pa": np.arange(50.0)}), path)
    assert "excite a valve" in refused(capsys, "identify", path, "--out", tmp_path / "out")


def test_a_broken_model_gets_one_sentence(table, tmp_path, capsys):
    model = tmp_path / "broken.yaml"
    model.write_text("name: x\npaths: {pressure: {numerator: [1, 2, 3], denominator: [1, 1]}}\n")
    assert "improper" in refused(capsys, "simulate", model, "--out", tmp_path / "out")
    model.write_text("name: x\npaths: [\n")
    assert "broken.yaml" in refused(capsys, "identify", table, "--model", model, "--out", tmp_path / "out")
    model.write_text("name: x\npaths: {pressure: {numerator: [1], denominator: [1, -1]}}\n")
    assert "unstable" in refused(capsys, "simulate", model, "--out", tmp_path / "out")


def test_experiments_are_listed_and_run_in_process_the_same_way_twice(tmp_path, capsys):
    assert main(["experiment", "--json"]) == 0
    names = [row["name"] for row in json.loads(capsys.readouterr().out)["experiments"]]
    assert "pressure-square" in names
    tables = []
    for attempt in ("one", "two"):
        out = tmp_path / attempt
        arguments = ["experiment", "joint", "--in-process", "--duration", "3", "--out", str(out), "--json"]
        assert main(arguments) == 0
        assert json.loads(capsys.readouterr().out)["samples"] == 150
        tables.append((out / "run.csv").read_bytes())
        assert (out / "plan.yaml").is_file()
    assert tables[0] == tables[1]


def test_an_unknown_experiment_gets_one_sentence(tmp_path, capsys):
    assert "pressure-square" in refused(capsys, "experiment", "presure-square", "--out", tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_simulate_plays_waveforms_and_closes_loops(tmp_path, capsys):
    arguments = ["simulate", "paper", "--load", "3MPa", "--load-controller", "pressure_pi", "--duration", "4", "--json"]
    assert main([*arguments, "--out", str(tmp_path / "a")]) == 0
    rows = {row["channel"]: row for row in json.loads(capsys.readouterr().out)["rows"]}
    assert rows["pressure"]["end"] == pytest.approx(3e6, rel=1e-3)
    assert (tmp_path / "a" / "simulation.png").stat().st_size > 1000
    square = "square,amplitude=1V,offset=2V,frequency=0.5Hz"
    assert main(["simulate", "paper", "--load", square, "--duration", "2", "--json", "--out", str(tmp_path / "b")]) == 0
    assert json.loads(capsys.readouterr().out)["samples"] == 100
    run = np.genfromtxt(tmp_path / "b" / "run.csv", delimiter=",", names=True)
    assert set(run["load_voltage_v"]) == {1.0, 3.0}


def test_simulate_on_a_run_says_how_well_it_fits(table, tmp_path, capsys):
    assert main(["simulate", "paper", "--run", str(table), "--json", "--out", str(tmp_path / "o")]) == 0
    (row,) = json.loads(capsys.readouterr().out)["rows"]
    assert 50.0 < row["fit_percent"] < 100.0


@pytest.mark.parametrize("text", ["quare,amplitude=1V", "square,amplitude=2Pa", "square,height=2V", "much"])
def test_a_mistyped_waveform_gets_one_sentence(tmp_path, capsys, text):
    refused(capsys, "simulate", "paper", "--load", text, "--out", tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_map_is_found_by_name(table, tmp_path, capsys):
    for verb in (["identify", table], ["simulate", "paper", "--run", table]):
        assert "no nothing in" in refused(capsys, *verb, "--map", "nothing", "--out", tmp_path / "out")
        assert "MAT file" in refused(capsys, *verb, "--map", "emps", "--out", tmp_path / "out")
