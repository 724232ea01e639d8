"""`dt-station test`: what it runs, and what it makes of the outcome."""

import io
import json
import sys

import pytest

from dt_station_nodes.cli import app
from dt_station_nodes.cli import test as verb
from dt_station_nodes.cli.common import UserError


@pytest.fixture
def ran(monkeypatch):
    """Record the checkers instead of running them; `statuses` and `lines` are those of pytest's runs."""
    calls = []
    answer = {"statuses": [0, 0], "lines": ["= 3 passed, 1 skipped in 0.1s =", "= 2 passed in 0.1s ="]}

    def fake(name, command, root, output):
        calls.append((name, command[3:]))
        at = [called for called, _ in calls].count("pytest") - 1
        return verb.Outcome(name, answer["statuses"][at] if name == "pytest" else 0, 0.1, answer["lines"][at])

    monkeypatch.setattr(verb, "run_checker", fake)
    monkeypatch.setattr(verb, "TYPED_FOR", sys.version_info[:2])
    return calls, answer


def test_all_three_run_and_further_arguments_go_to_pytest(ran, capsys):
    calls, _ = ran
    assert app.main(["test", "--json", "-k", "waveform", "-x"]) == 0
    assert [name for name, _ in calls] == ["ruff", "mypy", "pytest", "pytest"]
    assert all(arguments[-3:] == ["-k", "waveform", "-x"] for _, arguments in calls[2:])
    told = json.loads(capsys.readouterr().out)
    assert told["ok"] is True
    assert (told["pytest"]["passed"], told["pytest"]["skipped"]) == (5, 1)


def test_what_lives_in_real_time_is_run_alone_and_nothing_twice(ran):
    calls, _ = ran
    app.main(["test", "--no-lint"])
    (_, beside), (_, alone) = calls
    assert "-n" in beside
    assert beside[-1] == "not live"
    assert alone[-2:] == ["-m", "live"]
    assert "-n" not in alone


@pytest.mark.parametrize("arguments", [["-m", "measured"], []], ids=["chosen by marks", "without pytest-xdist"])
def test_one_run_has_every_test_where_it_cannot_be_parted(ran, monkeypatch, arguments):
    calls, _ = ran
    if not arguments:
        monkeypatch.setattr(verb, "find_spec", lambda name: None)
    assert app.main(["test", "--no-lint", *arguments]) == 0
    ((_, given),) = calls
    assert given == ["--color=auto", *arguments]


@pytest.mark.parametrize("statuses", [[5, 0], [0, 5]])
def test_a_run_without_tests_is_no_failure_beside_one_that_has_some(ran, statuses):
    ran[1].update(statuses=statuses)
    assert app.main(["test", "--no-lint"]) == 0


def test_no_test_at_all_is_a_failure(ran):
    ran[1].update(statuses=[5, 5])
    assert app.main(["test", "--no-lint"]) == 1


def test_the_checkers_can_be_left_out(ran):
    calls, _ = ran
    assert app.main(["test", "--no-lint"]) == 0
    assert {name for name, _ in calls} == {"pytest"}


def test_types_are_checked_where_numpy_is_the_one_they_were_written_for(ran, monkeypatch):
    calls, _ = ran
    monkeypatch.setattr(verb, "TYPED_FOR", (3, 9))
    assert app.main(["test"]) == 0
    assert [name for name, _ in calls] == ["ruff", "pytest", "pytest"]


@pytest.mark.parametrize("at", [0, 1])
def test_a_failing_test_of_either_run_fails_the_verb(ran, capsys, at):
    _, answer = ran
    answer["statuses"][at], answer["lines"][at] = 1, "= 2 failed, 1 error in 3.2s ="
    assert app.main(["test", "--json"]) == 1
    told = json.loads(capsys.readouterr().out)
    assert (told["ok"], told["pytest"]["failed"], told["pytest"]["error"]) == (False, 2, 1)


def test_output_passes_through_and_the_last_line_is_kept(tmp_path):
    output = io.StringIO()
    command = [sys.executable, "-c", "print('first'); print('= 1 passed ='); print(); raise SystemExit(3)"]
    outcome = verb.run_checker("pytest", command, tmp_path, output)
    assert output.getvalue().startswith("first\n")
    assert (outcome.status, outcome.last_line) == (3, "= 1 passed =")


def test_an_installation_without_its_checkout_says_so(monkeypatch, tmp_path):
    monkeypatch.setenv("DT_STATION_ROOT", str(tmp_path))
    monkeypatch.setattr(verb, "__file__", str(tmp_path / "test.py"))
    with pytest.raises(UserError, match="run them from a checkout"):
        verb.checkout()
