"""`discover` as a user calls it: the same files whatever the workers, which start before the search is imported."""

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar, TypeVar

import numpy as np
import pytest

from dt_station_nodes.cli.app import main
from dt_station_nodes.core.models import ModelSpec, PathSpec
from dt_station_nodes.core.run import Run
from dt_station_nodes.discovery import DiscoveryResult, discover
from dt_station_nodes.identification import TransferFunction
from dt_station_nodes.records import write_csv
from dt_station_nodes.workers import Workers
from support.known_systems import noisy, response

T = TypeVar("T")
R = TypeVar("R")

LAG = PathSpec(numerator=(1.0,), denominator=(0.1, 1.0), scale=1e6, rest=1e6)


class Counted(Workers):
    """Workers that say how they were used."""

    made: ClassVar[list["Counted"]] = []

    def __init__(self, jobs: int = 1) -> None:
        super().__init__(jobs)
        self.jobs, self.begun_with, self.shared = jobs, (), 0
        self.made.append(self)

    def start(self, *modules: str) -> None:
        self.begun_with = modules

    def results(self, work: Callable[[T], R], tasks: Sequence[T]) -> Iterator[R]:
        self.shared += len(tasks)
        yield from map(work, tasks)


@pytest.fixture
def counted(monkeypatch: pytest.MonkeyPatch) -> list[Counted]:
    Counted.made.clear()
    monkeypatch.setattr("dt_station_nodes.workers.Workers", Counted)
    return Counted.made


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A run that the model tells to the noise, and the model."""
    folder = tmp_path_factory.mktemp("given")
    spec = ModelSpec(name="lag", paths={"pressure": LAG})
    (folder / "lag.yaml").write_text(spec.to_yaml())
    voltage = 2.5 + 2.5 * np.sign(np.sin(0.5 * np.arange(400) * 0.02))
    pressure = 1e6 * (1.0 + noisy(response(TransferFunction((1.0,), (0.1, 1.0)), voltage), 3))
    write_csv(Run(0.02, {"load_voltage_v": voltage, "pressure_pa": pressure}), folder / "run.csv")
    return folder / "run.csv", folder / "lag.yaml"


def test_the_files_are_the_same_whatever_the_workers(
    files: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run, model = map(str, files)
    for jobs in ("1", "2"):
        call = ["discover", run, "--model", model, "--validate", run, "--jobs", jobs, "--out", str(tmp_path / jobs)]
        assert main([*call, "--json"]) == 0
        assert json.loads(capsys.readouterr().out)["verdict"] == "nothing_missing"
    for name in ("model.yaml", "discovery.json", "report.html"):
        assert (tmp_path / "1" / name).read_bytes() == (tmp_path / "2" / name).read_bytes()


def test_workers_are_begun_early_and_draw_the_pictures(
    files: tuple[Path, Path], tmp_path: Path, counted: list[Counted]
) -> None:
    run, model = map(str, files)
    assert main(["discover", run, "--model", model, "--jobs", "2", "--out", str(tmp_path / "out"), "--json"]) == 0
    (workers,) = counted
    pictures = (tmp_path / "out" / "report.html").read_text().count("<svg")
    assert workers.jobs == 2
    assert workers.begun_with
    assert workers.shared == pictures > 0


def test_what_was_interrupted_is_drawn_without_helpers_that_may_still_be_at_work(
    monkeypatch: pytest.MonkeyPatch, files: tuple[Path, Path], tmp_path: Path, counted: list[Counted]
) -> None:
    def interrupted(*given: Any, workers: Workers) -> DiscoveryResult:
        return replace(discover(*given, workers=workers), interrupted=True)

    monkeypatch.setattr("dt_station_nodes.cli.discover_job.search", interrupted)
    run, model = map(str, files)
    assert main(["discover", run, "--model", model, "--jobs", "2", "--out", str(tmp_path / "out"), "--json"]) == 0
    assert [workers.shared for workers in counted] == [0]
    assert "<svg" in (tmp_path / "out" / "report.html").read_text()


def test_of_many_runs_each_has_one_worker(files: tuple[Path, Path], tmp_path: Path, counted: list[Counted]) -> None:
    run, model = map(str, files)
    assert main(["discover", run, run, "--model", model, "--jobs", "2", "--out", str(tmp_path / "out"), "--json"]) == 0
    assert [workers.jobs for workers in counted] == [1]
    assert len(list((tmp_path / "out").glob("*/report.html"))) == 2
