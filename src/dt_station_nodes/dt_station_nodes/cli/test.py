"""`dt-station test`: the checkers, then every test."""

import os
import re
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import IO, Annotated

import typer

from .common import JsonOption, UserError, console, emit_json, leave

CONTEXT_SETTINGS = {"allow_extra_args": True, "ignore_unknown_options": True}

TYPED_FOR = (3, 11)
"""The Python whose locked numpy the sources are typed against; numpy's own types change with its versions."""

NO_TESTS = 5
"""pytest's exit status where nothing was collected."""

BESIDE = ("-n", "auto", "--maxprocesses", "8", "--dist", "loadfile", "--no-loadscope-reorder", "-m", "not live")
"""What keeps to itself runs on every core, file by file, the longest first (test/conftest.py)."""

ALONE = ("-m", "live")

_COUNT = re.compile(r"(\d+) (passed|failed|errors?|skipped|xfailed|xpassed|deselected)")


@dataclass(frozen=True, slots=True)
class Outcome:
    """What one checker said: its exit status, seconds, and last line."""

    name: str
    status: int
    seconds: float
    last_line: str

    def as_dict(self) -> dict[str, object]:
        """For --json; pytest's closing line also as counts."""
        counts = {word.rstrip("s") if word.startswith("error") else word: int(n) for n, word in self.counts()}
        return {"status": self.status, "seconds": round(self.seconds, 1), "last_line": self.last_line, **counts}

    def and_then(self, other: "Outcome") -> "Outcome":
        """One outcome of two pytest runs; a run without tests is no failure where the other had some."""
        ran = [one for one in (self, other) if one.status != NO_TESTS] or [self]
        words: dict[str, int] = {}
        for number, word in (pair for one in ran for pair in one.counts()):
            words[word] = words.get(word, 0) + int(number)
        line = ", ".join(f"{number} {word}" for word, number in words.items()) or ran[-1].last_line
        return Outcome(self.name, max(one.status for one in ran), self.seconds + other.seconds, line)

    def counts(self) -> list[tuple[str, str]]:
        """Numbers and words of pytest's closing line; empty for other checkers."""
        return _COUNT.findall(self.last_line) if self.name == "pytest" else []


def checkout() -> Path:
    """The folder with the tests. Raises UserError where the package is installed without its checkout."""
    named = os.environ.get("DT_STATION_ROOT")
    for folder in (*([Path(named)] if named else []), *Path(__file__).resolve().parents):
        if (folder / "pyproject.toml").is_file() and (folder / "test").is_dir():
            return folder
    raise UserError("the tests are not part of this installation; run them from a checkout with ./dt-station test.")


def run_checker(name: str, command: Sequence[str], root: Path, output: IO[str]) -> Outcome:
    """Run one checker in the checkout, its output passed on line by line."""
    start = time.monotonic()
    last = ""
    with subprocess.Popen(command, cwd=root, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
        for line in process.stdout or ():
            output.write(line)
            output.flush()
            last = line.strip() or last
        status = process.wait()
    return Outcome(name, status, time.monotonic() - start, last)


def test(
    context: typer.Context,
    lint: Annotated[bool, typer.Option(help="Run ruff and mypy first.")] = True,
    json: JsonOption = False,
) -> None:
    """Run ruff, mypy and every test; further arguments go to pytest.

    Example: dt-station test --no-lint -k waveform -x
    """
    root = checkout()
    output = sys.stderr if json else sys.stdout
    python = sys.executable
    outcomes = []

    def run(name: str, *arguments: str) -> Outcome:
        console.rule(name)
        return run_checker(name, [python, "-m", name, *arguments], root, output)

    if lint:
        outcomes.append(run("ruff", "check", "."))
        if sys.version_info[:2] == TYPED_FOR:
            outcomes.append(run("mypy"))
        else:
            console.print(f"mypy is left out: the types are checked on Python {'.'.join(map(str, TYPED_FOR))}")
    # Where pytest-xdist is not installed (ROS from apt), or tests are chosen by marks, one run has them all.
    if find_spec("xdist") and "-m" not in context.args:
        beside, alone = (run("pytest", "--color=auto", *part, *context.args) for part in (BESIDE, ALONE))
        outcomes.append(beside.and_then(alone))
    else:
        outcomes.append(run("pytest", "--color=auto", *context.args))
    failed = [outcome.name for outcome in outcomes if outcome.status]
    if json:
        emit_json({"ok": not failed, **{outcome.name: outcome.as_dict() for outcome in outcomes}})
    for outcome in outcomes:
        console.print(f"{outcome.name}: {'failed' if outcome.status else 'ok'} after {outcome.seconds:.0f} s")
    if failed:
        leave(1)
