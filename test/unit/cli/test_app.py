"""The frame of the command line: statuses, sentences, JSON, folders."""

import json
import math
import subprocess
import sys
import types
from enum import Enum
from pathlib import Path

import numpy as np
import pytest

from dt_station_nodes.cli import app, common
from dt_station_nodes.core.errors import StationError


@pytest.fixture
def verb(monkeypatch):
    """Run a function as the verb `demo`."""

    def run(function, *arguments):
        module = types.ModuleType("dt_station_nodes.cli.demo")
        module.demo = function
        monkeypatch.setitem(sys.modules, "dt_station_nodes.cli.demo", module)
        return app.main(["demo", *arguments])

    return run


@pytest.mark.parametrize(
    ("error", "status"),
    [
        (None, 0),
        (StationError("bad\n input"), 2),
        (common.UserError("bad input"), 2),
        (common.Failure("it failed"), 1),
        (KeyboardInterrupt(), 130),
        (FileNotFoundError(2, "No such file or directory", "x.csv"), 2),
    ],
)
def test_every_outcome_has_its_status_and_one_sentence(verb, capsys, error, status):
    def demo(n: int = 1) -> None:
        if error is not None:
            raise error

    assert verb(demo) == status
    said = capsys.readouterr()
    assert said.out == ""
    assert len(said.err.splitlines()) == (0 if error is None else 1)
    assert verb(demo, "--n", "x") == 2
    assert verb(demo, "--nonsense") == 2
    assert "Traceback" not in capsys.readouterr().err


def test_our_own_mistakes_keep_their_traceback(verb):
    def demo() -> None:
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        verb(demo)


def test_help_lists_every_verb_without_importing_any(capsys):
    assert app.main(["--help"]) == 0
    text = capsys.readouterr().out
    assert all(f"  {verb} " in text for verb in app.VERBS)
    script = (
        "import sys; from dt_station_nodes.cli.app import main; main(['--help'])\n"
        "print([m for m in sys.modules if m.split('.')[0] in ('rclpy', 'numba', 'matplotlib')])"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.strip().endswith("[]")


def test_a_misspelt_verb_is_guessed(capsys):
    assert app.main(["reccord"]) == 2
    assert "record" in capsys.readouterr().err
    assert app.main(["xyzzy"]) == 2
    assert app.main([]) == 2


@pytest.mark.parametrize("name", [verb for verb in app.VERBS if (Path(app.__file__).parent / f"{verb}.py").exists()])
def test_every_verb_has_help_with_an_example(name, capsys):
    assert app.main([name, "--help"]) == 0
    text = capsys.readouterr().out
    assert f"dt-station {name}" in text.split("Options:")[0].split("Usage:")[1].split("\n", 1)[1]


def test_json_is_plain_and_complete(capsys):
    class Colour(Enum):
        RED = "red"

    value = {"a": math.nan, Colour.RED: [Path("x"), np.float64(1.5), np.arange(2)], "b": (True, None, math.inf)}
    common.emit_json(value)
    assert json.loads(capsys.readouterr().out) == {"a": None, "red": ["x", 1.5, [0, 1]], "b": [True, None, None]}
    with pytest.raises(TypeError):
        common.jsonable(object())


def test_an_output_folder_is_never_overwritten_unasked(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    made = common.output_dir("demo", None, False)
    assert made.parent == Path("runs")
    assert common.output_dir("demo", None, False) != made
    (made / "file").touch()
    with pytest.raises(common.UserError, match="--force"):
        common.output_dir("demo", made, False)
    common.output_dir("demo", made, True)
    assert not (made / "file").exists()
    foreign = tmp_path / "home"
    foreign.mkdir()
    (foreign / "precious").touch()
    common.output_dir("demo", foreign, True)
    assert (foreign / "precious").exists()
    (tmp_path / "a file").touch()
    with pytest.raises(common.UserError, match="is a file"):
        common.output_dir("demo", tmp_path / "a file", True)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["set", "speed", "--value", "1"], "load or position"),
        (["set", "load"], "nothing to set"),
        (["set", "load", "--amplitude", "3cm"], "pressure"),
        (["set", "load", "--value", "2MPa", "--shape", "sine"], "constant"),
        (["set", "load", "--off", "--shape", "sine"], "--off"),
        (["run", "nowhere"], "nowhere"),
        (["run", "paper", "--pace", "fast"], "pace"),
        (["run", "paper", "--duration", "5kg"], "kg"),
        (["run", "paper", "-p", "nonsense"], "NODE.NAME=VALUE"),
        (["run", "paper", "-p", "moon.phase=1"], "moon"),
        (["node", "nobody"], "nobody"),
        (["node", "daq_bridge", "--speed"], "--ros-args"),
    ],
)
def test_bad_input_is_one_sentence_and_status_2(arguments, words, capsys):
    assert app.main(arguments) == 2
    said = capsys.readouterr().err
    assert words in said
    assert len(said.splitlines()) == 1


def test_nodes_are_listed(capsys):
    assert app.main(["node"]) == 0
    assert "twin_simulator" in capsys.readouterr().out.split()
