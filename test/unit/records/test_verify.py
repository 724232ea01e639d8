"""Verification: a run of the same classes is identical; one bit, one file, one parameter more is found."""

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import yaml

from dt_station_nodes.cli.app import main
from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.control import ControlInput, LoopConfig, LoopController
from dt_station_nodes.core.models import ModelSpec, PlantModel
from dt_station_nodes.core.samples import PlantSample, ValveCommand
from dt_station_nodes.core.shadow import Shadow
from dt_station_nodes.core.twin import CommandTwin
from dt_station_nodes.nodes import convert
from dt_station_nodes.records.bagwriter import BagWriter, RecordedTopic, WriterOptions
from dt_station_nodes.records.definitions import installed_definition, type_hash
from dt_station_nodes.records.provenance import provenance
from dt_station_nodes.records.rosbag2 import TopicInfo
from support import bags

CONFIG = Path(__file__).parents[3] / "config"
SAMPLES, STEP_S = 120, 0.02
TYPES = {
    "object/state": "PlantState",
    "twin/state": "PlantState",
    "load/command": "ValveCommand",
    "shadow/residual": "Residual",
}
Messages = dict[str, list[bytes]]


def nudged(value: float) -> float:
    return math.nextafter(value, math.inf)


@pytest.fixture(scope="module")
def model() -> str:
    return (CONFIG / "models" / "paper.yaml").read_text()


@pytest.fixture(scope="module")
def controller() -> str:
    return (CONFIG / "controllers" / "pressure_pi.yaml").read_text()


def make_run(model: str, controller: str, wrong: str = "", at: int = 57) -> Messages:
    """The messages of a run; in topic `wrong` one number of sample `at` is one bit too large."""
    loop = LoopController(LoopConfig.from_yaml(controller), STEP_S)
    twin = CommandTwin(PlantModel(ModelSpec.from_yaml(model), STEP_S), True)
    shadow = Shadow(STEP_S, 1.0)
    loop_state, twin_state, shadow_state = loop.initial_state(), twin.initial_state(), shadow.initial_state()
    found: Messages = {topic: [] for topic in TYPES}
    voltage = 0.0
    for k in range(SAMPLES):
        values = bags.state_values(k)
        stamp = bags.START_NS + k * bags.STEP_NS
        sample = PlantSample(k, stamp, values["position"], values["pressure"], voltage, values["servo_voltage"])
        loop_state, output = loop.step(loop_state, ControlInput(2.5e6, sample.pressure_pa, sample.pressure_pa))
        voltage = output.voltage_v
        command = ValveCommand(k, stamp, voltage, 2.5e6, output.mode, output.limited)
        twin_state, simulated = twin.step(twin_state, sample)
        if wrong == "twin/state" and k == at:
            simulated = replace(simulated, position_m=nudged(simulated.position_m))
        if wrong == "load/command" and k == at:
            command = replace(command, voltage_v=nudged(command.voltage_v))
        shadow_state, _ = shadow.measured(shadow_state, sample)
        shadow_state, scores = shadow.simulated(shadow_state, simulated)
        assert scores is not None
        figures = [
            (score.residual, score.ise, score.window_rms, score.fit_percent)
            for score in (scores[Channel.POSITION], scores[Channel.PRESSURE])
        ]
        if wrong == "shadow/residual" and k == at:
            figures[1] = (*figures[1][:1], nudged(figures[1][1]), *figures[1][2:])
        found["object/state"].append(convert.state_to_bytes(sample))
        found["load/command"].append(convert.command_to_bytes(command))
        found["twin/state"].append(convert.state_to_bytes(simulated))
        found["shadow/residual"].append(
            convert.residual_to_bytes(convert.ResidualSample(k, stamp, figures[0], figures[1]))
        )
    return found


def write(folder: Path, messages: Messages, model: str, controller: str, context: dict[str, str] | None = None) -> Path:
    writer = BagWriter(folder, WriterOptions(sync=False), provenance({}) if context is None else context)
    common: dict[str, Any] = {"sample_time_s": STEP_S}
    parameters = {
        "pressure_controller": {**common, "config": "pressure_pi", "mode": "pi"},
        "twin_simulator": {**common, "model": "paper", "feed": "commands", "measured_pressure": True},
        "shadow_compare": {**common, "window_s": 1.0},
    }
    files = {f"parameters/{node}.yaml": yaml.safe_dump(values) for node, values in parameters.items()}
    files |= {"models/paper.yaml": model, "controllers/pressure_pi.yaml": controller}
    for name, text in files.items():
        writer.attach(name, "application/yaml", text.encode(), bags.START_NS)
    for i, topic in enumerate(messages):
        kind = f"dt_station_msgs/msg/{TYPES[topic]}"
        text = installed_definition(kind)
        info = TopicInfo(f"/station/{topic}", kind, 0, bags.QOS, type_hash(kind, text))
        number = writer.topic(RecordedTopic(info, text))
        for k, data in enumerate(messages[topic]):
            writer.write(number, k, bags.START_NS + k * bags.STEP_NS + i * 1000, data)
        writer.tick(1.0)
    writer.close()
    return folder


def verdict(capsys: pytest.CaptureFixture[str], folder: Path, status: int) -> dict[str, Any]:
    capsys.readouterr()
    assert main(["verify", str(folder), "--json"]) == status
    return json.loads(capsys.readouterr().out)


def test_a_run_of_the_same_classes_is_identical(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], model: str, controller: str
) -> None:
    said = verdict(capsys, write(tmp_path / "bag", make_run(model, controller), model, controller), 0)
    assert said["identical"]
    assert {t["topic"]: t["samples"] for t in said["topics"]} == {
        "load/command": SAMPLES,
        "twin/state": SAMPLES,
        "shadow/residual": SAMPLES,
    }
    assert said["versions_differ"] == {}
    assert said["files_differ"] == []


@pytest.mark.parametrize(
    ("topic", "field"),
    [("load/command", "voltage"), ("twin/state", "position"), ("shadow/residual", "pressure_ise")],
)
def test_one_bit_is_found_with_topic_field_and_both_values(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], model: str, controller: str, topic: str, field: str
) -> None:
    folder = write(tmp_path / "bag", make_run(model, controller, topic), model, controller)
    said = verdict(capsys, folder, 1)
    wrong = [t for t in said["topics"] if not t["identical"]]
    assert wrong[0]["topic"] == topic
    first = wrong[0]["first_difference"]
    assert (first["sequence"], first["field"]) == (57, field)
    assert float(first["recorded"]) == nudged(float(first["computed"]))
    main(["verify", str(folder)])
    text = capsys.readouterr().out
    assert f"{topic}: sample 57 is the first to differ: {field} recorded {first['recorded']}" in text


def test_other_versions_and_files_are_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], model: str, controller: str
) -> None:
    other = model.replace("name: paper", "name: paper # another")
    folder = write(tmp_path / "bag", make_run(other, controller), other, controller, {"numpy": "0.1"})
    said = verdict(capsys, folder, 0)
    assert said["versions_differ"]["numpy"]["recorded"] == "0.1"
    assert said["files_differ"] == ["models/paper.yaml"]


def test_another_model_than_the_one_used_is_found(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], model: str, controller: str
) -> None:
    other = model.replace("206.4", "206.5")
    assert other != model
    said = verdict(capsys, write(tmp_path / "bag", make_run(model, controller), other, controller), 1)
    assert [t["topic"] for t in said["topics"] if not t["identical"]] == ["twin/state"]


def test_lost_samples_of_the_object_are_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], model: str, controller: str
) -> None:
    messages = make_run(model, controller)
    del messages["object/state"][50]
    said = verdict(capsys, write(tmp_path / "bag", messages, model, controller), 1)
    assert "1 samples of the object are missing" in said["not_verified"]["object/state"]


def test_a_bag_without_parameters_says_what_it_lacks(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    said = verdict(capsys, bags.write_bag(tmp_path / "bag", 20), 1)
    assert "does not hold the parameters of" in said["not_verified"]["load/command"]
