"""Rig files: the shipped ones, bases, and one sentence for each mistake."""

from pathlib import Path

import pytest

from dt_station_nodes.core.errors import StationError
from dt_station_nodes.hardware.virtual import VirtualRig, load_rig

SHIPPED = sorted((Path(__file__).parents[3] / "config" / "rigs").glob("*.yaml"))


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_shipped_rigs_can_be_simulated(path):
    config = load_rig(path)
    assert config.name == path.stem
    assert VirtualRig(config, 0.02).read(VirtualRig(config, 0.02).initial_state())[0] == pytest.approx(1e6, abs=2e4)


def test_a_name_is_enough(monkeypatch, tmp_path):
    assert load_rig("paper").name == "paper"
    (tmp_path / "rigs").mkdir()
    (tmp_path / "rigs" / "mine.yaml").write_text(SHIPPED[0].with_name("paper.yaml").read_text())
    monkeypatch.setenv("DT_STATION_CONFIG", str(tmp_path))
    assert load_rig("mine") == load_rig("paper")


def test_a_base_is_overlaid_key_by_key_and_null_removes():
    paper, ideal = load_rig("paper"), load_rig("ideal")
    assert ideal.friction is None
    assert ideal.relief_valve.hysteresis is None
    assert ideal.relief_valve.armature_frequency_rad_s == paper.relief_valve.armature_frequency_rad_s
    assert ideal.tested_cylinder == paper.tested_cylinder


def written(folder, text):
    path = folder / "rig.yaml"
    path.write_text(text)
    return path


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "must be a mapping"),
        ("- 1", "must be a mapping"),
        ("name: [", "not valid YAML at line"),
        ("base: rig", "leads back"),
        ("base: nowhere", "cannot read the rig"),
        ("name: x", "tested_cylinder"),
        ("base: BASE\nname: x\nrelief_valve: {gain_pa_v: -1}", "relief_valve.gain_pa_v"),
        ("base: BASE\nname: x\nrelief_valve: {gain_pa_v: fast}", "relief_valve.gain_pa_v"),
        ("base: BASE\nname: x\nrelief_valve: {gain_pa_v: .nan}", "relief_valve.gain_pa_v"),
        ("base: BASE\nname: x\nrelief_valve: {colour: red}", "relief_valve.colour"),
        ("base: BASE\nname: x\nload_output: {low_v: 6}", "low_v must be less than high_v"),
        ("base: BASE\nname: x\nfriction: {static_n: 1}", "static_n must not be less"),
        ("base: BASE\nname: x\naxis: {start_position_m: 1}", "half the stroke"),
        ("base: BASE\nname: x\nload_cylinder: {rod_diameter_m: 0.06}", "rod_diameter_m must be less"),
        ("base: BASE\nname: x\nrelief_valve: {override_pa_s_m3: 1e10}", "override_pa_s_m3"),
    ],
)
def test_a_bad_file_gets_one_sentence_that_names_it(tmp_path, text, says):
    (tmp_path / "good.yaml").write_text(SHIPPED[0].with_name("paper.yaml").read_text())
    path = written(tmp_path, text.replace("BASE", "good"))
    with pytest.raises(StationError) as caught:
        load_rig(path)
    sentence = str(caught.value)
    assert says in sentence
    assert "\n" not in sentence
    assert str(tmp_path) in sentence


def test_missing_and_unknown_rigs(tmp_path):
    with pytest.raises(StationError, match="cannot read the rig"):
        load_rig(tmp_path / "none.yaml")
    with pytest.raises(StationError, match="no rig is called papper; .*paper"):
        load_rig("papper")


def test_what_cannot_be_simulated_is_said(tmp_path):
    base = SHIPPED[0].with_name("paper.yaml").read_text()
    (tmp_path / "good.yaml").write_text(base)
    weak = written(tmp_path, "base: good\nname: x\nservo_valve: {supply_pressure_pa: 2.0e5}")
    with pytest.raises(StationError, match="supply_pressure_pa"):
        VirtualRig(load_rig(weak), 0.02)
    slow = written(tmp_path, "base: good\nname: x\nrelief_valve: {delay_s: 3.0}")
    with pytest.raises(StationError, match="delay of 3"):
        VirtualRig(load_rig(slow), 0.02)
